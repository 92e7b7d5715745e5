"""Stand-ins for the look at a recording, put into the processes of workers by a ``sitecustomize.py``.

A recording whose name begins with ``killer`` kills its process, one with ``greedy`` takes memory until it is
stopped, one with ``sleeper`` takes 50 ms and gives a run folder with nothing in it; others are looked at.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import stairmap
from stairmap.batch import recording_task
from stairmap.batch.look import Look

SITECUSTOMIZE = """
import sys
if any("task_main" in word for word in sys.orig_argv):
    import stand_in_looks
    stand_in_looks.install()
"""

NAP_S = 0.05


def prepare(folder: Path) -> dict[str, str]:
    """Return the environment in which workers use the stand-ins."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sitecustomize.py").write_text(SITECUSTOMIZE)
    package = Path(stairmap.__file__).parents[1]
    path = [folder, package, Path(__file__).parent, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}


def install() -> None:
    """Put the stand-ins in place of ``look_at_input``."""
    look_at_input = recording_task.look_at_input

    def look(path, settings, output, **options):
        name = path.name
        if name.startswith("killer"):
            os.kill(os.getpid(), signal.SIGKILL)
        if name.startswith("greedy"):
            hoard = []
            for _ in range(200):
                hoard.append(bytearray(b"x" * 2**24))
                time.sleep(0.01)
            sys.exit(1)
        if name.startswith("sleeper"):
            time.sleep(NAP_S)
            output.mkdir(parents=True)
            with (output.parent.parent / "looks.log").open("a") as log:
                log.write(name + "\n")
            return Look(num_frames=1)
        return look_at_input(path, settings, output, **options)

    recording_task.look_at_input = look

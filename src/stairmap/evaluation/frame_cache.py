"""Depth images of simulated drives, kept on disk between runs: rendering takes most of an evaluation's time.

Frames are rounded as a recording on disk would hold them, with and without a cache, so that both
give the same results, which are those of ``stairmap simulate`` and ``stairmap run``. The name of the
folder holds a sum of the simulation's source: another simulator never reads old frames.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np

import stairmap
from stairmap.frame import DepthFrame
from stairmap.output_files import write_whole
from stairmap.recordings.depth_png import decode_depth_png, encode_depth_png
from stairmap.simulation.recording import DEPTH_SCALE
from stairmap.simulation.simulate import Simulation


def recorded_frames(simulation: Simulation, folder: Path | None = None) -> Iterator[DepthFrame]:
    """Yield the frames of a drive as a recording of it would.

    Parameters
    ----------
    simulation
        The drive.
    folder
        Where the images are, or are put if they are not all there; ``None``: they are not kept.
    """
    if folder is not None and (folder / "complete").exists():
        camera = simulation.sensor.camera
        for stamp_ns in simulation.stamps_ns:
            depth = decode_depth_png((folder / f"{stamp_ns}.png").read_bytes(), DEPTH_SCALE)
            yield DepthFrame(stamp_ns=int(stamp_ns), depth=depth, camera=camera)
        return
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    for frame, _, _ in simulation.frames():
        if folder is not None:
            data = encode_depth_png(frame.depth, DEPTH_SCALE)
            write_whole(folder / f"{frame.stamp_ns}.png", data, durable=False)
        values = np.rint(frame.depth.astype(np.float64) * DEPTH_SCALE).astype(np.float32)
        depth = values / np.float32(DEPTH_SCALE)
        yield DepthFrame(stamp_ns=frame.stamp_ns, depth=depth, camera=frame.camera)
    if folder is not None:
        (folder / "complete").touch()


@lru_cache(maxsize=1)
def simulation_sum() -> str:
    """Return a short sum over the simulation's source files."""
    digest = hashlib.sha256()
    for path in sorted((Path(stairmap.__file__).parent / "simulation").glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]

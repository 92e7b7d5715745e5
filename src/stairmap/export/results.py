"""The run folder: every file that a run leaves behind (docs/outputs.md).

Nothing is ever overwritten. ``detections.jsonl``, ``history.jsonl``, ``trajectory.tum`` and ``log.txt`` grow
line by line while the run goes on, so that a killed run loses nothing; every other file appears whole or not
at all.

A file that cannot be written, on a full disk say, does not end the run: the folder tells of it and goes on
with the others. ``close`` then raises the error, when everything else is done.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

import stairmap
from stairmap.arrays import Transform
from stairmap.config import Config, dump_config
from stairmap.detection.observation import Detection
from stairmap.drop import Drop
from stairmap.errors import OutputError
from stairmap.export.mesh import ply_from_stairways
from stairmap.output_files import (
    LineLog,
    ReservedSpace,
    check_has_room,
    check_new_folder,
    next_folder,
    output_error,
    write_whole,
    write_whole_text,
)
from stairmap.recordings.tum_trajectory import TUM_HEADER, tum_line, tum_text
from stairmap.stairway import Stairway, rounded
from stairmap.trajectory import Trajectory

SCHEMA = 2
"""Version of ``stairways.json`` that is written."""

READABLE_SCHEMAS = (1, 2)
"""Versions that are read; what 1 does not tell (overhang, whether ends were seen, deviations of single
steps) is unknown."""

STAIRWAYS_FILE = "stairways.json"
DETECTIONS_FILE = "detections.jsonl"
TRAJECTORY_FILE = "trajectory.tum"


SUMMARY_FILE = "summary.txt"
REPORT_FILE = "report.html"
SURFACE_FILE = "stairways.ply"
LOG_FILE = "log.txt"
CONFIG_FILE = "config.yaml"

RESERVED_SIZE = 2 * 2**20
"""Space that is kept free for the results of a run on a disk that fills up, bytes: a hundred stairways and
the poses of 10,000 frames."""


class RunFolder:
    """Writes the files of one run into a folder that already exists and is empty.

    Use it as a context manager, or call ``close`` at the end.

    Parameters
    ----------
    path
        The folder; see ``create_run_folder``.

    Attributes
    ----------
    on_failure
        Told a sentence at once when a file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.on_failure: Callable[[str], None] = lambda _: None
        self._logs: dict[str, LineLog] = {}
        self._failures: dict[str, str] = {}
        self._reserved = ReservedSpace(path, RESERVED_SIZE)

    @property
    def failures(self) -> tuple[str, ...]:
        """What could not be written, a sentence each."""
        return tuple(self._failures.values())

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
        else:
            self._close_logs()
            self._reserved.release()

    def close(self) -> None:
        """Close the files that grow during the run.

        Raises
        ------
        OutputError
            If a file of the folder could not be written.
        """
        self._close_logs()
        self._reserved.release()
        self.check()

    def check(self) -> None:
        """Raise what could not be written so far.

        Raises
        ------
        OutputError
            If a file of the folder could not be written.
        """
        if self._failures:
            names = ", ".join(sorted(self._failures))
            raise OutputError(
                f"{next(iter(self._failures.values()))}; missing or cut short: {names}; make room or choose "
                "another folder with --output"
            )

    def release_reserve(self) -> None:
        """Give the space that was kept free to the results, which are written now."""
        self._reserved.release()

    def append_detection(self, detection: Detection) -> None:
        """Append the line of one frame to ``detections.jsonl`` and hand it to the operating system."""
        self.append_json(DETECTIONS_FILE, detection.to_dict())

    def append_pose(self, stamp_ns: int, map_from_camera: Transform) -> None:
        """Append a frame's pose to ``trajectory.tum``, which ``write_trajectory`` replaces at the end."""
        if TRAJECTORY_FILE not in self._logs:
            self._append(TRAJECTORY_FILE, TUM_HEADER.rstrip("\n"))
        self._append(TRAJECTORY_FILE, tum_line(stamp_ns, map_from_camera).rstrip("\n"))

    def append_json(self, name: str, values: Mapping[str, Any]) -> None:
        """Append a line of JSON to a file of the folder and hand it to the operating system."""
        self._append(name, json.dumps(null_for_nan(values), allow_nan=False))

    def log(self, line: str) -> None:
        """Append a line to ``log.txt``."""
        self._append(LOG_FILE, " ".join(line.split()))

    def write_stairways(
        self,
        stairways: Sequence[Stairway],
        *,
        num_frames: int,
        frame_id: str = "map",
        drops: Sequence[Drop] = (),
        camera_height: float | None = None,
    ) -> Path:
        """Write ``stairways.json``.

        Parameters
        ----------
        stairways
            Confirmed stairways only.
        num_frames
            Number of frames that were looked at.
        frame_id
            Name of the coordinate frame of all positions.
        drops
            Where the ground ends and goes on lower.
        camera_height
            Height of the camera above the ground that it moved on, m; ``None`` where not known.
        """
        text = stairways_json(
            stairways, num_frames=num_frames, frame_id=frame_id, drops=drops, camera_height=camera_height
        )
        return self.write_text(STAIRWAYS_FILE, text)

    def write_config(self, config: Config) -> Path:
        """Write ``config.yaml``: the configuration of this run, every key resolved."""
        return self.write_text(CONFIG_FILE, dump_config(config))

    def write_trajectory(self, trajectory: Trajectory) -> Path:
        """Write ``trajectory.tum``: the poses that the stairways were placed with."""
        return self.write_text(TRAJECTORY_FILE, tum_text(trajectory))

    def write_mesh(self, stairways: Sequence[Stairway]) -> Path:
        """Write ``stairways.ply``: the clean surface of all stairways, with orange nosings."""
        return self.write_bytes(SURFACE_FILE, ply_from_stairways(stairways))

    def write_summary(self, text: str) -> Path:
        """Write ``summary.txt``; see ``stairmap.export.summary``."""
        return self.write_text(SUMMARY_FILE, text)

    def write_report(self, html: str) -> Path:
        """Write ``report.html``; see ``stairmap.visualization.report``."""
        return self.write_text(REPORT_FILE, html)

    def write_overlay(self, frame_index: int, png: bytes) -> Path:
        """Write ``overlays/NNNNNN.png`` for the frame with this number in the recording."""
        # One a frame: what a pulled plug takes of the last second can be drawn again.
        return self.write_bytes(f"overlays/{frame_index:06d}.png", png, durable=False)

    def write_text(self, name: str, text: str) -> Path:
        """Write a text file of the folder, whole or not at all; return its path."""
        return self._write(name, lambda path: write_whole_text(path, text))

    def write_bytes(self, name: str, content: bytes, *, durable: bool = True) -> Path:
        """Write a file of the folder, whole or not at all; return its path.

        If it cannot be written, ``on_failure`` is told, and ``close`` raises it.
        """
        return self._write(name, lambda path: write_whole(path, content, durable=durable))

    def remove(self, name: str) -> None:
        """Remove a file or a folder of files that is not needed any more; that it could not be written is
        forgotten."""
        path = self.path / name
        try:
            for file in path.iterdir() if path.is_dir() else (path,):
                file.unlink(missing_ok=True)
        except OSError as error:
            self._note_failure(name, str(output_error(path, error)))
        else:
            self._failures.pop(name, None)

    def _write(self, name: str, write: Callable[[Path], object]) -> Path:
        path = self.path / name
        try:
            path.parent.mkdir(exist_ok=True)
            write(path)
        except OutputError as error:
            self._note_failure(name, str(error))
        except OSError as error:
            self._note_failure(name, str(output_error(path, error)))
        else:
            # What could not grow while the disk was full may be written whole at last.
            self._failures.pop(name, None)
        return path

    def _append(self, name: str, line: str) -> None:
        if name in self._failures:
            return
        path = self.path / name
        try:
            if name not in self._logs:
                self._logs[name] = LineLog(path)
            self._logs[name].append(line)
        except OSError as error:
            self._note_failure(name, str(output_error(path, error)), more=" any more; the run goes on")

    def _note_failure(self, name: str, sentence: str, *, more: str = "") -> None:
        # One sentence for all overlays, not one a frame.
        name = f"{name.partition('/')[0]}/" if "/" in name else name
        if name not in self._failures:
            self._failures[name] = sentence
            self.on_failure(sentence + more)

    def _close_logs(self) -> None:
        while self._logs:
            name, log = self._logs.popitem()
            try:
                log.close()
            except OSError as error:
                self._note_failure(name, str(output_error(self.path / name, error)))


def stairways_json(
    stairways: Sequence[Stairway],
    *,
    num_frames: int,
    frame_id: str = "map",
    drops: Sequence[Drop] = (),
    camera_height: float | None = None,
) -> str:
    """Return the text of ``stairways.json``; see ``RunFolder.write_stairways``."""
    values = {
        "schema": SCHEMA,
        "software": f"stairmap {stairmap.__version__}",
        "frame_id": frame_id,
        "num_frames": num_frames,
        "stairways": [stairway.to_dict() for stairway in stairways],
        "drops": [drop.to_dict() for drop in drops],
        "camera_height": None if camera_height is None else rounded(camera_height),
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False) + "\n"


def create_run_folder(output: Path | None, recording_name: str) -> RunFolder:
    """Create the folder of a run.

    Parameters
    ----------
    output
        Where to create it; it may exist if it is empty. ``None`` takes the first free
        ``results/<recording>_<n>`` below the working directory.
    recording_name
        Name of the recording; what a file name cannot hold is replaced.

    Raises
    ------
    OutputError
        If the folder is not empty, is a file, or cannot be created or written to.
    """
    path = next_folder(Path("results"), recording_name) if output is None else _prepare_output(output)
    try:
        check_has_room(path)
    except OutputError:
        path.rmdir()
        raise
    folder = RunFolder(path)
    # Learn now, not after an hour of frames, that nothing can be written here.
    folder.write_text(DETECTIONS_FILE, "")
    if folder.failures:
        folder.release_reserve()
        raise OutputError(f"{folder.failures[0]}; choose another folder with --output")
    return folder


def _prepare_output(output: Path) -> Path:
    check_new_folder(output)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{output_error(output, error)}; choose another folder with --output") from error
    return output


def null_for_nan(values: Any) -> Any:
    """Return nested JSON types with ``None`` for every number that is not finite.

    JSON has no NaN; ``null`` says that a number is not known.
    """
    if isinstance(values, dict):
        return {key: null_for_nan(value) for key, value in values.items()}
    if isinstance(values, str):
        return values
    if isinstance(values, Iterable):
        return [null_for_nan(value) for value in values]
    return None if isinstance(values, float) and not np.isfinite(values) else values

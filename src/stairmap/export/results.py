"""The run folder: every file that a run leaves behind (ARCHITECTURE.md section 6, docs/outputs.md).

Nothing is ever overwritten. ``detections.jsonl``, ``history.jsonl`` and ``log.txt`` grow line by
line while the run goes on, so that an interrupted run loses nothing; every other file appears
whole or not at all.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np

import stairmap
from stairmap.config import Config, dump_config
from stairmap.detection.observation import Detection
from stairmap.errors import OutputError
from stairmap.export.mesh import ply_from_stairways
from stairmap.recordings.tum_trajectory import dump_tum_trajectory
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

SCHEMA = 2
"""Version of ``stairways.json`` that is written."""

READABLE_SCHEMAS = (1, 2)
"""Versions that are read; what 1 does not tell (overhang, whether ends were seen, deviations of single
steps) is unknown."""

STAIRWAYS_FILE = "stairways.json"
DETECTIONS_FILE = "detections.jsonl"
TRAJECTORY_FILE = "trajectory.tum"


class RunFolder:
    """Writes the files of one run into a folder that already exists and is empty.

    Use it as a context manager, or call ``close`` at the end.

    Parameters
    ----------
    path
        The folder; see ``create_run_folder``.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._open_files: dict[str, IO[str]] = {}

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the files that grow during the run."""
        while self._open_files:
            _, file = self._open_files.popitem()
            try:
                file.close()
            except OSError as error:
                raise _output_error(Path(file.name), error) from error

    def append_detection(self, detection: Detection) -> None:
        """Append the line of one frame to ``detections.jsonl`` and hand it to the operating system."""
        self.append_json(DETECTIONS_FILE, detection.to_dict())

    def append_json(self, name: str, values: Mapping[str, Any]) -> None:
        """Append a line of JSON to a file of the folder and hand it to the operating system."""
        self._append(name, json.dumps(null_for_nan(values), allow_nan=False))

    def log(self, line: str) -> None:
        """Append a line to ``log.txt``."""
        self._append("log.txt", line)

    def write_stairways(
        self, stairways: Sequence[Stairway], *, num_frames: int, frame_id: str = "map"
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
        """
        values = {
            "schema": SCHEMA,
            "software": f"stairmap {stairmap.__version__}",
            "frame_id": frame_id,
            "num_frames": num_frames,
            "stairways": [stairway.to_dict() for stairway in stairways],
        }
        text = json.dumps(null_for_nan(values), indent=1, allow_nan=False)
        return self.write_text(STAIRWAYS_FILE, text + "\n")

    def write_config(self, config: Config) -> Path:
        """Write ``config.yaml``: the configuration of this run, every key resolved."""
        return self.write_text("config.yaml", dump_config(config))

    def write_trajectory(self, trajectory: Trajectory) -> Path:
        """Write ``trajectory.tum``: the poses that the stairways were placed with."""
        path = self.path / TRAJECTORY_FILE
        dump_tum_trajectory(path, trajectory)
        return path

    def write_mesh(self, stairways: Sequence[Stairway]) -> Path:
        """Write ``stairways.ply``: the clean surface of all stairways, with orange nosings."""
        return self.write_bytes("stairways.ply", ply_from_stairways(stairways))

    def write_summary(self, text: str) -> Path:
        """Write ``summary.txt``; see ``stairmap.export.summary``."""
        return self.write_text("summary.txt", text)

    def write_report(self, html: str) -> Path:
        """Write ``report.html``; see ``stairmap.visualization.report``."""
        return self.write_text("report.html", html)

    def write_overlay(self, frame_index: int, png: bytes) -> Path:
        """Write ``overlays/NNNNNN.png`` for the frame with this number in the recording."""
        return self.write_bytes(f"overlays/{frame_index:06d}.png", png)

    def write_text(self, name: str, text: str) -> Path:
        """Write a text file of the folder, whole or not at all; return its path."""
        return self.write_bytes(name, text.encode("utf-8"))

    def write_bytes(self, name: str, content: bytes) -> Path:
        """Write a file of the folder, whole or not at all; return its path.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        path = self.path / name
        partial = path.with_name(f".{path.name}.partial")
        try:
            path.parent.mkdir(exist_ok=True)
            partial.write_bytes(content)
            partial.replace(path)
        except OSError as error:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)
            raise _output_error(path, error) from error
        return path

    def _append(self, name: str, line: str) -> None:
        path = self.path / name
        try:
            if name not in self._open_files:
                self._open_files[name] = path.open("a", encoding="utf-8")
            file = self._open_files[name]
            # One write per line, so that an interrupt between two writes cannot split it.
            file.write(line + "\n")
            file.flush()
        except OSError as error:
            raise _output_error(path, error) from error


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
    path = _next_results_folder(recording_name) if output is None else _prepare_output(output)
    folder = RunFolder(path)
    # Learn now, not after an hour of frames, that nothing can be written here.
    folder.write_text(DETECTIONS_FILE, "")
    return folder


def _prepare_output(output: Path) -> Path:
    try:
        if output.exists() and not output.is_dir():
            raise OutputError(f"--output {output} is a file; name a folder that is new or empty")
        output.mkdir(parents=True, exist_ok=True)
        if any(output.iterdir()):
            raise OutputError(
                f"--output {output} is not empty and results are never overwritten; name another folder"
            )
    except OSError as error:
        raise _output_error(output, error) from error
    return output


def _next_results_folder(recording_name: str) -> Path:
    name = re.sub(r"[^\w.-]+", "_", recording_name).strip("._") or "recording"
    parent = Path("results")
    try:
        parent.mkdir(exist_ok=True)
        taken = [re.fullmatch(rf"{re.escape(name)}_(\d+)", entry.name) for entry in parent.iterdir()]
        number = 1 + max((int(match[1]) for match in taken if match), default=0)
        while True:
            path = parent / f"{name}_{number}"
            try:
                path.mkdir()
            except FileExistsError:  # another run took the number in the meantime
                number += 1
            else:
                return path
    except OSError as error:
        raise _output_error(parent / name, error) from error


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


def _output_error(path: Path, error: OSError) -> OutputError:
    reason = error.strerror or str(error)
    return OutputError(f"cannot write {path}: {reason}; choose another folder with --output")

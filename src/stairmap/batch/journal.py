"""``batch.jsonl``: what a batch has begun and done, line by line, so that it goes on where it was ended.

A line is ``{"recording", "fingerprint", "folder"}`` when a recording gets its folder's name, and a whole
result when it is done or has failed; the last result of a recording counts. In memory stay a name and a place
in the file for each recording.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stairmap.batch.job import RecordingResult, recording_name
from stairmap.errors import ResultsError
from stairmap.input_files import parse_json, read_lines, shown
from stairmap.output_files import MAX_NAME_LENGTH, LineLog, output_error

JOURNAL_FILE = "batch.jsonl"


class BatchJournal:
    """What a batch has begun and done.

    Parameters
    ----------
    path
        The file; it goes on from what it holds.
    fingerprint
        Of the settings: only what was done with the same counts as done.
    taken
        Names that no run folder may have.

    Raises
    ------
    ResultsError
        If the file is no such journal.
    OutputError
        If it cannot be written.
    """

    def __init__(self, path: Path, fingerprint: str, taken: Sequence[str] = ()) -> None:
        self.path, self._fingerprint = path, fingerprint
        self._folders: dict[str, str] = {}
        self._places: dict[str, int] = {}
        self._done: dict[str, int] = {}
        self._taken = set(taken)
        self._size = self._read() if path.exists() else 0
        try:
            if path.exists() and path.stat().st_size > self._size:
                with path.open("r+b") as file:  # the end of a line that a killed process left
                    file.truncate(self._size)
            self._log = LineLog(path)
        except OSError as error:
            raise output_error(path, error) from error

    def _read(self) -> int:
        size = 0
        for number, (line, is_whole) in enumerate(read_lines(self.path, error_type=ResultsError), start=1):
            if not is_whole:
                break
            place, size = size, size + len(line.encode("utf-8", "surrogateescape")) + 1
            try:
                self._take(parse_json(line), place)
            except ValueError as error:
                raise ResultsError(
                    f"{shown(self.path)}, line {number} is not what stairmap writes: {error}"
                ) from error
        return size

    def _take(self, values: Any, place: int) -> None:
        if not isinstance(values, dict) or not all(
            isinstance(values.get(key), str) for key in ("recording", "fingerprint", "folder")
        ):
            raise ValueError("expected a recording with fingerprint and folder")
        if not isinstance(values.get("stairways", []), list):
            raise ValueError("expected a list of stairways")
        self._taken.add(values["folder"].casefold())
        if values["fingerprint"] != self._fingerprint:
            return
        recording = values["recording"]
        if values["folder"]:
            self._folders[recording] = values["folder"]
        if "stairways" in values:
            self._places[recording] = place
            if values["folder"]:
                self._done[recording] = len(values["stairways"])

    def is_done(self, recording: str) -> bool:
        """Tell whether a recording has its run folder."""
        return recording in self._done

    def num_stairways(self, recording: str) -> int:
        """Return how many stairways are in a recording's run folder; 0 as long as there is none."""
        return self._done.get(recording, 0)

    def folder_of(self, recording: str) -> str:
        """Return the name of a recording's run folder; a new one is written down before it is returned."""
        if recording not in self._folders:
            folder = self._free_name(recording)
            self._append({"recording": recording, "fingerprint": self._fingerprint, "folder": folder})
            self._folders[recording] = folder
            self._taken.add(folder.casefold())
        return self._folders[recording]

    def _free_name(self, recording: str) -> str:
        name = (
            re.sub(r"[^\w.-]+", "_", recording_name(recording))[:MAX_NAME_LENGTH].strip("._") or "recording"
        )
        candidate, number = name, 1
        while candidate.casefold() in self._taken:
            number += 1
            candidate = f"{name}_{number}"
        return candidate

    def add(self, result: RecordingResult) -> None:
        """Write down what came of a recording.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        self._places[result.recording] = self._append(result.to_dict())
        if result.is_done:
            self._done[result.recording] = len(result.stairways)

    def _append(self, values: dict[str, Any]) -> int:
        line = json.dumps(values, allow_nan=False)
        try:
            self._log.append(line)
        except OSError as error:
            raise output_error(self.path, error) from error
        place, self._size = self._size, self._size + len(line) + 1
        return place

    def result_of(self, recording: str) -> RecordingResult | None:
        """Read what came of a recording; ``None`` as long as nothing did.

        Raises
        ------
        ResultsError
            If the journal was changed meanwhile.
        """
        place = self._places.get(recording)
        if place is None:
            return None
        try:
            with self.path.open("rb") as file:
                file.seek(place)
                return RecordingResult.from_dict(parse_json(file.readline().decode("utf-8")))
        except (OSError, ValueError) as error:
            raise ResultsError(f"{shown(self.path)} was changed by somebody else: {error}") from error

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):
            self._log.close()

"""A run folder read back for viewers: its stairways, how they came about, and its frames once more."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import RecordingError, StairmapError
from stairmap.export.history import StairwaysAtStamp, load_history
from stairmap.export.loading import (
    ResultsError,
    SavedDetection,
    is_unfinished,
    load_detections,
    load_run_trajectory,
    load_stairways,
)
from stairmap.export.recording_reference import RecordingReference, load_recording_reference
from stairmap.export.results import DETECTIONS_FILE, STAIRWAYS_FILE, TRAJECTORY_FILE
from stairmap.frame import DepthFrame
from stairmap.input_files import shown
from stairmap.recordings.base import Recording
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.frame_view import FrameView, level_from_camera


@dataclass(frozen=True, slots=True, kw_only=True)
class RunReplay:
    """A run folder for viewers.

    Attributes
    ----------
    name
        Name of the folder.
    frame_id
        Name of the map's coordinate frame.
    stairways
        What was found.
    history
        The stairways as they were known earlier, oldest first.
    trajectory
        Poses of the camera; ``None`` where there are none, then each frame stands for itself.
    recording
        Where depth images come from; ``None`` where it cannot be opened.
    detections
        What each frame showed.
    has_map
        Whether stairways were looked for in a map, as 'run' does and 'detect' does not.
    notes
        What could not be had, and what would help, one sentence each.
    """

    name: str
    frame_id: str
    stairways: tuple[Stairway, ...]
    history: tuple[StairwaysAtStamp, ...]
    trajectory: Trajectory | None
    recording: Recording | None
    detections: tuple[SavedDetection, ...]
    has_map: bool = True
    notes: tuple[str, ...] = ()

    @property
    def num_frames(self) -> int:
        """Number of frames that the run looked at."""
        return len(self.detections)

    @property
    def positions(self) -> Points:
        """(N, 3) positions of the camera, map, m; empty without poses."""
        return np.empty((0, 3)) if self.trajectory is None else self.trajectory.map_from_camera[:, :3, 3]

    def frames(self, *, every: int = 1) -> Iterator[FrameView]:
        """Return the frames that the run looked at, with depth where the recording is at hand.

        Where there are poses, frames without one are left out.

        Parameters
        ----------
        every
            Return only each so many-th frame.
        """
        if self.recording is None:
            for number, detection in enumerate(self.detections[::every]):
                yield from self._view(number * every, detection, None)
            return
        number_by_stamp = {detection.stamp_ns: n for n, detection in enumerate(self.detections)}
        for frame in self.recording:
            known = number_by_stamp.get(frame.stamp_ns)
            if known is not None and known % every == 0:
                yield from self._view(known, self.detections[known], frame)

    def _view(self, number: int, detection: SavedDetection, frame: DepthFrame | None) -> Iterator[FrameView]:
        if self.trajectory is None:
            pose = level_from_camera(None if frame is None else frame.up)
        elif self.trajectory.has_pose(np.array([detection.stamp_ns]))[0]:
            pose = self.trajectory.pose_at(detection.stamp_ns)
        else:
            return
        yield FrameView(
            number=number,
            stamp_ns=detection.stamp_ns,
            map_from_camera=pose,
            observations=detection.observations,
            rejections=detection.rejections,
            frame=frame,
        )


class RunView(Protocol):
    """Something that shows a run frame by frame: a viewer or a file."""

    def show_frame(self, view: FrameView) -> None:
        """Show one frame."""
        ...

    def show_stairways(self, stairways: Sequence[Stairway], number: int, stamp_ns: int) -> None:
        """Show the stairways as they are known after the frame with this number and stamp."""
        ...

    def close(self) -> None:
        """Send or write what is left."""
        ...


def show_run(
    replay: RunReplay, views: Sequence[RunView], *, every: int = 1, advance: Callable[[], None] = lambda: None
) -> None:
    """Show the frames of a run, and after them the stairways as they were known then; close the views.

    Parameters
    ----------
    replay
        The run.
    views
        Where to show it.
    every
        Show only each so many-th frame.
    advance
        Called after each frame.
    """
    coming = deque(replay.history)
    number, stamp_ns = 0, 0
    for view in replay.frames(every=every):
        number, stamp_ns = view.number, view.stamp_ns
        known: StairwaysAtStamp | None = None
        while coming and coming[0].stamp_ns <= stamp_ns:
            known = coming.popleft()
        for target in views:
            target.show_frame(view)
            if known is not None:
                target.show_stairways(known.stairways, number, stamp_ns)
        advance()
    for target in views:
        if replay.has_map:
            target.show_stairways(replay.stairways, number, stamp_ns)
        target.close()


def load_run(run: Path, *, recording: Path | None = None) -> RunReplay:
    """Read the folder of ``stairmap run`` or ``stairmap detect``.

    A recording that is not where it was costs the depth images, not the rest: see ``RunReplay.notes``.

    Parameters
    ----------
    run
        The folder, or a file in it.
    recording
        Where the recording is now; by default where it was.

    Raises
    ------
    ResultsError
        If this is no such folder, or a file in it cannot be read.
    RecordingError
        If ``recording`` is given and cannot be opened.
    """
    folder = _check_run_folder(run)
    notes: list[str] = []
    opened = _open_recording(folder, recording, notes)
    detections = tuple(load_detections(folder)) if (folder / DETECTIONS_FILE).is_file() else ()
    history = tuple(load_history(folder))
    stairways: tuple[Stairway, ...] = ()
    frame_id = "map"
    if (folder / STAIRWAYS_FILE).is_file():
        results = load_stairways(folder)
        stairways, frame_id = results.stairways, results.frame_id
    elif history:
        stairways = history[-1].stairways
        notes.append(
            f"{folder} has no {STAIRWAYS_FILE}: the run did not end; its last known stairways are shown; "
            f"complete it with: stairmap finish {folder}"
        )
    trajectory = None
    if (folder / TRAJECTORY_FILE).exists():
        trajectory = load_run_trajectory(folder)
    elif opened is not None:
        trajectory = opened.trajectory
    return RunReplay(
        name=shown(folder.resolve().name),
        frame_id=shown(frame_id),
        stairways=stairways,
        history=history,
        trajectory=trajectory,
        recording=opened,
        detections=detections,
        has_map=is_unfinished(folder) or (folder / STAIRWAYS_FILE).is_file(),
        notes=tuple(notes),
    )


def _check_run_folder(run: Path) -> Path:
    folder = run.parent if run.is_file() else run
    if not folder.exists():
        raise ResultsError(f"expected a run folder, but there is no {folder}; check the path")
    if not any((folder / name).is_file() for name in (STAIRWAYS_FILE, DETECTIONS_FILE)):
        raise ResultsError(
            f"expected a folder that 'stairmap run' or 'stairmap detect' wrote, but {folder} holds neither "
            f"{STAIRWAYS_FILE} nor {DETECTIONS_FILE}; run: stairmap run RECORDING"
        )
    return folder


def _open_recording(folder: Path, recording: Path | None, notes: list[str]) -> Recording | None:
    reference = load_recording_reference(folder)
    if recording is not None:
        if not recording.exists():
            raise RecordingError(
                f"expected the run's recording, but there is no {recording}; check --recording"
            )
        options = {} if reference is None else reference.options
        identity = None if reference is None else reference.identity
        return RecordingReference(path=recording, options=options, identity=identity).open()
    if reference is None:
        notes.append(
            f"{folder} does not say where its recording is: shown without depth; pass --recording PATH"
        )
        return None
    try:
        return reference.open()
    except StairmapError as error:
        notes.append(f"shown without depth: {error}")
        return None

"""What every recording gives, whatever its format: depth frames, a camera, and poses if it has any.

A recording is checked when it is opened: what is wrong with its lists, calibration or
poses is an error at once. Only a single image that turns out to be damaged while it is
read is skipped, and ``problems`` tells. Frames without a pose are still given: looking at
single frames needs none. Ask ``trajectory.has_pose`` before using one in a map.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from stairmap.arrays import IntArray, Transform
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.trajectory import Trajectory

WatchOpening = Callable[[int, int], None]
"""Called now and then while a recording is opened: how many of how many messages were read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SkippedFrame:
    """A frame that could not be read.

    Attributes
    ----------
    stamp_ns
        Its stamp, in nanoseconds.
    source
        The file or message it should have come from.
    reason
        Why it could not.
    """

    stamp_ns: int
    source: str
    reason: str

    def __str__(self) -> str:
        return f"{self.source} at {self.stamp_ns * 1e-9:.6f} s: {self.reason}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingProblems:
    """What a recording could not give, and what looks strange in it; true when there is anything to tell.

    Attributes
    ----------
    skipped
        Frames that could not be read. Grows while one iterates; a new iteration starts anew.
    num_frames_without_pose
        How many declared frames have no pose; all of them for a recording without poses.
    notes
        One sentence for each thing that a user should know and that stops nothing.
    """

    skipped: tuple[SkippedFrame, ...] = ()
    num_frames_without_pose: int = 0
    notes: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.skipped or self.notes)

    def to_lines(self, *, max_skipped: int = 5) -> tuple[str, ...]:
        """Return the problems as lines for a person, the first few skipped frames by name."""
        lines = list(self.notes)
        if self.skipped:
            lines.append(f"skipped {len(self.skipped)} damaged frame{'s' if len(self.skipped) > 1 else ''}:")
            lines += [f"  {frame}" for frame in self.skipped[:max_skipped]]
            if len(self.skipped) > max_skipped:
                lines.append(f"  and {len(self.skipped) - max_skipped} more")
        return tuple(lines)


class Recording(Protocol):
    """A stream of depth frames with what is known about them.

    Iterate as often as you like; each iteration reads the frames anew, in the order of their
    stamps. A frame's ``up`` is the map's z as its pose sees it; without a pose, what the
    camera file says; otherwise ``None``.
    """

    @property
    def name(self) -> str:
        """Short name, for titles and result folders."""
        ...

    @property
    def camera(self) -> PinholeCamera:
        """The camera of all frames."""
        ...

    @property
    def num_frames(self) -> int:
        """Number of frames that the recording declares, those included that turn out to be damaged."""
        ...

    @property
    def time_range_ns(self) -> tuple[int, int]:
        """Stamps of the first and last frame declared, in nanoseconds."""
        ...

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all frames declared, in nanoseconds."""
        ...

    @property
    def frame_id(self) -> str:
        """Name of the map's coordinate frame."""
        ...

    @property
    def trajectory(self) -> Trajectory | None:
        """``map_from_camera`` at the stamps of the poses, in the map with z up; ``None`` without poses."""
        ...

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) turn of the poses' coordinate frame into the map; identity unless ``up`` asks for one."""
        ...

    @property
    def problems(self) -> RecordingProblems:
        """What was skipped, and what looks strange, as far as it is known by now."""
        ...

    def check_poses(self) -> Trajectory:
        """Return the trajectory if it gives at least one frame a pose.

        Raises
        ------
        TrajectoryError
            If there are no poses, or no frame has one; the message says what gives them.
        """
        ...

    def __iter__(self) -> Iterator[DepthFrame]: ...

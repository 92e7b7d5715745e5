"""Bags with elevation maps as recordings: ``grid_map_msgs/GridMap`` (docs/clouds.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stairmap.arrays import Transform
from stairmap.errors import RecordingError
from stairmap.height_grid import HeightGrid
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.grid_message import GRID_MAP, grid_from_message
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.stream import BagMessage
from stairmap.recordings.bags.topics import find_topic, topics_of_type
from stairmap.recordings.base import RecordingProblems, SkippedFrame
from stairmap.recordings.map_up import UP_AUTO, check_up
from stairmap.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class ElevationContents:
    """The topic of elevation maps, and the layer that the user chose, if any."""

    topic: str
    layer: str | None


class ElevationRecording:
    """A bag with the elevation maps of a robot, in the coordinate frame that they name.

    Parameters
    ----------
    path
        See ``Bag``.
    up
        Axis of that frame that points up; only z can.
    options
        ``cloud_topic`` names the topic, or ``TOPIC:LAYER``.

    Raises
    ------
    RecordingError
        If it is no bag, has no elevation maps, or none can be read; the message lists what there is.
    """

    def __init__(self, path: Path, *, up: str | None = None, options: BagOptions | None = None) -> None:
        if up is not None and check_up(up) not in ("+z", UP_AUTO):
            raise RecordingError(f"--up {up}: an elevation map's heights are along z; leave --up out")
        self._bag = Bag(path)
        wanted = None if options is None else options.cloud_topic
        topic, _, layer = (wanted or self._only_topic()).partition(":")
        found = find_topic(self._bag.topics, topic, GRID_MAP, option="--cloud-topic")
        self.contents = ElevationContents(topic=found.name, layer=layer or None)
        self._num = found.num_messages
        self._skipped: list[SkippedFrame] = []
        first = next(iter(self._bag.messages([found.name])), None)
        if first is None:
            raise RecordingError(
                f"none of the {self._num} elevation maps of {path} can be read; the bag is damaged"
            )
        self._frame_id = header_of(first)[1].lstrip("/") or "map"

    @property
    def name(self) -> str:
        """Name of the bag without its ending."""
        return self._bag.name

    @property
    def num_sweeps(self) -> int:
        """Number of elevation maps."""
        return self._num

    @property
    def frame_id(self) -> str:
        """Coordinate frame of the maps."""
        return self._frame_id

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) identity."""
        return np.eye(4)

    @property
    def problems(self) -> RecordingProblems:
        """What the latest iteration skipped."""
        return RecordingProblems(skipped=tuple(self._skipped), notes=self._bag.notes)

    def check_poses(self) -> Trajectory | None:
        """Return ``None``: an elevation map says itself where it lies."""
        return None

    def __iter__(self) -> Iterator[HeightGrid]:
        """Read the elevation maps one by one; those that cannot be used stand in ``problems``.

        Raises
        ------
        RecordingError
            At the end, if none could be read.
        """
        skipped = self._skipped = []
        latest_ns, num = -1, 0
        for message in self._bag.messages([self.contents.topic]):
            try:
                grid = self._decode(message)
                if grid.stamp_ns <= latest_ns:
                    raise RecordingError(
                        f"its stamp is not after that of the map before, {latest_ns * 1e-9:.6f} s"
                    )
            except RecordingError as error:
                skipped.append(
                    SkippedFrame(stamp_ns=message.recorded_ns, source=message.topic.name, reason=str(error))
                )
                continue
            latest_ns, num = grid.stamp_ns, num + 1
            yield grid
        if not num:
            raise RecordingError(
                f"none of the {self._num} elevation maps of {self._bag.path} can be read; the first: "
                f"{skipped[0] if skipped else 'there is none'}"
            )

    def _decode(self, message: BagMessage) -> HeightGrid:
        try:
            grid = grid_from_message(self._bag.decode(message), self.contents.layer)
        except (ValueError, IndexError, AttributeError, TypeError, OverflowError) as error:
            raise RecordingError(f"the message is no elevation map: {error}") from error
        # Maps that were made without a clock have no stamp.
        return grid if grid.stamp_ns else replace(grid, stamp_ns=message.recorded_ns)

    def _only_topic(self) -> str:
        candidates = topics_of_type(self._bag.topics, GRID_MAP)
        if len(candidates) == 1:
            return candidates[0].name
        names = ", ".join(topic.name for topic in candidates) or "none"
        raise RecordingError(
            "expected one topic with elevation maps (grid_map_msgs/GridMap), there are: "
            f"{names}; pass one with --cloud-topic"
        )

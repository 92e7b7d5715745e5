"""What a run keeps aside for its report while it goes on, in memory that does not grow with the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from stairmap.arrays import Points, Transform
from stairmap.detection.observation import Detection, Rejection
from stairmap.frame import DepthFrame
from stairmap.transforms import transform_points
from stairmap.visualization.convergence import ConvergenceRecorder
from stairmap.visualization.detection_steps import trace_png
from stairmap.visualization.overlay import draw_detection, png_from_image

T = TypeVar("T")

MAX_FRAMES_KEPT = 8
"""So many frames with, and as many without, stair edges stay in memory."""

MAX_NOSINGS_KEPT = 4_000
MAX_VALUES_KEPT = 200


class TracingDetector(Protocol):
    """A detector that can say how it came to its result."""

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Return the detection of one frame."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleStatistics:
    """How often one rule spoke against a stairway.

    Attributes
    ----------
    rule, unit
        As in ``Rejection``.
    num_frames
        Number of frames without stair edges in which the rule rejected something.
    measured, limit
        Median of what was measured there (NaN if nothing could be) and the limit that it met.
    """

    rule: str
    unit: str
    num_frames: int
    measured: float
    limit: float

    def __str__(self) -> str:
        typical = Rejection(rule=self.rule, measured=self.measured, limit=self.limit, unit=self.unit)
        return f"{self.num_frames} frame{'s' if self.num_frames > 1 else ''}: {typical} (median)"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExampleFrame:
    """One frame of the report: its number in the recording and its pictures as PNG files."""

    frame_index: int
    stamp_ns: int
    detected: bool
    overlay_png: bytes
    trace_png: bytes | None


class ThinnedSequence(Generic[T]):
    """Keeps at most ``max_length`` of all items that were added, evenly spread, without randomness."""

    def __init__(self, max_length: int) -> None:
        self._max_length = max_length
        self._stride = 1
        self._num_added = 0
        self._items: list[T] = []

    def append(self, item: T) -> None:
        """Take in an item if its turn has come; when full, every second one is given up."""
        if self._num_added % self._stride == 0:
            if len(self._items) == self._max_length:
                self._items = self._items[::2]
                self._stride *= 2
            if self._num_added % self._stride == 0:
                self._items.append(item)
        self._num_added += 1

    def items(self) -> list[T]:
        """Return the items that are kept, in the order in which they came."""
        return list(self._items)


@dataclass(frozen=True, slots=True)
class _KeptFrame:
    frame_index: int
    frame: DepthFrame
    detection: Detection


class ReportCollector:
    """Follows a run frame by frame and keeps what its report shows.

    ``add`` takes every frame; ``convergence`` takes the stairways now and then.
    """

    def __init__(self) -> None:
        self.convergence = ConvergenceRecorder()
        self.num_frames = 0
        self.num_detections = 0
        self.num_observations = 0
        self._with: ThinnedSequence[_KeptFrame] = ThinnedSequence(MAX_FRAMES_KEPT)
        self._without: ThinnedSequence[_KeptFrame] = ThinnedSequence(MAX_FRAMES_KEPT)
        self._last_with: _KeptFrame | None = None
        self._nosings: ThinnedSequence[Points] = ThinnedSequence(MAX_NOSINGS_KEPT)
        self._rule_counts: dict[tuple[str, str], int] = {}
        self._rule_values: dict[tuple[str, str], ThinnedSequence[tuple[float, float]]] = {}

    def add(self, frame: DepthFrame, detection: Detection, map_from_camera: Transform | None = None) -> None:
        """Take in one frame.

        Parameters
        ----------
        frame
            The frame; its ``up`` is taken from the pose when it has none, as the pipeline does.
        detection
            What was found in it.
        map_from_camera
            (4, 4) pose, without which the nosings cannot be drawn in the map.
        """
        if frame.up is None and map_from_camera is not None:
            up = np.array(map_from_camera[2, :3])
            frame = DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up)
        kept = _KeptFrame(self.num_frames, frame, detection)
        if detection:
            self._with.append(kept)
            self._last_with = kept
        else:
            self._without.append(kept)
        self.add_points(detection, map_from_camera)

    def add_points(self, detection: Detection, map_from_sensor: Transform | None) -> None:
        """Take in what was found in points without an image, such as a window of sweeps; see ``add``."""
        self.num_frames += 1
        if not detection:
            self._count_rules(detection)
            return
        self.num_detections += 1
        self.num_observations += len(detection.observations)
        if map_from_sensor is not None:
            for observation in detection.observations:
                for edge in observation.edges:
                    self._nosings.append(transform_points(map_from_sensor, edge.nosing))

    def observed_nosings(self) -> Points:
        """Return (N, 2, 3) nosings seen in single frames, map, m; at most ``MAX_NOSINGS_KEPT``."""
        return np.array(self._nosings.items()).reshape(-1, 2, 3)

    def rule_statistics(self) -> tuple[RuleStatistics, ...]:
        """Return why frames had no stair edges, most frequent rule first."""
        result = []
        for (rule, unit), count in self._rule_counts.items():
            measured, limits = np.array(self._rule_values[rule, unit].items()).T
            known = measured[~np.isnan(measured)]
            statistics = RuleStatistics(
                rule=rule,
                unit=unit,
                num_frames=count,
                measured=float(np.median(known)) if len(known) else float("nan"),
                limit=float(np.median(limits)),
            )
            result.append(statistics)
        return tuple(sorted(result, key=lambda statistics: (-statistics.num_frames, statistics.rule)))

    def example_frames(self, detector: TracingDetector | None = None) -> tuple[ExampleFrame, ...]:
        """Return the first, middle and last frame with stair edges, then as many without.

        Parameters
        ----------
        detector
            Looks at these few frames once more, to show how it came to its result; without it,
            frames whose detection has no trace get no such picture.
        """
        found = self._with.items()
        if self._last_with is not None and found[-1] is not self._last_with:
            found.append(self._last_with)
        chosen = _first_middle_last(found) + _first_middle_last(self._without.items())
        detect = None if detector is None else detector.detect
        return tuple(_example(kept, detect) for kept in chosen)

    def _count_rules(self, detection: Detection) -> None:
        first_of_rule: dict[tuple[str, str], Rejection] = {}
        for rejection in detection.rejections:
            first_of_rule.setdefault((rejection.rule, rejection.unit), rejection)
        for key, rejection in first_of_rule.items():
            self._rule_counts[key] = self._rule_counts.get(key, 0) + 1
            values = self._rule_values.setdefault(key, ThinnedSequence(MAX_VALUES_KEPT))
            values.append((rejection.measured, rejection.limit))


def _first_middle_last(frames: list[_KeptFrame]) -> list[_KeptFrame]:
    indices = sorted({0, len(frames) // 2, len(frames) - 1}) if frames else []
    return [frames[index] for index in indices]


def _example(kept: _KeptFrame, detect: Callable[..., Detection] | None) -> ExampleFrame:
    detection = kept.detection
    if detection.trace is None and detect is not None:
        detection = detect(kept.frame, trace=True)
    return ExampleFrame(
        frame_index=kept.frame_index,
        stamp_ns=kept.frame.stamp_ns,
        detected=bool(detection),
        overlay_png=png_from_image(draw_detection(kept.frame, detection)),
        trace_png=None if detection.trace is None else trace_png(kept.frame, detection),
    )

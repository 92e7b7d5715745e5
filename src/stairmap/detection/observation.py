"""What one frame says about stairways: stair edges, or the reasons why there are none."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points, Vector, readonly

if TYPE_CHECKING:
    from stairmap.detection.drops import DropEdge
    from stairmap.detection.ground import GroundView
    from stairmap.detection.tracing import StepsTrace

View: TypeAlias = Literal["ascending", "descending"]
"""How a view sees a stairway: from below or from above. Never a property of the stairway."""

Cue: TypeAlias = Literal["jump", "crease"]
"""How a nosing was seen: as a discontinuity of depth, or as a crease between riser and tread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StairEdge:
    """One nosing seen in one frame.

    Attributes
    ----------
    nosing
        (2, 3) segment in the camera frame, left end first (left as seen from below the
        stairs, looking up them), in metres.
    step_index
        Number of the step within its observation, 0 for the lowest one seen; a step
        that was not seen leaves a gap.
    left_bounded, right_bounded
        Whether the step's own end was seen there; otherwise the image's border or an occlusion cut it.
    cue
        How it was seen.
    num_pixels
        How many pixels support it.
    std
        Standard deviations of where this step lies along the stairs and upward, relative to the evenly
        spaced nosings of its observation, m, noise of the measurement included; NaN if the method gives none.
    """

    nosing: Points
    step_index: int
    left_bounded: bool
    right_bounded: bool
    cue: Cue
    num_pixels: int
    std: tuple[float, float] = (float("nan"), float("nan"))

    def __post_init__(self) -> None:
        object.__setattr__(self, "nosing", readonly(self.nosing))


@dataclass(frozen=True, slots=True, kw_only=True)
class StairObservation:
    """The stair edges of one stairway seen in one frame, in the camera frame.

    Attributes
    ----------
    stamp_ns
        Stamp of the frame, in nanoseconds.
    view
        Whether the stairway was seen from below or from above.
    up
        (3,) unit vector opposite to gravity in the camera frame, as the detector corrected it.
    forward
        (3,) unit vector up the stairs and level, camera frame.
    edges
        Stair edges from the lowest to the highest.
    rise, run, width
        Dimensions that this frame alone gives, in metres.
    origin
        (3,) point where the lattice of nosings begins, camera frame: nosing ``k`` of the lattice passes
        through ``origin + k * (run * forward + rise * up)``.
    covariance
        (6, 6) covariance of (rise, run, origin along forward, origin along up, tilt of up about the
        lateral axis, heading), in m and rad. Empty (0, 0) if the method gives none.
    rise_information
        (2, 3) what the frame says of the rise (m) and of how far the sensor moves edges outward
        (working pixels) together: their information matrix and, in the last column, its product with
        their estimate. One frame hardly tells them apart where heights are read off edges; many do.
        Empty (0, 0) where a method gives none.
    floor_seen
        Whether the floor in front of the lowest riser was seen, so that edge 0 is the first step.
    top_seen
        Whether what follows the last nosing is a level surface longer than a step.
    overhang, overhang_std
        How far nosings stand out before their risers, and its standard deviation, m; the latter is NaN
        where the frame does not tell.
    points
        (N, 3) points that support the edges, camera frame, in metres.
    """

    stamp_ns: int
    view: View
    up: Vector
    forward: Vector
    edges: tuple[StairEdge, ...]
    rise: float
    run: float
    width: float
    origin: Vector
    covariance: Float64Array
    rise_information: Float64Array = field(default_factory=lambda: np.zeros((0, 0)))
    floor_seen: bool = False
    top_seen: bool = False
    overhang: float = 0.0
    overhang_std: float = float("nan")
    points: Points

    def __post_init__(self) -> None:
        for name in ("up", "forward", "origin", "covariance", "rise_information", "points"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def num_steps(self) -> int:
        """Number of steps from the lowest edge seen to the highest, those missed between them included."""
        indices = [edge.step_index for edge in self.edges]
        return max(indices) - min(indices) + 1 if indices else 0

    @property
    def pitch(self) -> float:
        """Angle of the nosing line to the horizontal, rad."""
        return float(np.arctan2(self.rise, self.run))

    def to_dict(self) -> dict[str, Any]:
        """Return the observation as it stands in ``detections.jsonl``."""
        return {
            "view": self.view,
            "rise": round(self.rise, 5),
            "run": round(self.run, 5),
            "width": round(self.width, 5),
            "num_steps": self.num_steps,
            "edges": [np.round(edge.nosing, 4).tolist() for edge in self.edges],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Rejection:
    """Why something was not accepted.

    Attributes
    ----------
    rule
        Name of the rule, such as ``min_steps``.
    measured, limit
        What was found and what the rule asks for; ``measured`` is NaN where nothing could be measured.
    unit
        Unit of both: ``m``, ``deg``, ``px``, ``1``.
    """

    rule: str
    measured: float
    limit: float
    unit: str

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        measured = "nothing" if np.isnan(self.measured) else f"{self.measured:.4g}{unit}"
        return f"{self.rule}: {measured}, limit {self.limit:.4g}{unit}"

    def to_dict(self) -> dict[str, Any]:
        """Return the rejection as it stands in ``detections.jsonl``; NaN becomes ``None``."""
        measured = None if np.isnan(self.measured) else float(f"{self.measured:.6g}")
        return {"rule": self.rule, "measured": measured, "limit": float(self.limit), "unit": self.unit}


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionTrace:
    """What a detector saw on the way, for pictures; masks and lines are in pixels of the frame.

    Attributes
    ----------
    edge_pixels
        (height, width) mask of the pixels taken for edges.
    candidate_lines, accepted_lines
        (N, 4) segments (u0, v0, u1, v1).
    tread_pixels, riser_pixels
        (height, width) masks of the surfaces; all false for a method that has none.
    steps
        The default method's own steps; ``None`` for another method, or where no heading was looked along.
    """

    edge_pixels: Mask
    candidate_lines: Float64Array
    accepted_lines: Float64Array
    tread_pixels: Mask
    riser_pixels: Mask
    steps: StepsTrace | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """What was found in one frame. It is true, as in ``if detection:``, if it holds an observation.

    Attributes
    ----------
    stamp_ns
        Stamp of the frame, nanoseconds.
    observations
        Stairways, best first.
    rejections
        If there are none: the rules that the candidates most like stairs broke.
    trace
        Intermediate results for pictures; ``None`` unless the detector was asked for them.
    ground
        The ground in view; ``None`` if there is none, or if the method does not look for it.
    drops
        Edges where that ground ends and goes on lower, nearest first; the top of stairs is one.
    voids
        Where that ground ends and nothing is measured behind it, nearest first: a deep well, a dock in a hall
        deeper than the sensor sees, or a floor that gives no returns. One frame cannot tell which.
    """

    stamp_ns: int
    observations: tuple[StairObservation, ...]
    rejections: tuple[Rejection, ...]
    trace: DetectionTrace | None = None
    ground: GroundView | None = None
    drops: tuple[DropEdge, ...] = ()
    voids: tuple[DropEdge, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.observations)

    def to_dict(self) -> dict[str, Any]:
        """Return the line of ``detections.jsonl`` for this frame."""
        return {
            "stamp_ns": self.stamp_ns,
            "detected": bool(self),
            "observations": [observation.to_dict() for observation in self.observations],
            "rejections": [rejection.to_dict() for rejection in self.rejections],
            "camera_height": None if self.ground is None else round(self.ground.height, 4),
            "drops": [drop.to_dict() for drop in (*self.drops, *self.voids)],
        }

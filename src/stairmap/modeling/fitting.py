"""One flight from all its observations.

Rise and run come from each observation by itself and are averaged by their variances: an
error of a pose moves all edges of a frame alike and so does not touch them (the report, section
3.2). Place and heading are averaged in the map. The lattice's integer index makes one list of
steps of all observations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.refinement import EDGE_SHIFT
from stairmap.detection.rise_information import solve_rise_and_shift, with_rise_variance
from stairmap.geometry import wrapped_angle
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.stairway import Flight, FlightStd, Step

POSE_STD = 0.01
"""Standard deviation of a pose's position against its neighbours, m: keeps one frame from ruling."""

POSE_HEADING_STD = np.radians(0.5)
"""Standard deviation of a pose's heading, rad."""

HEIGHT_SCATTER, HEADING_SCATTER = 0.007, np.radians(0.25)
"""Standard deviations of a pose's height, m, and heading, rad, against its neighbours where the mean's is
asked for: drift moves all frames of a moment alike, so they scatter less than they are off."""

DRIFT_ALONG, DRIFT_ACROSS = 0.5, 0.75
"""How much of the spread that drift gave the places of a flight is the standard deviation of its place: near
frames, which weigh most, were taken within a shorter time than all; across, all weigh alike."""

FRAMES_PER_SAMPLE = 6.0
"""Neighbouring frames see the same steps from nearly the same place: so many count as one."""

SYSTEMATIC_STD = 0.0010
"""What no number of observations averages out of rise and run, m: sensor bias and uneven steps."""

AGREEMENT = 0.010
"""How far the rise and run of an observation may lie from the flight's beyond three sigma, m."""

MAX_PRECISE_STD = 0.0055
"""Standard deviation of an observation's own rise up to which it can confirm a flight, m."""

MIN_STEP_SHARE, MIN_NEXT_SHARE = 0.08, 0.2
"""A step counts when it was seen in this share of the observations of the best-seen step, at least twice;
above that, where fewer and fewer frames reach, in the second share of those of the step below it."""


MIN_ENDS_SHARE = 0.04
"""Share of the edges whose ends must have been seen for the width to count as bounded, and three at least:
with a rail on both sides only the first step may show them."""


MIN_FIRST_EDGES = 5
"""Fewest edges of the first step with both ends seen that tell whether it is wider than the others."""

MIN_WIDER, MAX_WIDER = 0.03, 0.16
"""How much wider the first step is where posts or stringers are the reason, both sides together, m."""

EDGES_PER_SAMPLE = 60.0
"""Edges of neighbouring frames and steps that count as one independent measurement of the width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedFlight:
    """A flight and what it was made of.

    Attributes
    ----------
    flight
        The model.
    members
        (M,) indices of its observations.
    num_confirmed_steps
        Steps that were seen at least twice.
    num_agreeing, num_precise
        Observations whose own rise and run agree with the flight's, and those among them that
        know their rise well.
    """

    flight: Flight
    members: IntArray
    num_confirmed_steps: int
    num_agreeing: int
    num_precise: int


def fit_flight(table: ObservationTable, placed: PlacedObservations, members: IntArray) -> FittedFlight:
    """Fit one flight to some observations.

    Parameters
    ----------
    table
        All observations.
    placed
        The same, in the map.
    members
        (M,) indices of the flight's observations, M at least 1.
    """
    records = placed.records[members]
    heading, heading_std = _mean_heading(placed.heading[members], records["heading_variance"])
    rise, rise_std = _fit_rise(records["rise_information"])
    run, run_std = _robust_mean(records["run"], records["run_variance"])
    axes = placed.in_axes(heading, members)
    shift, start_s, start_z = _align(axes, records, rise, run)

    is_member = np.zeros(len(placed), dtype=bool)
    is_member[members] = True
    position = np.zeros(len(placed), dtype=np.int64)
    position[members] = np.arange(len(members))
    edges = table.edges[is_member[table.edges["observation"]]]
    owner = position[edges["observation"]]
    index = edges["index"] + shift[owner]
    lowest_index = int(index.min())
    first, last = _step_range(index, shift, records, lowest_index)
    extent = _extent(edges, axes[owner, 1], index == first)
    left, right = extent.left, extent.right

    forward_std = _place_std(axes[:, 0] - shift * run, records["forward_variance"] + POSE_STD**2)
    up_std = _mean_std(axes[:, 2] - shift * rise, records["up_variance"] + HEIGHT_SCATTER**2)
    cosine, sine = np.cos(heading), np.sin(heading)
    middle = (left + right) / 2

    def in_map(s: float, t: float, z: float) -> Float64Array:
        return np.array([s * cosine - t * sine, s * sine + t * cosine, z])

    base = in_map(start_s + first * run, middle, start_z + (first - 1) * rise)
    steps = []
    num_confirmed = 0
    offsets_s = edges["forward"] - edges["index"] * records["run"][owner]
    offsets_z = edges["up"] - edges["index"] * records["rise"][owner]
    for step in range(first, last + 1):
        mine = index == step
        count = int(np.count_nonzero(mine))
        num_confirmed += count >= 2
        ds = float(np.median(offsets_s[mine])) if count else 0.0
        dz = float(np.median(offsets_z[mine])) if count else 0.0
        s, z = start_s + step * run + ds, start_z + step * rise + dz
        steps.append(Step(nosing=np.array([in_map(s, left, z), in_map(s, right, z)]), num_observations=count))
    pitch = np.arctan2(rise, run)
    pitch_std = np.hypot(rise_std * np.cos(pitch), run_std * np.sin(pitch)) / np.hypot(rise, run)
    flight = Flight(
        base=base,
        heading=heading,
        rise=rise,
        run=run,
        width=max(left - right, 1e-3),
        num_risers=last - first + 1,
        left_bounded=extent.left_bounded,
        right_bounded=extent.right_bounded,
        std=FlightStd(
            rise=rise_std,
            run=run_std,
            width=extent.width_std,
            pitch=float(pitch_std),
            heading=heading_std,
            base=np.array(
                [
                    np.hypot(forward_std * cosine, extent.middle_std * sine),
                    np.hypot(forward_std * sine, extent.middle_std * cosine),
                    up_std,
                ]
            ),
        ),
        steps=tuple(steps),
    )
    agrees = np.ones(len(members), dtype=bool)
    for name, value in (("rise", rise), ("run", run)):
        tolerance = AGREEMENT + 3.0 * np.sqrt(records[f"{name}_variance"])
        agrees &= np.abs(records[name] - value) < tolerance
    is_precise = np.sqrt(records["rise_variance"]) < MAX_PRECISE_STD
    return FittedFlight(
        flight=flight,
        members=members,
        num_confirmed_steps=num_confirmed,
        num_agreeing=int(np.count_nonzero(agrees)),
        num_precise=int(np.count_nonzero(agrees & is_precise)),
    )


def _mean_heading(headings: Float64Array, variances: Float64Array) -> tuple[float, float]:
    reference = float(headings[int(np.argmin(variances))])
    offsets = (headings - reference + np.pi) % (2 * np.pi) - np.pi
    total = variances + POSE_HEADING_STD**2
    weights = 1.0 / total
    mean = float(np.average(offsets, weights=weights))
    return wrapped_angle(reference + mean), _mean_std(offsets, variances + HEADING_SCATTER**2)


def _robust_mean(values: Float64Array, variances: Float64Array) -> tuple[float, float]:
    """Mean weighted by variance, outliers beyond two sigma held back (Huber), and its std."""
    total = variances + SYSTEMATIC_STD**2
    mean = float(np.average(values, weights=1.0 / total))
    for _ in range(3):
        deviation = np.abs(values - mean) / np.sqrt(total)
        weights = np.minimum(1.0, 2.0 / np.maximum(deviation, 1e-9)) / total
        mean = float(np.average(values, weights=weights))
    return mean, float(np.hypot(_mean_std(values, total), SYSTEMATIC_STD))


def _fit_rise(information: Float64Array) -> tuple[float, float]:
    """Rise by (N, 2, 3) information of observations on it and on the sensor's shift of edges; its std.

    Outliers beyond two sigma are held back (Huber), as they stand given the shift.
    """
    each = with_rise_variance(information, SYSTEMATIC_STD**2)
    own = np.maximum(each[:, 0, 0], 1e-9)
    weights = np.ones(len(each))
    for _ in range(4):
        total = np.einsum("n,nij->ij", weights / FRAMES_PER_SAMPLE, each)
        (rise, shift), covariance = solve_rise_and_shift(total, shift_std=EDGE_SHIFT)
        deviation = (each[:, 0, 2] - each[:, 0, 1] * shift) / own - rise
        weights = np.minimum(1.0, 2.0 / np.maximum(np.abs(deviation) * np.sqrt(own), 1e-9))
    spread = _mean_std(deviation, 1.0 / own)
    # What not knowing the shift adds to the variance.
    growth = float(total[0, 0] * covariance[0, 0])
    return float(rise), float(np.hypot(spread * np.sqrt(growth), SYSTEMATIC_STD))


def _mean_std(values: Float64Array, variances: Float64Array) -> float:
    """Standard deviation of a weighted mean of correlated values, from their stated or seen spread."""
    weights = 1.0 / variances
    mean = np.average(values, weights=weights)
    samples = max(len(values) / FRAMES_PER_SAMPLE, 1.0)
    stated = len(values) / float(weights.sum())
    seen = float(np.average((values - mean) ** 2, weights=weights))
    return float(np.sqrt(max(stated, seen) / samples))


def _place_std(values: Float64Array, variances: Float64Array) -> float:
    """Standard deviation of a place in a map that drifted while it was measured.

    Drift does not average out: which moment's place is asked for remains open by all of its spread.
    """
    weights = 1.0 / variances
    mean = np.average(values, weights=weights)
    spread = float(np.average((values - mean) ** 2, weights=weights))
    noise = len(values) / float(weights.sum()) - POSE_STD**2
    return float(np.hypot(_mean_std(values, variances), DRIFT_ALONG * np.sqrt(max(spread - noise, 0.0))))


def _align(
    axes: Float64Array, records: np.ndarray[tuple[int], np.dtype[np.void]], rise: float, run: float
) -> tuple[IntArray, float, float]:
    """Index shift of each observation and where the common nosing 0 lies: (shift, s, z)."""
    weights = 1.0 / (records["forward_variance"] + records["up_variance"] + POSE_STD**2)
    reference = axes[int(np.argmax(weights * records["num_steps"]))]
    start_s, start_z = float(reference[0]), float(reference[2])
    shift = np.zeros(len(axes), dtype=np.int64)
    for _ in range(2):
        along, up = axes[:, 0] - start_s, axes[:, 2] - start_z
        shift = np.rint((along * run + up * rise) / (run**2 + rise**2)).astype(np.int64)
        start_s = float(np.average(axes[:, 0] - shift * run, weights=weights))
        start_z = float(np.average(axes[:, 2] - shift * rise, weights=weights))
    return shift, start_s, start_z


def _step_range(
    index: IntArray,
    shift: IntArray,
    records: np.ndarray[tuple[int], np.dtype[np.void]],
    lowest: int,
) -> tuple[int, int]:
    """First and last step: those seen often enough, ended by floor and landing where these were seen."""
    counts = np.bincount(index - lowest)
    below = np.append(0, counts[:-1])
    is_above = np.arange(len(counts)) > np.argmax(counts)
    needed = np.where(is_above, MIN_NEXT_SHARE * below, MIN_STEP_SHARE * counts.max())
    often = np.flatnonzero(counts >= np.maximum(needed, 2 if len(records) > 1 else 1))
    if len(often) == 0:
        often = np.flatnonzero(counts)
    first, last = int(often[0]) + lowest, int(often[-1]) + lowest
    ends = (
        (records["floor_seen"], shift, 1),
        (records["top_seen"], shift + records["num_steps"] - 1, -1),
    )
    for was_seen, at, direction in ends:
        if np.count_nonzero(was_seen) < 2:
            continue
        votes = np.bincount(at[was_seen] - at[was_seen].min())
        place = int(np.argmax(votes)) + int(at[was_seen].min())
        beyond = place - direction - lowest
        num_beyond = int(counts[beyond]) if 0 <= beyond < len(counts) else 0
        if first <= place <= last and votes.max() > num_beyond:
            first, last = (place, last) if direction > 0 else (first, place)
    return first, last


class _Extent(NamedTuple):
    """Lateral ends of a flight along the left axis, whether each was seen, and standard deviations, m."""

    left: float
    right: float
    left_bounded: bool
    right_bounded: bool
    width_std: float
    middle_std: float


def _extent(
    edges: np.ndarray[tuple[int], np.dtype[np.void]], left_of_axis: Float64Array, is_first: Mask
) -> _Extent:
    """Return where a flight ends on both sides.

    Edges whose ends were both seen tell the width, whatever drift does to their place. A first step that
    is a little wider leaves two answers open: posts that stand on the steps hide the ends of all others,
    or stringers begin beside it. What is left between them is the width, and the standard deviation says
    how much it may be more.

    Parameters
    ----------
    edges
        (E,) records of ``EDGE_FIELDS``.
    left_of_axis
        (E,) how far the origins of their observations lie to the left, m.
    is_first
        (E,) whether each is of the first step.
    """
    left, right = edges["left"] + left_of_axis, edges["right"] + left_of_axis
    both = edges["left_bounded"] & edges["right_bounded"]
    if np.count_nonzero(both) >= max(3, MIN_ENDS_SHARE * len(edges)):
        widths, middles = (left - right)[both], 0.5 * (left + right)[both]
        width, middle = float(np.median(widths)), float(np.median(middles))
        spread, middle_spread = (
            1.48 * float(np.median(np.abs(values - np.median(values)))) for values in (widths, middles)
        )
        samples = max(len(widths) / EDGES_PER_SAMPLE, 1.0)
        width_std = float(np.hypot(0.005, spread / np.sqrt(samples)))
        first = both & is_first
        if np.count_nonzero(first) >= MIN_FIRST_EDGES:
            wider = float(np.median((left - right)[first])) - width
            if MIN_WIDER < wider < MAX_WIDER:
                width_std = float(np.hypot(width_std, wider / 2.0))
        return _Extent(
            middle + width / 2,
            middle - width / 2,
            True,
            True,
            width_std,
            float(np.hypot(0.005, DRIFT_ACROSS * middle_spread)),
        )
    ends = []
    for values, bounded, sign in (
        (left, edges["left_bounded"], 1.0),
        (right, edges["right_bounded"], -1.0),
    ):
        is_seen = np.count_nonzero(bounded) >= max(3, MIN_ENDS_SHARE * len(edges))
        end = np.median(values[bounded]) if is_seen else sign * np.percentile(sign * values, 90)
        ends.append((float(end), bool(is_seen)))
    return _Extent(ends[0][0], ends[1][0], ends[0][1], ends[1][1], 0.03, 0.03)

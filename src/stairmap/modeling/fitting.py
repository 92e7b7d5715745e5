"""One flight from all its observations.

Rise and run come from each observation by itself and are averaged by their variances: an
error of a pose moves all edges of a frame alike and so does not touch them (the report, section
3.2). Place and heading are averaged in the map. The lattice's integer index makes one list of
steps of all observations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.geometry import wrapped_angle
from stairmap.modeling.flight_extent import find_extent
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.modeling.step_places import IRREGULARITY, UNSTATED_STD, SeenEdges, fit_step_offsets
from stairmap.modeling.step_range import SeenSteps, find_step_range
from stairmap.modeling.weighted_means import (
    POSE_STD,
    fit_rise,
    mean_std,
    place_std,
    robust_mean,
    weighted_mean,
)
from stairmap.stairway import Flight, FlightStd, Step

POSE_HEADING_STD = np.radians(0.5)
"""Standard deviation of a pose's heading, rad."""

HEIGHT_SCATTER, HEADING_SCATTER = 0.006, np.radians(0.2)
"""Standard deviations of a pose's height, m, and heading, rad, against its neighbours where the mean's is
asked for: drift moves all frames of a moment alike, so they scatter less than they are off."""

AGREEMENT = 0.010
"""How far the rise and run of an observation may lie from the flight's beyond three sigma, m."""

MAX_PRECISE_STD = 0.0065
"""Standard deviation of an observation's own rise up to which it can confirm a flight, m."""

MAX_FOR_STEPS = 300
"""Most observations that place single steps, evenly taken from all. Six count as one, and a step measured to
3 mm is then known to 0.4 mm, less than what all frames err in common."""


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
    rise, rise_std = fit_rise(records["rise_information"])
    run, run_std = robust_mean(records["run"], records["run_variance"])
    axes = placed.in_axes(heading, members)
    shift, start_s, start_z = _align(axes, records, rise, run)

    edges, owner = table.edges_of(members)
    index = edges["index"] + shift[owner]
    first, last, bottom_seen, top_seen = find_step_range(
        SeenSteps(
            edge_step=index,
            from_below=records["from_below"][owner],
            lowest=shift,
            highest=shift + records["num_steps"] - 1,
            floor_seen=records["floor_seen"],
            top_seen=records["top_seen"],
        )
    )
    extent = find_extent(edges, axes[owner, 1], index == first)
    left, right = extent.left, extent.right

    # The base is this many steps away from where most observations begin.
    lever = first - float(np.mean(shift))
    forward_std = np.hypot(
        place_std(axes[:, 0] - shift * run, records["forward_variance"] + POSE_STD**2), lever * run_std
    )
    up_std = np.hypot(
        mean_std(axes[:, 2] - shift * rise, records["up_variance"] + HEIGHT_SCATTER**2), lever * rise_std
    )
    cosine, sine = np.cos(heading), np.sin(heading)
    middle = (left + right) / 2

    def in_map(s: float, t: float, z: float) -> Float64Array:
        return np.array([s * cosine - t * sine, s * sine + t * cosine, z])

    base = in_map(start_s + first * run, middle, start_z + (first - 1) * rise)
    counts = np.bincount(index[(index >= first) & (index <= last)] - first, minlength=last - first + 1)
    offsets, stds = _fit_steps(edges, owner, index - first, records, len(counts), rise, run)
    steps = []
    for number, count in enumerate(counts):
        s = start_s + (first + number) * run + offsets[number, 0]
        z = start_z + (first + number) * rise + offsets[number, 1]
        steps.append(
            Step(
                nosing=np.array([in_map(s, left, z), in_map(s, right, z)]),
                num_observations=int(count),
                std=(float(stds[number, 0]), float(stds[number, 1])),
            )
        )
    overhang, overhang_std = _mean_overhang(records)
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
        overhang=overhang,
        bottom_seen=bottom_seen,
        top_seen=top_seen,
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
            overhang=overhang_std,
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
        num_confirmed_steps=int(np.count_nonzero(counts >= 2)),
        num_agreeing=int(np.count_nonzero(agrees)),
        num_precise=int(np.count_nonzero(agrees & is_precise)),
    )


def _mean_heading(headings: Float64Array, variances: Float64Array) -> tuple[float, float]:
    reference = float(headings[int(np.argmin(variances))])
    offsets = (headings - reference + np.pi) % (2 * np.pi) - np.pi
    total = variances + POSE_HEADING_STD**2
    weights = 1.0 / total
    mean = weighted_mean(offsets, weights)
    return wrapped_angle(reference + mean), mean_std(offsets, variances + HEADING_SCATTER**2)


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
        start_s = weighted_mean(axes[:, 0] - shift * run, weights)
        start_z = weighted_mean(axes[:, 2] - shift * rise, weights)
    return shift, start_s, start_z


def _fit_steps(
    edges: np.ndarray[tuple[int], np.dtype[np.void]],
    owner: IntArray,
    step: IntArray,
    records: np.ndarray[tuple[int], np.dtype[np.void]],
    num_steps: int,
    rise: float,
    run: float,
) -> tuple[Float64Array, Float64Array]:
    """(K, 2) offsets of the steps from the lattice along and up, and their standard deviations, m."""
    # More observations than these tell nothing new of single steps, and cost time.
    every = -(-len(records) // MAX_FOR_STEPS)
    chosen = np.flatnonzero((step >= 0) & (step < num_steps) & (owner % every == 0))
    edges, owner, step = edges[chosen], owner[chosen] // every, step[chosen]
    records = records[::every]
    results = []
    for axis, (place, measure, size) in enumerate((("forward", "run", run), ("up", "rise", rise))):
        seen = SeenEdges(
            owner=owner,
            step=step,
            offset=edges[place] - edges["index"] * size,
            std=edges[f"{place}_std"].astype(np.float64),
            step_variance=records[f"{measure}_variance"],
        )
        results.append(
            fit_step_offsets(
                seen, num_steps, irregularity=IRREGULARITY[axis], unstated_std=UNSTATED_STD[axis]
            )
        )
    (along, along_std), (up, up_std) = results
    return np.stack([along, up], axis=1), np.stack([along_std, up_std], axis=1)


def _mean_overhang(records: np.ndarray[tuple[int], np.dtype[np.void]]) -> tuple[float, float]:
    """Overhang by all observations that know it, and its standard deviation; NaN where none does."""
    known = records[np.isfinite(records["overhang_std"])]
    if not len(known):
        return float("nan"), float("nan")
    return robust_mean(known["overhang"], known["overhang_std"] ** 2)

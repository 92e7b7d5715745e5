"""One flight from all its observations.

Rise and run come from each observation by itself and are averaged by their variances: an
error of a pose moves all edges of a frame alike and so does not touch them (the report, section
3.2). Place and heading are averaged in the map. The lattice's integer index makes one list of
steps of all observations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.geometry import wrapped_angle
from stairmap.modeling.flight_extent import find_extent
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.modeling.weighted_means import POSE_STD, fit_rise, mean_std, place_std, robust_mean
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

MIN_STEP_SHARE, MIN_NEXT_SHARE = 0.08, 0.15
"""A step counts when it was seen in this share of the observations of the best-seen step, at least twice;
above that, where fewer and fewer frames reach from below, in the second share of those of the step under it.
"""


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

    is_member = np.zeros(len(placed), dtype=bool)
    is_member[members] = True
    position = np.zeros(len(placed), dtype=np.int64)
    position[members] = np.arange(len(members))
    edges = table.edges[is_member[table.edges["observation"]]]
    owner = position[edges["observation"]]
    index = edges["index"] + shift[owner]
    lowest_index = int(index.min())
    # Seen from above, a flight heads towards the camera.
    from_below = records["forward"][owner, 2] > 0
    first, last = _step_range(index, from_below, shift, records, lowest_index)
    extent = find_extent(edges, axes[owner, 1], index == first)
    left, right = extent.left, extent.right

    # The base is so many steps away from where most observations begin.
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
        start_s = float(np.average(axes[:, 0] - shift * run, weights=weights))
        start_z = float(np.average(axes[:, 2] - shift * rise, weights=weights))
    return shift, start_s, start_z


def _step_range(
    index: IntArray,
    from_below: Mask,
    shift: IntArray,
    records: np.ndarray[tuple[int], np.dtype[np.void]],
    lowest: int,
) -> tuple[int, int]:
    """First and last step: those seen often enough, ended by floor and landing where these were seen."""
    counts = np.bincount(index - lowest)
    below = np.append(0, np.bincount(index[from_below] - lowest, minlength=len(counts))[:-1])
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

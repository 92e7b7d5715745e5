"""From the cleaned cloud of stair edges to a flight: lines 9 to 13 of the report's Algorithm 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points
from stairmap.delmerico2013.edge_cloud import find_clusters
from stairmap.detection.observation import Rejection
from stairmap.geometry import plane_distances, wrapped_angle
from stairmap.stairway import Flight, FlightStd

MIN_CLUSTERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightModel:
    """What Algorithm 1 estimates from the cloud.

    Attributes
    ----------
    flight
        The model, without its steps.
    nosings
        (N, 2, 3) segment of every well-supported cluster, lowest first, left end first, m, map.
    plane_pitch
        The report's P: angle of the fitted plane to the horizontal, rad. ``Flight.pitch`` is
        ``atan2(rise, run)`` instead.
    """

    flight: Flight
    nosings: Points
    plane_pitch: float


def fit_flight(points: Points, plane: Float64Array, *, min_points: int) -> FlightModel | Rejection:
    """Infer box, step dimensions and position from the cloud of stair edges.

    The box is level and turned so that its front faces down the plane; its width W is the extent of all
    points (line 9, eqs. 2-4). The cross-section (line 10) is the vertical plane through the box's centre
    along the direction of ascent: it is orthogonal to the inclined plane and to the stair edges.
    Adjacent clusters of enough points give the step dimensions (lines 11-13).

    The report's model is box, plane and (h, d). What ``Flight`` asks beyond it follows from them:

    * There is a riser for each well-supported cluster, as the report has "stair edges wherever there are
      well-supported clusters". The box's height is no guide to their number: one stray point in the
      plane lengthens it. ``Flight.box`` follows from the risers, too.
    * The foot of the first riser lies one rise below the lowest cluster, in the middle of the box's width.
    * The method estimates no uncertainty. The deviations given are spreads, see ``_spreads``.

    Parameters
    ----------
    points
        (N, 3) inliers of the plane, m, map.
    plane
        (4,) their plane, normal up.
    min_points
        A cluster is a stair edge with more than this many points.

    Returns
    -------
    The model, or why there is none: a level plane (``min_plane_pitch``), fewer than two stair edges
    (``min_clusters``), or edges that do not rise away (``min_rise``, ``min_run``).
    """
    level = float(np.hypot(plane[0], plane[1]))
    if level < 1e-6:
        return Rejection(rule="min_plane_pitch", measured=level, limit=1e-6, unit="rad")
    forward = -plane[:2] / level
    # Columns: up the stairs, to the left, up. Only directions change; the origin stays the map's.
    map_from_section = np.array(
        [[forward[0], -forward[1], 0.0], [forward[1], forward[0], 0.0], [0.0, 0.0, 1.0]]
    )
    section = points @ map_from_section
    clusters = find_supported_clusters(section, min_points=min_points)
    if len(clusters) < MIN_CLUSTERS:
        return Rejection(rule="min_clusters", measured=len(clusters), limit=MIN_CLUSTERS, unit="1")
    centroids = np.array([section[cluster].mean(axis=0) for cluster in clusters])
    differences = np.diff(centroids[:, [0, 2]], axis=0)
    run, rise = (float(value) for value in differences.mean(axis=0))
    for rule, value in (("min_rise", rise), ("min_run", run)):
        if value <= 0:
            return Rejection(rule=rule, measured=value, limit=0.0, unit="m")
    right_side, left_side = section[:, 1].min(), section[:, 1].max()
    base = np.array([centroids[0, 0], (right_side + left_side) / 2, centroids[0, 2] - rise])
    ends = np.array([(section[cluster, 1].max(), section[cluster, 1].min()) for cluster in clusters])
    nosings = np.repeat(centroids[:, None], 2, axis=1)
    nosings[..., 1] = ends
    plane_pitch = float(np.arctan2(level, plane[2]))
    flight = Flight(
        base=map_from_section @ base,
        heading=wrapped_angle(float(np.arctan2(forward[1], forward[0]))),
        rise=rise,
        run=run,
        width=float(left_side - right_side),
        num_risers=len(clusters),
        left_bounded=False,
        right_bounded=False,
        std=_spreads(section, clusters, map_from_section, plane_distances(plane, points), plane_pitch),
    )
    return FlightModel(flight=flight, nosings=nosings @ map_from_section.T, plane_pitch=plane_pitch)


def find_supported_clusters(section: Points, *, min_points: int) -> list[IntArray]:
    """Return the indices of each cluster of more than ``min_points`` points, lowest cluster first.

    Parameters
    ----------
    section
        (N, 3) points: up the stairs, to the left, up.
    min_points
        Largest size of a cluster that is dropped.
    """
    labels = find_clusters(section[:, [0, 2]])
    sizes = np.bincount(labels)
    clusters = [np.flatnonzero(labels == label) for label in np.flatnonzero(sizes > min_points)]
    return sorted(clusters, key=lambda cluster: float(section[cluster, 2].mean()))


def _spreads(
    section: Points,
    clusters: list[IntArray],
    map_from_section: Float64Array,
    plane_residuals: Float64Array,
    plane_pitch: float,
) -> FlightStd:
    """Spreads in place of the uncertainty that the report's method does not estimate.

    * rise, run: standard error of the mean of the adjacent differences; for two clusters, which have one
      difference, the scatter of their points.
    * width: standard deviation of the clusters' own widths.
    * pitch: what rise and run let it vary, and the disagreement of the plane's pitch with theirs.
    * heading: distances from the plane over its lever arm, edges counting as independent.
    * base: along the stairs and upward those of run and rise, sideways half of the width's.
    """
    centroids = np.array([section[cluster].mean(axis=0) for cluster in clusters])
    differences = np.diff(centroids[:, [0, 2]], axis=0)
    run, rise = differences.mean(axis=0)
    if len(differences) > 1:
        run_std, rise_std = differences.std(axis=0, ddof=1) / np.sqrt(len(differences))
    else:
        variances = sum(section[cluster][:, [0, 2]].var(axis=0) for cluster in clusters)
        run_std, rise_std = np.sqrt(variances)
    width_std = float(np.std([np.ptp(section[cluster, 1]) for cluster in clusters], ddof=1))
    propagated = np.hypot(run * rise_std, rise * run_std) / (rise**2 + run**2)
    disagreement = plane_pitch - np.arctan2(rise, run)
    lever_arm = max(float(section[:, 1].std()) * float(np.sin(plane_pitch)) * len(clusters) ** 0.5, 1e-6)
    base = np.array([run_std, width_std / 2, rise_std])
    return FlightStd(
        rise=float(rise_std),
        run=float(run_std),
        width=width_std,
        pitch=float(np.hypot(propagated, disagreement)),
        heading=min(float(np.sqrt(np.mean(plane_residuals**2))) / lever_arm, float(np.pi)),
        base=np.sqrt(map_from_section**2 @ base**2),
    )

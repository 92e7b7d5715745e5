"""Panels that show the default method's steps: scans, section, prediction, evidence and extents.

Each function draws onto axes of matplotlib that it is given. Colours are Okabe and Ito's, and every class of
ray also has a marker or a hatch of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.evidence import Evidence, tolerances
from stairmap.detection.extents import StepExtents
from stairmap.detection.fit import FittedProfile
from stairmap.detection.judgement import Case
from stairmap.detection.profile import StairProfile
from stairmap.detection.tracing import StepsTrace
from stairmap.visualization.dimensions import BLUE, GREY, INK, draw_dimension, finish_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:
    Axes: TypeAlias = Any

NEARER_COLOR, FARTHER_COLOR, UNMEASURED_COLOR = "#E69F00", "#CC79A7", "#BBBBBB"

MIN_NEAR = 0.1
"""Where lines to the camera are drawn, no point is nearer than this, m."""

MAX_RESIDUAL = 0.06
"""Residuals are shown up to this distance, m; larger ones stand at the border."""

MIN_SHOWN_WIDTH = 0.3
"""Where the sides are nearer to each other, m, which is no stairway, all rays of the strips are shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SortedRays:
    """The rays of a case near its stairs, compared with the prediction; arrays are (N,).

    Attributes
    ----------
    slope, inverse_distance
        What was measured: tau, and Q in 1/m, 0 where nothing was.
    expected
        What was predicted, 1/m.
    residual, tolerance
        How much farther along its surface's normal each ray ended than predicted, and how far it may, m.
    is_on, is_nearer, is_farther
        What the rays that tell of a surface met.
    is_edge
        Rays that tell of none: the place of an edge within a row decides what they see.
    is_behind
        Rays past an edge, of whose surroundings nothing is known but that they lie farther.
    """

    slope: Float64Array
    inverse_distance: Float64Array
    expected: Float64Array
    residual: Float64Array
    tolerance: Float64Array
    is_on: Mask
    is_nearer: Mask
    is_farther: Mask
    is_edge: Mask
    is_behind: Mask

    @property
    def classes(self) -> tuple[tuple[Mask, str, str, str], ...]:
        """Which rays belong to each class, with its colour, marker and name."""
        return (
            (self.is_on, BLUE, ".", "on the profile"),
            (self.is_nearer, NEARER_COLOR, "^", "nearer: hidden"),
            (self.is_farther, FARTHER_COLOR, "v", "farther: seen through"),
            (self.is_edge, GREY, "+", "at an edge: tells nothing"),
            (self.is_behind, GREY, "_", "past an edge: unknown"),
        )


def sort_rays(case: Case) -> SortedRays:
    """Compare the rays between the sides of the stairs with what the fitted profile predicts.

    The rules are those of ``evidence``.
    """
    fitted, rays = case.fitted, case.rays
    low, high = _slope_range(fitted.profile)
    chosen = (rays.slope > low) & (rays.slope < high)
    slope, q = rays.slope[chosen], rays.inverse_distance[chosen]
    predicted = fitted.predict(np.array([low, high]))
    entry = predicted.entries(slope)
    expected = predicted.expected(slope, entry)
    across = rays.bearing[chosen] / np.maximum(expected, 1e-6)
    if case.width > MIN_SHOWN_WIDTH:
        inside = (across > case.sides[0]) & (across < case.sides[1])
        slope, q, entry, expected = slope[inside], q[inside], entry[inside], expected[inside]
    limit = tolerances(predicted, fitted.profile, fitted.noise)
    sensitivity = np.maximum(predicted.sensitivity, 1e-9)
    off, tolerance, is_measured = q - expected, limit[entry], q > 0
    is_behind = is_measured & (q < predicted.farthest[entry])
    is_edge = is_measured & ~is_behind & (predicted.edge_spread >= limit)[entry]
    tells = is_measured & ~is_edge & ~is_behind
    return SortedRays(
        slope=slope,
        inverse_distance=q,
        expected=expected,
        residual=-off / sensitivity[entry],
        tolerance=tolerance / sensitivity[entry],
        is_on=tells & (np.abs(off) < tolerance),
        is_nearer=tells & (off >= tolerance),
        is_farther=tells & (off <= -tolerance),
        is_edge=is_edge,
        is_behind=is_behind,
    )


def draw_scans(axes: Axes, steps: StepsTrace) -> Any:
    """Draw the elevation with the corners found and the fitted nosings; return the colours for a key."""
    elevation, corners = steps.elevation, steps.corners
    q = elevation.inverse_distance
    shown = axes.pcolormesh(
        elevation.bearing, elevation.slope, np.where(q > 0, q, np.nan), cmap="cividis", shading="nearest",
        rasterized=True,
    )  # fmt: skip
    axes.set_facecolor("black")
    slope = corners.height / corners.distance
    for chosen, marker, name in (
        (~corners.is_jump, "o", "crease"),
        (corners.is_jump & ~corners.is_end, "^", "jump"),
        (corners.is_end, "x", "edge before nothing"),
    ):
        if chosen.any():
            axes.scatter(
                elevation.bearing[corners.strip[chosen]], slope[chosen], s=17, marker=marker, color="white",
                edgecolors=None if marker == "x" else INK, linewidths=0.7, label=name, zorder=4,
            )  # fmt: skip
    if steps.case is not None and steps.lattice is not None:
        strips = np.flatnonzero(steps.lattice.strips)
        _draw_fitted_nosings(axes, steps.case.fitted, elevation.bearing[strips[[0, -1]]])
    axes.invert_xaxis()
    axes.set_xlabel("bearing of the ray λ = t/s (left of the camera is left)")
    axes.set_ylabel("slope of the ray τ = z/s")
    if len(corners):
        axes.legend(loc="lower left", fontsize=8, framealpha=0.9, facecolor="#D8D8D8", title="corners")
    return shown


def _draw_fitted_nosings(axes: Axes, fitted: FittedProfile, ends: Float64Array) -> None:
    """Nosings as the elevation's own axes see them, over the strips that found them."""
    profile = fitted.profile
    slopes = profile.tread_heights[1:] / np.maximum(profile.nosing_distances, MIN_NEAR)
    bearing = np.linspace(ends[0], ends[1], 20)
    for number, slope in enumerate(slopes, start=1):
        ahead = 1.0 - fitted.tilt * slope + fitted.turn * bearing
        line = slope * ahead - fitted.tilt - fitted.roll * bearing
        axes.plot(bearing, line, color="white", linewidth=1.4, linestyle=(0, (4, 2)), zorder=3)
        axes.annotate(
            str(number), (bearing[-1], line[-1]), xytext=(4, 0), textcoords="offset points", color="white",
            fontsize=8, va="center", fontweight="bold", zorder=5,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": INK, "edgecolor": "none", "alpha": 0.8},
        )  # fmt: skip


def draw_section(axes: Axes, case: Case, rays: SortedRays) -> None:
    """Draw the rays from the side with the fitted section and its measures."""
    profile = case.fitted.profile
    points = section_lines(profile)
    extent = np.concatenate(points)
    # Room for the measures.
    room = np.array([0.2 * abs(profile.run), 0.6 * profile.rise])
    low = extent.min(axis=0) - room
    high = extent.max(axis=0) + np.array([2.2 * abs(profile.run), room[1]])
    for chosen, color, marker, _ in rays.classes:
        s = 1.0 / rays.inverse_distance[chosen]
        met = np.stack([s, rays.slope[chosen] * s], axis=1)
        met = met[((met > low) & (met < high)).all(axis=1)]
        axes.plot(*met.T, marker, color=color, markersize=2.5, rasterized=True, linestyle="")
    for piece in points:
        axes.plot(*piece.T, color=INK, linewidth=1.3)
    s, z = profile.nosing_distances, profile.tread_heights[1:]
    axes.plot(s, z, "D", color=INK, markersize=4, label="fitted nosings")
    for number in range(profile.num_steps):
        axes.annotate(
            str(number + 1), (s[number], z[number]), xytext=(0, 7), textcoords="offset points", ha="center",
            fontsize=8, color=INK,
        )  # fmt: skip
    _draw_measures(axes, case.fitted)
    axes.update_datalim([low, high])
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("forward from the camera s, m")
    axes.set_ylabel("up from the camera z, m")
    finish_axes(axes)


def _draw_measures(axes: Axes, fitted: FittedProfile) -> None:
    """Rise and run with their deviations, where the section leaves room for them."""
    profile = fitted.profile
    rise_std, run_std = 1e3 * np.sqrt(np.diag(fitted.covariance))[:2]
    s, z, rise = profile.nosing_distances, profile.tread_heights[1:], profile.rise
    if profile.run > 0:
        pair, place, highest = s[:2], float(z[0]) - 1.35 * rise, len(s) - 1
        extended = float(z[0]) - rise
    else:
        pair, place, highest = s[-2:], float(z[-1]) + 0.6 * rise, 0
        extended = float(z[-1])
    near, far = float(pair.min()), float(pair.max())
    draw_dimension(
        axes, (near, place), (far, place), f"run {abs(profile.run) * 1e3:.1f} ± {run_std:.1f} mm",
        extend_from=((near, extended), (far, extended)), text_side="right",
    )  # fmt: skip
    top = float(z[highest])
    riser, beside = float(s[highest]), float(s[highest]) + 0.5 * abs(profile.run)
    draw_dimension(
        axes, (beside, top - rise), (beside, top), f"rise {rise * 1e3:.1f} ± {rise_std:.1f} mm",
        extend_from=((riser, top - rise), (riser, top)), text_side="right",
    )  # fmt: skip


def draw_prediction(axes: Axes, case: Case, rays: SortedRays) -> None:
    """Draw what rays over the slopes of the stairs measured, and the line that the profile predicts."""
    low, high = _shown_slopes(case, rays)
    predicted = case.fitted.predict(np.array([low, high]))
    for chosen, color, marker, name in rays.classes:
        count = np.count_nonzero(chosen)
        if not count:
            continue
        axes.plot(
            rays.slope[chosen], rays.inverse_distance[chosen], marker, color=color, markersize=3,
            rasterized=True, linestyle="", label=f"{name} ({count})",
        )  # fmt: skip
    num_unmeasured = int(np.count_nonzero(rays.inverse_distance == 0))
    axes.plot(
        predicted.slope, predicted.inverse_distance, color=INK, linewidth=1.2, label="predicted", zorder=4
    )
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, 1.15 * float(predicted.inverse_distance.max()))
    axes.set_ylabel("inverse forward distance Q = 1/s, 1/m")
    _number_nosings(axes, case.fitted.profile)
    axes.legend(loc="lower left", fontsize=8, framealpha=0.9, title=f"rays; {num_unmeasured} unmeasured")
    axes.tick_params(labelbottom=False)
    finish_axes(axes)


def draw_residuals(axes: Axes, case: Case, rays: SortedRays) -> None:
    """Draw how much farther each ray ended than predicted, with the tolerance for being on the profile."""
    order = np.argsort(rays.slope)
    slope, tolerance = rays.slope[order], 1e3 * rays.tolerance[order]
    limit = 1e3 * MAX_RESIDUAL
    axes.fill_between(slope, -tolerance, tolerance, color=BLUE, alpha=0.12, linewidth=0)
    for chosen, color, marker, _ in rays.classes[:-1]:
        values = np.clip(1e3 * rays.residual[chosen], -limit, limit)
        axes.plot(
            rays.slope[chosen], values, marker, color=color, markersize=3, rasterized=True, linestyle=""
        )
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.set(xlim=_shown_slopes(case, rays), ylim=(-1.1 * limit, 1.1 * limit))
    axes.set_xlabel("slope of the ray τ = z/s (dotted: fitted nosings; band: counts as on)")
    axes.set_ylabel("measured − predicted,\nalong the surface's\nnormal, mm")
    if rays.is_on.any():
        rms = 1e3 * float(np.sqrt(np.mean(rays.residual[rays.is_on] ** 2)))
        axes.annotate(
            f"rms of the rays on the profile {rms:.1f} mm", (0.01, 0.06), xycoords="axes fraction",
            fontsize=8, color=INK,
        )  # fmt: skip
    _number_nosings(axes, case.fitted.profile, has_numbers=False)
    finish_axes(axes)


def _number_nosings(axes: Axes, profile: StairProfile, *, has_numbers: bool = True) -> None:
    slopes = profile.tread_heights[1:] / np.maximum(profile.nosing_distances, MIN_NEAR)
    last = -np.inf
    span = np.ptp(_slope_range(profile))
    for number in np.argsort(slopes):
        slope = float(slopes[number])
        axes.axvline(slope, color=GREY, linewidth=0.8, linestyle=":")
        if has_numbers and slope - last > 0.02 * span:
            axes.annotate(
                str(number + 1), (slope, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
                textcoords="offset points", ha="center", fontsize=8, color=INK, annotation_clip=True,
            )  # fmt: skip
            last = slope


def draw_evidence(axes: Axes, evidence: Evidence, *, is_ascending: bool) -> None:
    """Draw a bar for each step: shares of the rays towards it that met it, something else, or nothing."""
    num = len(evidence.on)
    place = np.arange(num)
    total = evidence.on + evidence.nearer + evidence.farther + evidence.unmeasured
    left = np.zeros(num)
    for values, color, hatch, name in (
        (evidence.on, BLUE, "", "on"),
        (evidence.nearer, NEARER_COLOR, "///", "nearer: hidden"),
        (evidence.farther, FARTHER_COLOR, "xxx", "farther: seen through"),
        (evidence.unmeasured, UNMEASURED_COLOR, "...", "not measured"),
    ):
        share = values / np.maximum(total, 1)
        axes.barh(
            place, share, left=left, height=0.42, color=color, hatch=hatch, edgecolor="white", linewidth=0.5,
            label=name,
        )  # fmt: skip
        _count_labels(axes, values, left + 0.5 * share, share, place)
        left = left + share
    ended, continued = evidence.ended.sum(axis=0), evidence.continued.sum(axis=0)
    for values, start, color, name in (
        (ended, np.zeros(num), "#009E73", "at the nosing: its surface ends"),
        (continued, ended / np.maximum(ended + continued, 1), INK, "... goes on"),
    ):
        share = values / np.maximum(ended + continued, 1)
        axes.barh(place - 0.33, share, left=start, height=0.16, color=color, label=name)
    for k in range(num):
        verdict = "seen" if evidence.is_seen[k] else "refuted" if evidence.is_refuted[k] else "not seen"
        axes.annotate(
            f"{verdict}\n{total[k]} rays", (1.02, place[k]), xycoords=("axes fraction", "data"), va="center",
            fontsize=8, color=INK, fontweight="normal" if verdict == "seen" else "bold",
        )  # fmt: skip
    axes.set_yticks(place, labels=[str(k + 1) for k in place])
    axes.set(xlim=(0, 1), ylim=(-0.6, 1.3 * num - 0.6))
    what = "riser and front" if is_ascending else "tread"
    axes.set_xlabel(f"share of the rays towards each step's {what}")
    axes.set_ylabel("step, from the lowest")
    axes.legend(loc="upper center", fontsize=8, ncols=2, framealpha=0.9)
    axes.spines[["top", "right"]].set_visible(False)


def _count_labels(
    axes: Axes, values: IntArray, middle: Float64Array, share: Float64Array, place: IntArray
) -> None:
    for k in np.flatnonzero(share > 0.08):
        axes.text(
            middle[k], place[k], str(values[k]), ha="center", va="center", fontsize=8, color="white",
            bbox={"boxstyle": "round,pad=0.1", "facecolor": INK, "edgecolor": "none", "alpha": 0.65},
        )  # fmt: skip


def draw_extents(axes: Axes, case: Case, extents: StepExtents) -> None:
    """Draw how far each step reaches to either side: a dot at an end that was seen, an arrow where cut."""
    for k in range(len(extents.left)):
        left, right = extents.left[k], extents.right[k]
        if not np.isfinite(left - right):
            continue
        axes.plot([left, right], [k, k], color=BLUE, linewidth=2)
        for end, bounded, cut in (
            (left, extents.left_bounded[k], "<"),
            (right, extents.right_bounded[k], ">"),
        ):
            axes.plot(
                end, k, "o" if bounded else cut, color=BLUE, markersize=7,
                markerfacecolor=BLUE if bounded else "white",
            )  # fmt: skip
    if np.isfinite(case.sides).all():
        for side in case.sides:
            axes.axvline(side, color=INK, linewidth=0.9, linestyle="--")
        draw_dimension(
            axes, (case.sides[1], len(extents.left) - 0.4), (case.sides[0], len(extents.left) - 0.4),
            f"width {case.width:.3f} m",
        )  # fmt: skip
    axes.invert_xaxis()
    axes.set(ylim=(-0.6, len(extents.left) + 0.3))
    axes.set_yticks(np.arange(len(extents.left)), labels=[str(k + 1) for k in range(len(extents.left))])
    axes.set_xlabel("to the left of the camera t, m (dot: end seen, arrow: cut off)")
    axes.set_ylabel("step, from the lowest")
    finish_axes(axes)


def _shown_slopes(case: Case, rays: SortedRays) -> tuple[float, float]:
    """Slopes of the stairs, as far as there are rays."""
    low, high = _slope_range(case.fitted.profile)
    if not len(rays.slope):
        return low, high
    return max(low, float(rays.slope.min())), min(high, float(rays.slope.max()))


def _slope_range(profile: StairProfile) -> tuple[float, float]:
    """Slopes from a run of the level on one side of the stairs to a run of that on the other."""
    direction = profile.direction
    reach = 0.8 * abs(profile.run)
    s = np.concatenate(
        [
            [profile.nosing_distances[0] - direction * reach],
            profile.nosing_distances,
            [profile.nosing_distances[-1] + direction * reach],
        ]
    )
    z = np.concatenate([profile.tread_heights, profile.tread_heights[-1:]])
    slopes = z / np.maximum(s, 2 * MIN_NEAR)
    margin = 0.04 * float(np.ptp(slopes))
    high = max(float(slopes.max()), float((z[-1] + 0.5 * profile.rise) / max(s[-2], MIN_NEAR)))
    return float(slopes.min()) - margin, (high if profile.run > 0 else float(slopes.max())) + margin


def section_lines(profile: StairProfile) -> list[Float64Array]:
    """The section as (M, 2) lines of s and z: one line, or a slab for each step where risers are open."""
    direction, s, z = profile.direction, profile.nosing_distances, profile.tread_heights
    foot = s + direction * profile.overhang + profile.rake * z[1:]
    climb = direction * (profile.ground + profile.slope)
    end = np.append(foot[1:], s[-1] + direction * 0.8 * abs(profile.run))
    floor = [s[0] - direction * 0.8 * abs(profile.run), z[0]]
    under = z[1:] - profile.thickness
    if profile.is_open:
        slabs = [
            np.array([[e, u], [a, u], [a, top], [e, top + climb * (e - a)]])
            for a, e, top, u in zip(s, end, z[1:], under, strict=True)
        ]
        return [np.array([floor, [foot[0], z[0]]]), *slabs]
    points = [floor]
    height = z[0]
    for k in range(len(s)):
        points += [[foot[k], height], [foot[k], under[k]], [s[k], under[k]], [s[k], z[k + 1]]]
        height = z[k + 1] + climb * (end[k] - s[k])
    return [np.array([*points, [end[-1], height]])]

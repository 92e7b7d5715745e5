"""One picture of all that the default method did with a frame, from scans to evidence and extents.

It needs matplotlib (extra ``report``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stairmap.detection.judgement import Case
from stairmap.detection.observation import Detection, DetectionTrace
from stairmap.detection.tracing import StepsTrace
from stairmap.frame import DepthFrame
from stairmap.visualization.dimensions import INK, ORANGE
from stairmap.visualization.overlay import depth_range, describe_detection, draw_trace, png_from_image
from stairmap.visualization.plots import make_figure, png_from_figure
from stairmap.visualization.profile_panels import (
    draw_evidence,
    draw_extents,
    draw_prediction,
    draw_residuals,
    draw_scans,
    draw_section,
    sort_rays,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
else:
    Axes: TypeAlias = Any
    Figure: TypeAlias = Any
    SubFigure: TypeAlias = Any

DOTS_PER_INCH = 100
"""Of the picture: 1,700 pixels wide."""


def trace_png(frame: DepthFrame, detection: Detection) -> bytes:
    """Return a PNG of how a detector came to its result, whichever the method.

    Raises
    ------
    ValueError
        If the detection was made without ``trace=True``.
    MissingPackageError
        If matplotlib is not installed and the default method made the detection.
    """
    if detection.trace is None or detection.trace.steps is None:
        return png_from_image(draw_trace(frame, detection))
    return png_from_figure(draw_steps(frame, detection), dots_per_inch=DOTS_PER_INCH)


def draw_steps(frame: DepthFrame, detection: Detection) -> Figure:
    """Draw how the default method came to its result in a frame.

    Raises
    ------
    ValueError
        If the detection has no trace of the default method's steps.
    MissingPackageError
        If matplotlib is not installed.
    """
    trace = detection.trace
    if trace is None:
        raise ValueError("this detection has no trace; detect with trace=True")
    steps = trace.steps
    if steps is None:
        raise ValueError("this detection has no steps of the default method")
    widths = [5.2] if steps.case is None else [5.4, 6.2, 5.4]
    figure = make_figure(width=sum(widths), height=9.6)
    figure.suptitle("\n".join(_title(detection)), fontsize=12, color=INK)
    columns = np.atleast_1d(np.asarray(figure.subfigures(1, len(widths), width_ratios=widths)))
    frame_axes, scan_axes = columns[0].subplots(2, 1, height_ratios=[1.15, 1.0])
    _draw_frame(frame_axes, frame, detection, trace)
    shown = draw_scans(scan_axes, steps)
    columns[0].colorbar(shown, ax=scan_axes, label="inverse forward distance Q = 1/s, 1/m")
    scan_axes.set_title("scans along the heading, and corners found", fontsize=10)
    if steps.case is not None:
        _draw_fit(columns[1], steps.case)
        _draw_counts(columns[2], steps, steps.case)
    return figure


def _title(detection: Detection) -> list[str]:
    lines = describe_detection(detection)
    steps = None if detection.trace is None else detection.trace.steps
    if not detection:
        lines = ["; ".join(["no stairway", *(str(reason) for reason in detection.rejections)])]
    if steps is None or steps.case is None:
        return [*lines, "no profile: no corners that repeat, or none of two steps that fits the rays"]
    fitted = steps.case.fitted
    profile, optics = fitted.profile, fitted.optics
    angles = np.degrees([fitted.tilt, fitted.roll, fitted.turn]).round(1) + 0.0
    fit = (
        f"fit: {'open' if profile.is_open else 'closed'} risers, "
        f"overhang {max(profile.overhang, 0.0) * 1e3:.0f} ± {fitted.overhang_std * 1e3:.0f} mm; "
        f"up corrected by {angles[0]:+.1f}° (tilt), {angles[1]:+.1f}° (roll), heading by {angles[2]:+.1f}°; "
        f"edges shifted by {optics.shift:.1f}, blended over {optics.smoothing:.1f} rows; "
        f"noise {fitted.noise * 1e3:.1f}e-3/m"
    )
    return [*lines, fit]


def _draw_frame(axes: Axes, frame: DepthFrame, detection: Detection, trace: DetectionTrace) -> None:
    near, far = depth_range(frame.depth)
    axes.imshow(frame.depth, cmap="gray_r", vmin=near, vmax=far + 0.5 * (far - near), interpolation="nearest")
    axes.set_facecolor("black")
    for mask, color in ((trace.tread_pixels, "#56B4E9"), (trace.riser_pixels, ORANGE)):
        tint = np.zeros((*mask.shape, 4))
        tint[mask] = [*(int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)), 0.55]
        axes.imshow(tint, interpolation="nearest")
    lines, dash = (trace.accepted_lines, "-") if detection else (trace.candidate_lines, (0, (3, 2)))
    for line in lines.reshape(-1, 2, 2):
        for width, color in ((3.0, INK), (1.4, "white")):
            axes.plot(*line.T, color=color, linewidth=width, linestyle=dash)
    height, width = frame.depth.shape
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    kind = "nosings found" if detection else "dashed: rejected nosings"
    axes.set_title(f"depth {near:.1f} to {far:.1f} m, black: none; {kind}\n"
                   "light blue: on treads, dark orange: on risers", fontsize=10)  # fmt: skip


def _draw_fit(figure: SubFigure, case: Case) -> None:
    rays = sort_rays(case)
    section, prediction, residuals = figure.subplots(3, 1, height_ratios=[1.25, 1.0, 0.65])
    draw_section(section, case, rays)
    section.set_title("rays from the side, and the fitted profile", fontsize=10)
    draw_prediction(prediction, case, rays)
    prediction.set_title("what rays measured, and what the profile predicts", fontsize=10, pad=14)
    draw_residuals(residuals, case, rays)


def _draw_counts(figure: SubFigure, steps: StepsTrace, case: Case) -> None:
    evidence, extents = figure.subplots(2, 1, height_ratios=[1.25, 1.0])
    draw_evidence(evidence, case.evidence, is_ascending=case.fitted.profile.run > 0)
    evidence.set_title("what the rays say of each step", fontsize=10)
    if steps.extents is not None:
        draw_extents(extents, case, steps.extents)
    extents.set_title("how far each step reaches to either side", fontsize=10, color=INK)

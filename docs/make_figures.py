"""Make the pictures of docs/method.md from real frames, which lie beside the project (docs/evaluation.md).

    .venv/bin/python docs/make_figures.py            # writes docs/images/method-*.png
    .venv/bin/python docs/make_figures.py --limits   # prints the numbers of "What it cannot do"

The data are no part of the project; without them this says so and writes nothing. Needs the extra ``report``,
and ``sim`` for the numbers, which are simulated.
"""

from __future__ import annotations

import io
import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from PIL import Image

from stairmap.config import Config
from stairmap.delmerico2013 import lines as report_lines
from stairmap.delmerico2013.collinear import merge_collinear_lines
from stairmap.delmerico2013.detector import WORKING_WIDTH, Delmerico2013Detector, thinned_depth
from stairmap.detection.crease_edges import find_creases
from stairmap.detection.detector import STRIP_NOISE, StairEdgeDetector
from stairmap.detection.elevation import STRIP_WIDTH, make_elevation
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.jump_edges import find_riser_tops, find_tread_fronts
from stairmap.detection.ledges import find_ledges
from stairmap.detection.observation import Detection, StairObservation
from stairmap.detection.orientation import correct_up, find_headings, level_axes
from stairmap.detection.profile_segments import NOTHING, RISER, TREAD, find_segments, label_cells
from stairmap.evaluation.data_folder import DATA_FOLDER
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.visualization.dimensions import GREY, INK, ORANGE, draw_dimension, finish_axes

DATA = Path(__file__).resolve().parents[1] / DATA_FOLDER / "real"
IMAGES = Path(__file__).resolve().parent / "images"

TREAD_COLOR, RISER_COLOR = "#56B4E9", ORANGE
"""Okabe and Ito's sky blue and vermillion: light and dark in grey print."""

CANNY_LOW, CANNY_HIGH = report_lines.CANNY_THRESHOLDS


def load_frame(folder: str, number: int = 0, *, up: str | None = None) -> DepthFrame:
    """Return a frame of a real recording."""
    for index, frame in enumerate(open_recording(DATA / folder, up=up)):
        if index == number:
            return frame
    raise SystemExit(f"{DATA / folder} has no frame {number}")


def save(figure: Figure, name: str) -> None:
    """Write a figure as a PNG of 192 colours: pictures of depth shrink to a third of their size."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, bbox_inches="tight", pad_inches=0.08)
    IMAGES.mkdir(exist_ok=True)
    path = IMAGES / f"method-{name}.png"
    Image.open(buffer).convert("RGB").quantize(192, dither=Image.Dither.NONE).save(path, optimize=True)
    sys.stdout.write(f"{path} {path.stat().st_size / 1000:.0f} kB\n")


def measures_text(observation: StairObservation) -> str:
    """The measures of an observation in one line, with the standard deviations that it states."""
    rise_std, run_std = np.sqrt(np.diag(observation.covariance))[:2] * 1e3
    return (
        f"{len(observation.edges)} nosings: rise {observation.rise * 1e3:.0f} ± {rise_std:.0f} mm, "
        f"run {observation.run * 1e3:.0f} ± {run_std:.0f} mm, width {observation.width:.2f} m, "
        f"pitch {np.degrees(observation.pitch):.1f}°"
    )


# --- (a) the frame with its nosings -------------------------------------------------------------------


def inclination_image(frame: DepthFrame, up: np.ndarray) -> np.ndarray:
    """Angle of the surface at each pixel to the horizontal, deg, from slopes of inverse depth; NaN: none."""
    camera = frame.camera
    with np.errstate(divide="ignore"):
        q = np.nan_to_num(1.0 / frame.depth, posinf=0.0).astype(np.float32)
    measured = (q > 0).astype(np.float32)
    size = (7, 7)
    share = cv2.blur(measured, size)
    q = cv2.blur(q, size) / np.maximum(share, 1e-3)
    a, b = np.gradient(q, axis=1) * camera.fx, np.gradient(q, axis=0) * camera.fy
    rays = camera.rays()
    normals = np.stack([a, b, q - a * rays[..., 0] - b * rays[..., 1]], axis=-1)
    cosine = np.abs(normals @ up) / np.maximum(np.linalg.norm(normals, axis=-1), 1e-9)
    return np.where((measured > 0) & (share > 0.7), np.degrees(np.arccos(np.clip(cosine, 0, 1))), np.nan)


def draw_nosings(axes, frame: DepthFrame, observation: StairObservation, *, numbers: bool) -> None:
    """Draw the nosings of an observation into an image: a dot where an end was seen, an arrow where cut."""
    for edge in observation.edges:
        ends = frame.camera.project(edge.nosing)
        for width, color in ((3.2, "black"), (1.4, "white")):
            axes.plot(*ends.T, color=color, linewidth=width, solid_capstyle="butt", clip_on=True)
        for end, bounded in zip(ends, (edge.left_bounded, edge.right_bounded), strict=True):
            marker = "o" if bounded else "<"
            place = np.clip(end, [8, 0], [frame.camera.width - 8, frame.camera.height])
            axes.plot(*place, marker, color="white", markeredgecolor="black", markersize=6)
        if numbers:
            end = ends[np.argmin(ends[:, 0])]
            axes.annotate(
                str(edge.step_index + 1), (max(end[0], 8), end[1]), xytext=(-2, 9),
                textcoords="offset points", color="white", fontweight="bold", ha="center", va="center",
                bbox={"boxstyle": "round,pad=0.15", "facecolor": "black", "edgecolor": "none"},
            )  # fmt: skip


def make_nosings_figure(frame: DepthFrame, observation: StairObservation) -> None:
    """(a): the depth image with the nosings, and the same nosings over the surfaces' inclination."""
    figure = Figure(figsize=(11.5, 5.2), layout="constrained")
    depth_axes, lean_axes = figure.subplots(1, 2)
    camera = frame.camera
    black = {"vmin": 0.5, "vmax": 3.0, "cmap": "viridis"}
    shown = depth_axes.imshow(frame.depth, interpolation="nearest", **black)
    bar = figure.colorbar(shown, ax=depth_axes, orientation="horizontal", shrink=0.8, pad=0.02)
    bar.set_label("depth, m (black: not measured)")
    inclination = inclination_image(frame, observation.up)
    shown = lean_axes.imshow(inclination, cmap="cividis_r", vmin=0, vmax=90, interpolation="nearest")
    bar = figure.colorbar(shown, ax=lean_axes, orientation="horizontal", shrink=0.8, pad=0.02)
    bar.set_ticks([0, 30, 60, 90], labels=["0° level", "30°", "60°", "90° upright"])
    bar.set_label("inclination of the surface, from the slopes of inverse depth")
    for axes, title in (
        (depth_axes, "depth, and the nosings found"),
        (lean_axes, "the same nosings, over how far each surface leans"),
    ):
        axes.set_facecolor("black")
        axes.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), xticks=[], yticks=[])
        axes.set_title(title, fontsize=11)
        draw_nosings(axes, frame, observation, numbers=axes is depth_axes)
    key = "dot: end of the step seen; arrow: cut off"
    figure.suptitle(f"{measures_text(observation)}   ({key})", fontsize=11)
    save(figure, "nosings")


# --- (b), (c) the side elevation ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scans:
    """The side elevation along the stairs' heading and what is found in it.

    Points are (N, 3): forward, up, left from the camera in the axes of the observation, m.
    """

    slope: np.ndarray
    inverse_distance: np.ndarray
    labels: np.ndarray
    cells: np.ndarray
    creases: np.ndarray
    jumps: np.ndarray
    stairs_from_scans: np.ndarray


def scan_frame(frame: DepthFrame, observation: StairObservation) -> Scans:
    """Do the detector's first steps again, up to the nosings of single strips."""
    config = Config().detection
    image = inverse_depth_from_frame(frame, max_depth=config.max_depth)
    surfaces = fit_surface_normals(image)
    limit = np.radians(config.max_up_correction_deg)
    up = correct_up(surfaces, frame.up, max_correction=limit).up
    ahead, left = level_axes(up)
    angles = [heading.angle for heading in find_headings(surfaces, up, max_headings=3)]
    directions = [np.cos(angle) * ahead + np.sin(angle) * left for angle in angles]
    forward = max(directions, key=lambda direction: float(direction @ observation.forward))
    elevation = make_elevation(image, up, forward)
    noise = STRIP_NOISE * surfaces.noise
    labels = label_cells(elevation, noise=noise)
    segments = find_segments(elevation, labels, noise=noise)
    creases, in_crease = find_creases(segments)
    tops = find_riser_tops(elevation, segments, in_crease[:, 0])
    fronts = find_tread_fronts(elevation, segments, in_crease[:, 1], view_sign=1)
    axes = np.stack([observation.forward, observation.up, np.cross(observation.up, observation.forward)])
    turn = axes @ np.stack([forward, up, np.cross(up, forward)], axis=1)

    def nosings(found: np.ndarray) -> np.ndarray:
        slope = found[:, 1] / found[:, 0]
        row = np.abs(elevation.slope[:, None] - slope).argmin(axis=0)
        lateral = found[:, 0] * elevation.lateral[row, found[:, 2].astype(int)]
        return np.stack([found[:, 0], found[:, 1], lateral], axis=1) @ turn.T

    with np.errstate(divide="ignore"):
        distance = np.where(elevation.inverse_distance > 0, 1 / elevation.inverse_distance, np.nan)
    cells = np.stack([distance, distance * elevation.slope[:, None], distance * elevation.lateral], axis=-1)
    return Scans(
        slope=elevation.slope,
        inverse_distance=elevation.inverse_distance,
        labels=labels,
        cells=cells @ turn.T,
        creases=nosings(creases),
        jumps=nosings(np.concatenate([tops, fronts, find_ledges(elevation, noise=noise)])),
        stairs_from_scans=turn,
    )


def on_stairs(points: np.ndarray, observation: StairObservation) -> np.ndarray:
    """Whether (..., 3) points forward, up, left lie between the ends of the steps, 30 mm inward."""
    left = np.cross(observation.up, observation.forward)
    ends = np.array([edge.nosing @ left for edge in observation.edges])
    return (points[..., 2] < np.median(ends[:, 0]) - 0.03) & (points[..., 2] > np.median(ends[:, 1]) + 0.03)


def make_elevation_figure(scans: Scans, observation: StairObservation) -> None:
    """(b): inverse forward distance of all scans, and the labels."""
    figure = Figure(figsize=(11.5, 5.2), layout="constrained")
    value_axes, label_axes = figure.subplots(1, 2, sharey=True)
    num_rows, num_strips = scans.labels.shape
    extent = (-0.5, num_strips - 0.5, num_rows - 0.5, -0.5)
    look = {"aspect": "auto", "interpolation": "nearest", "extent": extent}
    shown = value_axes.imshow(
        np.where(scans.inverse_distance > 0, scans.inverse_distance, np.nan), cmap="cividis", **look
    )
    value_axes.set_facecolor("black")
    figure.colorbar(shown, ax=value_axes, label="inverse forward distance Q = 1/s, 1/m", shrink=0.9)
    colors = ListedColormap(["#E6E6E6", TREAD_COLOR, RISER_COLOR])
    norm = BoundaryNorm([NOTHING - 0.5, TREAD - 0.5, RISER - 0.5, RISER + 0.5], 3)
    label_axes.imshow(scans.labels, cmap=colors, norm=norm, **look)
    ticks = np.arange(0.2, -2.1, -0.2)
    ticks = ticks[(ticks < scans.slope[0]) & (ticks > scans.slope[-1])]
    rows = np.interp(-ticks, -scans.slope, np.arange(num_rows))
    value_axes.set_yticks(rows, labels=[f"{tick:+.1f}" if abs(tick) > 1e-6 else "0" for tick in ticks])
    value_axes.set_ylabel("slope of the ray τ = z/s (rows)")
    for axes, title in (
        (value_axes, f"scans: every column is a strip of {STRIP_WIDTH} pixels"),
        (label_axes, "labels: tread (light), riser (dark), neither (grey)"),
    ):
        axes.set_title(title, fontsize=11)
        axes.set_xlabel("strip, from the image's left to its right")
    axes_3d = np.stack([observation.forward, observation.up, np.cross(observation.up, observation.forward)])
    origin = axes_3d @ observation.origin
    rise, run = np.array([0, observation.rise, 0]), np.array([observation.run, 0, 0])
    for index in range(len(observation.edges)):
        nosing = origin + index * (run + rise)
        below, nosing, behind = ((nosing + offset) @ scans.stairs_from_scans for offset in (-rise, 0, run))
        names = [(f"riser {index + 1}", below, nosing), (f"tread {index + 1}", nosing, behind)]
        for name, first, last in names[: 2 if index < len(observation.edges) - 1 else 1]:
            slope = (first[1] / first[0] + last[1] / last[0]) / 2
            row = np.interp(-slope, -scans.slope, np.arange(num_rows))
            label_axes.annotate(
                name, (num_strips - 0.5, row), xytext=(4, 0), textcoords="offset points", va="center",
                fontsize=8, color=INK, annotation_clip=False,
            )  # fmt: skip
    save(figure, "elevation")


def make_lattice_figure(scans: Scans, observation: StairObservation) -> None:
    """(c): all scans from the side, the nosings of single strips, and the lattice with its measures."""
    figure = Figure(figsize=(11.5, 4.9), layout="constrained")
    axes = figure.subplots()
    stairs = on_stairs(scans.cells, observation)
    for label, color, size in ((NOTHING, "#BBBBBB", 3), (TREAD, TREAD_COLOR, 7), (RISER, RISER_COLOR, 7)):
        chosen = stairs & (scans.labels == label)
        axes.scatter(*scans.cells[chosen][:, :2].T, s=size, color=color, linewidths=0, rasterized=True)
    creases, jumps = (nosings[on_stairs(nosings, observation)] for nosings in (scans.creases, scans.jumps))
    hollow = {"linestyle": "", "color": INK, "markerfacecolor": "none"}
    axes.plot(*creases[:, :2].T, marker="o", markersize=5, markeredgewidth=0.7, **hollow)
    axes.plot(*jumps[:, :2].T, marker="^", markersize=6, markeredgewidth=0.7, **hollow)

    origin = np.array([observation.origin @ observation.forward, observation.origin @ observation.up])
    step = np.array([observation.run, observation.rise])
    nosings = origin + np.arange(len(observation.edges))[:, None] * step
    rise, run = np.array([0, observation.rise]), np.array([observation.run, 0])
    corners = [nosings[0] - rise]
    for nosing in nosings:
        corners += [nosing, nosing + run]
    corners = np.array(corners[:-1])
    axes.plot(*corners.T, color=INK, linewidth=1.0)
    axes.plot(*nosings.T, "D", color=INK, markersize=5)
    line = np.array([nosings[0] - 0.35 * step, nosings[-1] + 0.35 * step])
    axes.plot(*line.T, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
    for number, nosing in enumerate(nosings, start=1):
        axes.annotate(
            f"{number}", nosing, xytext=(-10, 9), textcoords="offset points", ha="center", color=INK
        )
    rise_std, run_std = np.sqrt(np.diag(observation.covariance))[:2] * 1e3
    below = nosings[1] - rise - np.array([0, 0.075])
    draw_dimension(
        axes, below, below + run, f"run {observation.run * 1e3:.0f} ± {run_std:.0f} mm",
        extend_from=(nosings[1], nosings[2]), text_side="right",
    )  # fmt: skip
    beside = nosings[3] + np.array([0.47, 0])
    draw_dimension(
        axes, beside - rise, beside, f"rise {observation.rise * 1e3:.0f} ± {rise_std:.0f} mm",
        extend_from=(nosings[2], nosings[3]), text_side="right",
    )  # fmt: skip
    axes.plot(0, 0, "s", color=INK, markersize=9)
    axes.annotate("camera", (0, 0), xytext=(8, 4), textcoords="offset points", fontsize=10)
    key = [
        Line2D([], [], marker="s", linestyle="", color=TREAD_COLOR, label="tread (one strip's cell)"),
        Line2D([], [], marker="s", linestyle="", color=RISER_COLOR, label="riser"),
        Line2D([], [], marker="s", linestyle="", color="#BBBBBB", label="neither"),
        Line2D([], [], marker="o", **hollow, label="nosing of one strip: crease"),
        Line2D([], [], marker="^", **hollow, label="nosing of one strip: jump"),
        Line2D([], [], marker="D", linestyle="-", color=INK, label="the lattice, measured with all pixels"),
    ]
    if not len(jumps[jumps[:, 0] < 2.3]):
        key = [entry for entry in key if not entry.get_label().endswith("jump")]
    axes.legend(handles=key, loc="lower right", fontsize=9, framealpha=1.0)
    axes.set(xlim=(-0.1, 2.3), ylim=(-0.66, 0.1), xlabel="forward from the camera s, m", ylabel="up z, m")
    axes.set_aspect("equal")
    finish_axes(axes)
    axes.set_title(f"all scans across the steps, from the side: {measures_text(observation)}", fontsize=11)
    save(figure, "lattice")


# --- The report's method ---------------------------------------------------------------------------------


def make_report_figure(frame: DepthFrame, name: str, title: str, *, shared: bool = False) -> None:
    """Draw what Algorithm 2 makes of a frame: its lines, the jumps as Canny measures them, and its edges.

    With ``shared`` the third panel is the side view of the accepted lines instead.
    """
    detection = Delmerico2013Detector(Config()).detect(frame, trace=True)
    stride = max(1, round(frame.camera.width / WORKING_WIDTH))
    depth = thinned_depth(frame.depth, stride)
    grey = report_lines.grey_from_depth(depth)
    edges = report_lines.extract_edges(grey)
    kept = report_lines.remove_edges_at_invalid_depth(edges, grey)
    figure = Figure(figsize=(13.0, 4.4), layout="constrained")
    depth_axes, jump_axes, last_axes = figure.subplots(1, 3)

    near, far = np.nanpercentile(frame.depth[frame.depth < 6], [1, 99])
    shown = depth_axes.imshow(
        np.where(depth > 0, depth, np.nan), cmap="viridis", vmin=near, vmax=far, interpolation="nearest"
    )
    depth_axes.set_facecolor("black")
    bar = figure.colorbar(shown, ax=depth_axes, orientation="horizontal", shrink=0.8, pad=0.02)
    bar.locator = MaxNLocator(5)
    bar.set_label("depth, m (black: not measured)")
    trace = detection.trace
    candidates, accepted = trace.candidate_lines / stride, trace.accepted_lines / stride
    for segments, color, width in ((candidates, "white", 1.6), (accepted, "#E69F00", 3.0)):
        for u0, v0, u1, v1 in segments:
            depth_axes.plot([u0, u1], [v0, v1], color="black", linewidth=width + 1.5)
            depth_axes.plot([u0, u1], [v0, v1], color=color, linewidth=width)
    num_parallel = len(report_lines.select_dominant_slope(merge_collinear_lines(candidates)))
    depth_axes.set_title(
        f"{len(candidates)} Hough lines (white), {num_parallel} merged and parallel,\n"
        f"{len(accepted)} accepted (orange)",
        fontsize=10,
    )

    jump = sum(np.abs(cv2.Sobel(grey, cv2.CV_32F, *order, ksize=3)) for order in ((1, 0), (0, 1)))
    limits = [0, 7.5, 15, CANNY_LOW, CANNY_HIGH, 80]
    colors = ListedColormap(["#FFFFFF", "#D9D9D9", "#A6A6A6", TREAD_COLOR, "#08306B"])
    shown = jump_axes.imshow(
        np.minimum(jump, 79), cmap=colors, norm=BoundaryNorm(limits, 5), interpolation="nearest"
    )
    bar = figure.colorbar(shown, ax=jump_axes, orientation="horizontal", shrink=0.8, pad=0.02)
    bar.set_ticks(limits, labels=["0", "7.5", "15", f"{CANNY_LOW:.0f}", f"{CANNY_HIGH:.0f}", ""])
    bar.set_label("jump of depth as Canny measures it")
    jump_axes.set_title(
        f"an edge needs a jump of {CANNY_HIGH:.0f} (dark blue),\nor {CANNY_LOW:.0f} (light blue) beside one",
        fontsize=10,
    )

    if shared:
        _draw_accepted_lines(last_axes, frame, stride, detection)
    else:
        picture = np.ones((*edges.shape, 3))
        picture[edges > 0] = (0.90, 0.62, 0.0)
        picture[kept > 0] = 0.0
        last_axes.imshow(cv2.erode(picture, np.ones((2, 2))), interpolation="nearest")
        last_axes.set_title(
            f"{np.count_nonzero(edges):,} edge pixels (orange); {np.count_nonzero(kept):,} do not border\n"
            "invalid depth (black)",
            fontsize=10,
        )
    for axes in (depth_axes, jump_axes) if shared else (depth_axes, jump_axes, last_axes):
        axes.set(xticks=[], yticks=[], xlim=(-0.5, depth.shape[1] - 0.5), ylim=(depth.shape[0] - 0.5, -0.5))
    for axes in (depth_axes, jump_axes, last_axes):
        axes.set_anchor("N")
    reasons = ", ".join(str(rejection) for rejection in detection.rejections)
    figure.suptitle(
        f"{title}: {'not found (' + reasons + ')' if reasons else 'accepted as a stairway'}", fontsize=11,
        y=1.02, va="bottom",
    )  # fmt: skip
    save(figure, name)


def _draw_accepted_lines(axes, frame: DepthFrame, stride: int, detection: Detection) -> None:
    """Draw from the side what the accepted lines' columns show, and the nosings that the lines pass for."""
    observation = detection.observations[0]
    lines = detection.trace.accepted_lines / stride
    axes_3d = np.stack([observation.forward, observation.up])
    first, last = round(lines[:, 0].max()), round(lines[:, 2].min())
    points = frame.points()[::stride, ::stride][:, first : last + 1].reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])] @ axes_3d.T
    axes.scatter(*points.T, s=3, color=GREY, linewidths=0, rasterized=True)
    middles = np.array([edge.nosing.mean(axis=0) for edge in observation.edges]) @ axes_3d.T
    axes.plot(*middles.T, "D-", color="#E69F00", markeredgecolor="black", markersize=7, linewidth=1.5)
    for lower, upper in itertools.pairwise(middles):
        run, rise = (upper - lower) * 1e3
        axes.annotate(
            f"{rise:.0f} mm up, {run:.0f} mm on", (lower + upper) / 2, xytext=(-8, 4),
            textcoords="offset points", ha="right", va="bottom", fontsize=9, color=INK,
        )  # fmt: skip
    center, half = middles.mean(axis=0), np.ptp(middles, axis=0).max() * 0.8
    axes.set(xlim=center[0] + np.array([-1.2, 1.0]) * half, ylim=center[1] + np.array([-0.8, 0.8]) * half)
    axes.set_aspect("equal")
    axes.set(xlabel="forward, m", ylabel="up, m")
    axes.set_title(
        f"the {last - first + 1} columns that the lines share, from the side (grey):\n"
        f"taken for steps of rise {observation.rise * 1e3:.0f} mm, run {observation.run * 1e3:.0f} mm",
        fontsize=10,
    )
    finish_axes(axes)


# --- What it cannot do -----------------------------------------------------------------------------------

NUM_VIEWS = 16
MAX_ERROR = (0.02, 0.04)
"""Of rise and run, m."""

SENSOR_WIDTHS = {"kinect_v1": 320, "d435": 320, "kinect_v2": 512}


def count_views(
    scene: str,
    *,
    sensor: str = "kinect_v1",
    distance: float,
    angle: float = 0.0,
    height: float = 0.6,
    up_error: float = 0.4,
) -> str:
    """Say how many simulated views show a flight within ``MAX_ERROR``, and the mean errors.

    Parameters
    ----------
    scene
        Name of a scene whose flight begins at the origin.
    sensor
        Key of ``SENSOR_WIDTHS``.
    distance, height
        Of the camera from the first riser and above the floor, m. It aims 0.5 m above the flight's foot.
    angle
        From the flight's axis, deg.
    up_error
        By which the given up is off, in a random direction, deg.
    """
    from stairmap.simulation.render import RayCaster  # noqa: PLC0415
    from stairmap.simulation.scenes import make_scene  # noqa: PLC0415
    from stairmap.simulation.sensors import make_sensor  # noqa: PLC0415

    built = make_scene(scene, 0)
    flight, caster = built.stairways[0].flights[0], RayCaster(built.mesh)
    source = make_sensor(sensor, factor=SENSOR_WIDTHS[sensor] / make_sensor(sensor).camera.width)
    detector, random = StairEdgeDetector(Config()), np.random.default_rng(0)
    errors = []
    for view in range(NUM_VIEWS):
        bearing, away = np.radians(angle + random.normal(0, 2)), distance * (1 + random.normal(0, 0.03))
        eye = np.array([-away * np.cos(bearing), away * np.sin(bearing), height])
        map_from_camera = look_at(eye, np.array([0, 0, 0.5]) + random.normal(0, 0.05, 3))
        axis = np.append(random.normal(0, 1, 2), 0.0)
        turn = cv2.Rodrigues(np.radians(up_error) * axis / np.linalg.norm(axis))[0]
        depth = source.measure(caster.render(source.camera, map_from_camera), random)
        up = map_from_camera[:3, :3].T @ turn[:, 2]
        frame = DepthFrame(stamp_ns=view, depth=depth, camera=source.camera, up=up)
        for seen in detector.detect(frame).observations[:1]:
            error = np.array([seen.rise - flight.rise, seen.run - flight.run])
            if (np.abs(error) < MAX_ERROR).all():
                errors.append(error * 1e3)
    if not errors:
        return f"0 of {NUM_VIEWS}"
    rise, run = np.mean(errors, axis=0)
    return f"{len(errors)} of {NUM_VIEWS}, mean error rise {rise:+.0f}, run {run:+.0f} mm"


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return (4, 4) map_from_camera of an optical frame without roll."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    map_from_camera = np.eye(4)
    map_from_camera[:3] = np.stack([right, np.cross(forward, right), forward, eye], axis=1)
    return map_from_camera


def print_limits() -> None:
    """Print the numbers of "What it cannot do"; same code, same numbers."""

    def tell(label: str, result: str) -> None:
        sys.stdout.write(f"{label}: {result}\n")
        sys.stdout.flush()

    for sensor in SENSOR_WIDTHS:
        for distance in (0.5, 1, 2, 3, 4, 5):
            tell(f"{sensor} at {distance} m", count_views("free_standing", sensor=sensor, distance=distance))
    for angle in (45, 60, 75):
        tell(f"{angle} deg aside at 2 m", count_views("free_standing", distance=2, angle=angle))
    for up_error in (4, 6, 8, 12):
        tell(f"up off by {up_error} deg", count_views("free_standing", distance=2, up_error=up_error))
    for scene in ("open_risers", "short"):
        for height in (0.3, 0.6, 1.3):
            for distance in (1, 2, 3):
                result = count_views(scene, distance=distance, height=height)
                tell(f"{scene}, camera {height} m up, at {distance} m", result)


def main() -> None:
    """Make all pictures."""
    if not DATA.is_dir():
        raise SystemExit(
            f"expected the real frames in {DATA}; they are no part of the project; nothing was made"
        )
    frame = load_frame("kinect_v2_test_stairs")
    detection = StairEdgeDetector(Config()).detect(frame)
    if not detection:
        raise SystemExit(f"no stairway in {DATA / 'kinect_v2_test_stairs'}: {detection.rejections}")
    observation = detection.observations[0]
    make_nosings_figure(frame, observation)
    scans = scan_frame(frame, observation)
    make_elevation_figure(scans, observation)
    make_lattice_figure(scans, observation)
    make_report_figure(frame, "report-test-stairs", "test stairs, Kinect v2")
    make_report_figure(load_frame("xtion_two_steps_close"), "report-two-steps", "two steps, Xtion")
    kitchen = load_frame("no_stairs_kitchen_kinect_v1", 68, up="auto")
    make_report_figure(kitchen, "report-kitchen", "kitchen, frame 68, no stairs", shared=True)
    floor = load_frame("no_stairs_lab_floor_realsense", 26)
    make_report_figure(floor, "report-lab-floor", "lab floor, frame 26, no stairs", shared=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--limits"]:
        print_limits()
    else:
        main()

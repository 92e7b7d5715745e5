"""Make the pictures of docs/method.md from simulated and real frames, which lie beside the project.

    .venv/bin/python docs/make_figures.py            # writes docs/images/method-*.png
    .venv/bin/python docs/make_figures.py --limits   # prints the numbers of "What it cannot do"

The data are no part of the project; without them this says so and writes nothing. Needs the extras ``report``
and ``sim``.
"""

from __future__ import annotations

import io
import itertools
import sys
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
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection, StairObservation
from stairmap.detection.profile import Optics, StairProfile, Surface, outline_of, predict
from stairmap.detection.tracing import StepsTrace
from stairmap.evaluation.data_folder import DATA_FOLDER
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.simulation.kinds import ViewSpec, make_view
from stairmap.simulation.render import RayCaster
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import joined, make_block
from stairmap.simulation.viewpoints import look_at
from stairmap.simulation.views import take_view
from stairmap.visualization.detection_steps import draw_steps
from stairmap.visualization.dimensions import GREY, INK, ORANGE, finish_axes
from stairmap.visualization.profile_panels import (
    draw_evidence,
    draw_extents,
    draw_prediction,
    draw_residuals,
    draw_scans,
    draw_section,
    section_lines,
    sort_rays,
)

DATA = Path(__file__).resolve().parents[1] / DATA_FOLDER / "real"
IMAGES = Path(__file__).resolve().parent / "images"

TREAD_COLOR, RISER_COLOR = "#56B4E9", ORANGE
"""Okabe and Ito's sky blue and vermillion: light and dark in grey print."""

DESCENDING_VIEW = ("descending", 2, 0)
"""Kind, number and seed of a view as ``stairmap evaluate kinds`` shows it."""

CANNY_LOW, CANNY_HIGH = report_lines.CANNY_THRESHOLDS


def load_frame(folder: str, number: int = 0, *, up: str | None = None) -> DepthFrame:
    """Return a frame of a real recording."""
    for index, frame in enumerate(open_recording(DATA / folder, up=up)):
        if index == number:
            return frame
    raise SystemExit(f"{DATA / folder} has no frame {number}")


def save(figure: Figure, name: str, *, dots_per_inch: int = 110, keeps_rare_colors: bool = False) -> None:
    """Write a figure as a PNG of 192 colours: pictures of depth shrink to a third of their size.

    With ``keeps_rare_colors`` a colour of few pixels is not lost; smooth colours get steps instead.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch, bbox_inches="tight", pad_inches=0.08)
    IMAGES.mkdir(exist_ok=True)
    path = IMAGES / f"method-{name}.png"
    method = Image.Quantize.MAXCOVERAGE if keeps_rare_colors else Image.Quantize.MEDIANCUT
    picture = Image.open(buffer).convert("RGB").quantize(192, method=method, dither=Image.Dither.NONE)
    picture.save(path, optimize=True)
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


# --- (b) what rays must see ------------------------------------------------------------------------------

SURFACE_COLORS = {
    Surface.RISER: RISER_COLOR,
    Surface.FRONT: "#E69F00",
    Surface.UNDERSIDE: "#9A4F83",
    Surface.TREAD: TREAD_COLOR,
    Surface.BEHIND: "#BBBBBB",
}

RAYS_SHOWN = 26
"""Rays drawn into each section."""


def make_rays_figure() -> None:
    """(b): four sections with the rays that meet them, and the inverse distance that rays must measure."""
    step = {"run": 0.28, "rise": 0.17, "num_steps": 5}
    profiles = {
        "stairs that go up, nosings below": StairProfile(distance=0.7, height=-1.0, **step),
        "nosings above the camera, overhang": StairProfile(distance=0.9, height=-0.25, overhang=0.04, **step),
        "open risers": StairProfile(distance=0.9, height=-0.45, is_open=True, **step),
        "stairs that go down": StairProfile(
            distance=0.5 + 4 * 0.28, height=-1.3 - 4 * 0.17, run=-0.28, rise=0.17, num_steps=5
        ),
    }
    figure = Figure(figsize=(14.5, 6.6), layout="constrained")
    axes = figure.subplots(2, 4, height_ratios=[1.25, 1.0])
    for column, (title, profile) in enumerate(profiles.items()):
        _draw_rays(*axes[:, column], profile, title)
    axes[0, 0].set_ylabel("up from the camera z, m")
    axes[1, 0].set_ylabel("inverse forward distance Q = 1/s, 1/m")
    surfaces = {surface.name.lower(): color for surface, color in SURFACE_COLORS.items()}
    surfaces = {name.replace("front", "front of the tread"): color for name, color in surfaces.items()}
    surfaces = {name.replace("behind", "farther: unknown"): color for name, color in surfaces.items()}
    key = [Line2D([], [], color=color, linewidth=3, label=name) for name, color in surfaces.items()]
    key.append(Line2D([], [], color=INK, linestyle="--", label="a sensor that smooths over 2 rows"))
    figure.legend(handles=key, loc="outside lower center", ncols=6, fontsize=10)
    save(figure, "rays")


def _draw_rays(section_axes, value_axes, profile: StairProfile, title: str) -> None:
    s, z = profile.nosing_distances, profile.tread_heights
    slopes = np.append(z[1:] / s, z[0] / max(s[0] - 0.8 * profile.run, 0.3))
    low, high = slopes.min() - 0.05, slopes.max() + 0.07
    if profile.run < 0:
        high = z[0] / (s[0] + 0.8 * abs(profile.run))
        low = z[-1] / (s[-1] - 0.2)
    tau = np.linspace(low, high, 1500)
    outline = outline_of(profile)
    row = Optics(row_size=0.004, smoothing=0.02, shift=0.0)
    sharp = predict(outline, tau, row, has_gradient=False)
    blended = outline_of(profile, min_extent=2.0 * row.row_size)
    smooth = predict(blended, tau, Optics(row_size=0.004, smoothing=2.0, shift=0.0), has_gradient=False)
    for surface, color in SURFACE_COLORS.items():
        mine = np.where(sharp.surface == surface, sharp.inverse_distance, np.nan)
        value_axes.plot(tau, mine, color=color, linewidth=3)
    value_axes.plot(tau, smooth.inverse_distance, color=INK, linewidth=1.0, linestyle="--")
    for index in np.linspace(0, len(tau) - 1, RAYS_SHOWN).astype(int):
        end = 1.0 / sharp.inverse_distance[index]
        color = SURFACE_COLORS[Surface(sharp.surface[index])]
        section_axes.plot([0, end], [0, tau[index] * end], color=color, linewidth=0.9)
    for piece in section_lines(profile):
        section_axes.plot(*piece.T, color=INK, linewidth=1.8)
    section_axes.plot(0, 0, "s", color=INK, markersize=7)
    section_axes.annotate("camera", (0, 0), xytext=(5, 5), textcoords="offset points", fontsize=9)
    section_axes.set_aspect("equal", adjustable="datalim")
    section_axes.set_title(title, fontsize=11)
    section_axes.set_xlabel("forward s, m")
    value_axes.set_xlabel("slope of the ray τ = z/s")
    for axes in (section_axes, value_axes):
        finish_axes(axes)


# --- (c) to (e) search, prediction, evidence -------------------------------------------------------------


def make_search_figure(steps: StepsTrace) -> None:
    """(c): the scans with the corners found, and the fitted profile from the side."""
    figure = Figure(figsize=(12.5, 4.4), layout="constrained")
    scan_axes, section_axes = figure.subplots(1, 2, width_ratios=[1.0, 1.35])
    shown = draw_scans(scan_axes, steps)
    figure.colorbar(shown, ax=scan_axes, label="inverse forward distance Q = 1/s, 1/m")
    scan_axes.set_title("scans, and the corners of single strips", fontsize=11)
    draw_section(section_axes, steps.case, sort_rays(steps.case))
    section_axes.set_title("rays of the strips from the side, and the fitted profile", fontsize=11)
    save(figure, "search")


def make_prediction_figure(steps: StepsTrace, name: str, title: str) -> None:
    """(d): what rays measured against what the profile predicts, and the residuals."""
    figure = Figure(figsize=(11.5, 5.8), layout="constrained")
    prediction, residuals = figure.subplots(2, 1, height_ratios=[1.5, 1.0])
    rays = sort_rays(steps.case)
    draw_prediction(prediction, steps.case, rays)
    draw_residuals(residuals, steps.case, rays)
    figure.suptitle(title, fontsize=11)
    save(figure, name, keeps_rare_colors=True)


def make_evidence_figure(steps: StepsTrace) -> None:
    """(e): the evidence for each step, and how far each reaches."""
    figure = Figure(figsize=(12.0, 4.3), layout="constrained")
    evidence, extents = figure.subplots(1, 2)
    draw_evidence(evidence, steps.case.evidence, is_ascending=steps.case.fitted.profile.run > 0)
    draw_extents(extents, steps.case, steps.extents)
    save(figure, "evidence", keeps_rare_colors=True)


def make_inspect_figure(frame: DepthFrame, detection: Detection) -> None:
    """(f): the picture of ``stairmap inspect --frame``."""
    figure = draw_steps(frame, detection)
    save(figure, "inspect", dots_per_inch=75, keeps_rare_colors=True)


def simulated_frame(kind: str, index: int, seed: int) -> DepthFrame:
    """Return the frame of a view of ``stairmap evaluate kinds``."""
    view = make_view(ViewSpec(kind=kind, index=index, seed=seed))
    return view.frame(take_view(view)[0])


def hidden_frame() -> DepthFrame:
    """Return a simulated frame of stairs before which a box stands."""
    scene = make_scene("free_standing", 0)
    box = make_block([-0.5, -0.3, 0.0], [-0.15, 0.15, 0.45])
    sensor = make_sensor("kinect_v1", factor=0.5)
    pose = look_at(np.array([-2.2, 0.3, 1.1]), np.array([0.8, 0.0, 0.5]))
    rendering = RayCaster(joined([scene.mesh, box])).render(sensor.camera, pose)
    depth = sensor.measure(rendering, np.random.default_rng(0))
    return DepthFrame(stamp_ns=0, depth=depth, camera=sensor.camera, up=pose[2, :3])


def traced(frame: DepthFrame) -> tuple[Detection, StepsTrace]:
    """Return what the default method says of a frame, with its steps."""
    detection = StairEdgeDetector(Config()).detect(frame, trace=True)
    if detection.trace.steps is None or detection.trace.steps.case is None:
        raise SystemExit(f"no profile was fitted: {detection.rejections}")
    return detection, detection.trace.steps


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
    detection, steps = traced(frame)
    make_nosings_figure(frame, detection.observations[0])
    make_rays_figure()
    make_search_figure(steps)
    make_prediction_figure(steps, "prediction", "test stairs, Kinect v2, a real frame")
    below = simulated_frame(*DESCENDING_VIEW)
    make_prediction_figure(
        traced(below)[1], "prediction-descending", "stairs that go down, simulated: only treads show"
    )
    make_evidence_figure(traced(hidden_frame())[1])
    make_inspect_figure(frame, detection)
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

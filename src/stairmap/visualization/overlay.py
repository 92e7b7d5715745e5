"""Pictures of single frames, drawn with OpenCV alone: quick enough to make one for every frame.

``draw_detection`` shows the depth image with the nosings and measures that were found, or the
reasons why nothing was; ``draw_trace`` shows how the report's method came to it, as its figure 4.
All pictures are (height, width, 3) uint8, blue-green-red. Their colours survive colour blindness:
depth runs from violet (near) to yellow (far) with invalid pixels black.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import DepthImage, Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.detection.observation import Detection, StairEdge, StairObservation
from stairmap.frame import DepthFrame
from stairmap.visualization.panels import Image, add_text_strip, draw_label, place_in_grid, with_title

Color: TypeAlias = tuple[int, int, int]

# Okabe and Ito's colours, blue-green-red, those that stand out on viridis when cased in black.
OBSERVATION_COLORS: tuple[Color, ...] = ((255, 255, 255), (0, 94, 213), (167, 121, 204), (0, 159, 230))
_LINE_COLOR: Color = (0, 94, 213)

DROP_COLOR: Color = (60, 60, 255)
"""Red of an edge of the ground, cased in black: the one warm colour that viridis lacks."""

TOOTH_SPACING, TOOTH_LENGTH = 0.12, 0.06
"""Distance and length of the teeth on an edge of the ground, m."""

_MAX_PIXEL = 30_000

MIN_PICTURE_WIDTH = 640
"""Smaller frames are enlarged by a whole factor, so that text on them can be read."""

TRACE_PANEL_WIDTH = 480
"""Width of one panel of ``draw_trace``, px."""

CUT_REACH = 0.03
"""How far beyond a nosing's end something that cuts it is looked for, share of the image's width."""

BORDER_REACH = 0.01
"""How near to the image's border a nosing's end must be to be cut by it, share of the image's width."""

IN_FRONT, IN_FRONT_SHARE = 0.05, 0.02
"""What is nearer than a nosing's end by so much, m and share of its depth, stands in front of it."""

NUMBER_SPACING, NUMBER_HEIGHT = 22.0, 17.0
"""Room of the number of a step, px of the picture."""

MAX_NUMBER_COLUMNS = 8
"""So many numbers go side by side where steps lie close together."""

RANGE_STEP = 3
"""Every so many rows and columns tell the range of colours."""

SMALL_COMPRESSION = 3
"""Of pictures that are to be small: half of the size that the quickest gives for a drawing."""

MAX_REASONS = 3
"""So many reasons are written under a picture; all of them are in ``detections.jsonl``."""


def colorize_depth(depth: DepthImage, *, near: float | None = None, far: float | None = None) -> Image:
    """Return a depth image as colours; invalid pixels are black.

    Parameters
    ----------
    depth
        (height, width) metres, NaN where nothing was measured.
    near, far
        Depths of the first and last colour, m; by default the 2nd and 98th percentile.

    Returns
    -------
    (height, width, 3) uint8 picture.
    """
    valid = np.isfinite(depth)
    if not valid.any():
        return np.zeros((*depth.shape, 3), dtype=np.uint8)
    if near is None or far is None:
        first, last = depth_range(depth)
        near, far = first if near is None else near, last if far is None else far
    scaled = (np.where(valid, depth, np.float32(near)) - np.float32(near)) * np.float32(
        255 / max(far - near, 1e-6)
    )
    levels = np.clip(scaled, 0, 255).astype(np.uint8)
    picture = _colored(levels)
    picture[~valid] = 0
    return picture


def depth_range(depth: DepthImage) -> tuple[float, float]:
    """Return the 2nd and 98th percentile of the valid depths, m; (0, 0) where there is none.

    Every third row and column tell them.
    """
    some = depth[::RANGE_STEP, ::RANGE_STEP]
    valid = some[np.isfinite(some)]
    if not len(valid):
        valid = depth[np.isfinite(depth)]
    if not len(valid):
        return 0.0, 0.0
    near, far = np.percentile(valid, [2, 98])
    return float(near), float(far)


def draw_detection(frame: DepthFrame, detection: Detection) -> Image:
    """Draw what was found in a frame, with its measures, or the reasons why nothing was.

    A nosing ends in a dot where the step's own end was seen, in an arrow where the image's border or
    something in front cuts it, and without a sign where nothing tells. Numbers count the steps from the
    lowest one seen.

    Returns
    -------
    (height, width, 3) uint8 picture, at least ``MIN_PICTURE_WIDTH`` wide, text below the image.
    """
    scale = picture_scale(frame.camera)
    near, far = depth_range(frame.depth)
    picture = _enlarged(colorize_depth(frame.depth, near=near, far=far), frame.camera.scaled(scale))
    _draw_drops(picture, frame, detection, scale)
    _draw_observations(picture, frame, detection.observations, scale)
    bar = _color_bar(near, far, key="dot: end of the step seen, arrow: cut off" if detection else "")
    return add_text_strip(picture, describe_detection(detection), color_bar=bar)


def draw_trace(frame: DepthFrame, detection: Detection) -> Image:
    """Draw how a detector came to its result: depth, edge pixels, candidate and accepted lines.

    For the default method's own steps see ``detection_steps``.

    Raises
    ------
    ValueError
        If the detection was made without ``trace=True``.
    """
    trace = detection.trace
    if trace is None:
        raise ValueError("this detection has no trace; detect with trace=True")
    camera = frame.camera.scaled(TRACE_PANEL_WIDTH / frame.camera.width)
    depth = _enlarged(colorize_depth(frame.depth), camera)
    faint = (depth * 0.45).astype(np.uint8)
    candidates, accepted = faint.copy(), faint.copy()
    scale = camera.width / frame.camera.width
    _draw_segments(candidates, trace.candidate_lines, scale)
    _draw_segments(accepted, trace.accepted_lines, scale)
    panels = [
        with_title(depth, "depth"),
        with_title(_mask_picture(trace.edge_pixels, camera), "edge pixels"),
        with_title(candidates, f"candidate lines: {len(trace.candidate_lines)}"),
        with_title(accepted, f"accepted lines: {len(trace.accepted_lines)}"),
    ]
    grid = place_in_grid(panels, num_columns=len(panels))
    return add_text_strip(grid, describe_detection(detection))


def describe_detection(detection: Detection) -> list[str]:
    """Return the lines of text that say what was found, or why nothing was; ASCII only, for OpenCV."""
    drops = [
        f"the ground ends {detection.drops[0].distance:.2f} m from the camera, at least "
        f"{detection.drops[0].depth:.2f} m deep (red)"
    ] if detection.drops else []  # fmt: skip
    if detection.observations:
        return drops + [
            f"{f'{number}: ' if len(detection.observations) > 1 else ''}{_measures(observation)}"
            for number, observation in enumerate(detection.observations, start=1)
        ]
    reasons = [str(rejection) for rejection in detection.rejections[:MAX_REASONS]]
    more = len(detection.rejections) - len(reasons)
    if more > 0:
        reasons[-1] += f"  (and {more} more)"
    return [*drops, "no stairway", *reasons]


def picture_scale(camera: PinholeCamera) -> int:
    """Return the whole factor by which frames of this camera are enlarged."""
    return max(1, -(-MIN_PICTURE_WIDTH // camera.width))


def png_from_image(image: Image, *, is_small: bool = False) -> bytes:
    """Return a picture as the content of a PNG file, a smaller one in more time if that is asked for."""
    options = [cv2.IMWRITE_PNG_COMPRESSION, SMALL_COMPRESSION] if is_small else []
    return bytes(cv2.imencode(".png", image, options)[1].tobytes())


def _measures(observation: StairObservation) -> str:
    return (
        f"{observation.view}, {observation.num_steps} steps: "
        f"rise {observation.rise * 1e3:.0f} mm, run {observation.run * 1e3:.0f} mm, "
        f"width {observation.width:.2f} m, pitch {np.degrees(observation.pitch):.1f} deg"
    )


class NosingEnd(Enum):
    """What becomes of a nosing at one of its ends."""

    SEEN = "the step ends there"
    CUT = "the image or something in front of it cuts it"
    UNKNOWN = "nothing tells"


def find_nosing_ends(frame: DepthFrame, edge: StairEdge) -> tuple[NosingEnd, NosingEnd]:
    """Tell what becomes of a nosing at its left and its right end."""
    ends = frame.camera.project(edge.nosing)
    length = max(float(np.linalg.norm(ends[1] - ends[0])), 1e-9)
    outward = (ends[1] - ends[0]) / length
    left = NosingEnd.SEEN if edge.left_bounded else _cut_or_unknown(frame, edge.nosing[0], ends[0], -outward)
    right = NosingEnd.SEEN if edge.right_bounded else _cut_or_unknown(frame, edge.nosing[1], ends[1], outward)
    return left, right


def _cut_or_unknown(
    frame: DepthFrame, point: Float64Array, end: Float64Array, outward: Float64Array
) -> NosingEnd:
    height, width = frame.depth.shape
    steps = np.arange(1, max(2, round(CUT_REACH * width)) + 1)
    beyond = np.rint(end + steps[:, None] * outward).astype(np.int64)
    inside = (beyond >= 0).all(axis=1) & (beyond[:, 0] < width) & (beyond[:, 1] < height)
    if not inside[steps <= max(2, round(BORDER_REACH * width))].all():
        return NosingEnd.CUT
    beyond = beyond[inside]
    depth = frame.depth[beyond[:, 1], beyond[:, 0]]
    with np.errstate(invalid="ignore"):
        is_in_front = depth < point[2] - IN_FRONT - IN_FRONT_SHARE * point[2]
    return NosingEnd.CUT if np.count_nonzero(is_in_front) >= 2 else NosingEnd.UNKNOWN


def _draw_observations(
    picture: Image, frame: DepthFrame, observations: Sequence[StairObservation], scale: int
) -> None:
    camera = frame.camera.scaled(scale)
    taken: list[Float64Array] = []
    for index, observation in enumerate(observations):
        color = OBSERVATION_COLORS[index % len(OBSERVATION_COLORS)]
        for edge in sorted(observation.edges, key=lambda edge: edge.step_index):
            # OpenCV cannot draw farther away than a 16-bit number of pixels.
            ends = np.clip(camera.project(edge.nosing), -_MAX_PIXEL, _MAX_PIXEL)
            if not np.isfinite(ends).all():
                continue
            _draw_nosing(picture, find_nosing_ends(frame, edge), ends, color)
            place = _free_place(ends, taken, picture.shape[1])
            taken.append(place)
            draw_label(picture, str(edge.step_index + 1), place, color)


def _draw_drops(picture: Image, frame: DepthFrame, detection: Detection, scale: int) -> None:
    """Draw where the ground ends, with teeth on the side where it falls off."""
    if detection.ground is None:
        return
    camera, up = frame.camera.scaled(scale), detection.ground.up
    for drop in detection.drops:
        along = drop.edge[1] - drop.edge[0]
        outward = np.cross(up, along) / max(float(np.linalg.norm(along)), 1e-9)
        shares = np.linspace(0.0, 1.0, max(int(np.linalg.norm(along) / TOOTH_SPACING), 1) + 1)[:, None]
        feet = drop.edge[0] + shares * along
        for start, stop in zip(feet, feet + TOOTH_LENGTH * outward, strict=True):
            _draw_cased(picture, camera.project(np.array([start, stop])), DROP_COLOR, 2)
        _draw_cased(picture, camera.project(drop.edge), DROP_COLOR, 3)


def _draw_cased(picture: Image, ends: Float64Array, color: Color, width: int) -> None:
    if not np.isfinite(ends).all():
        return
    start, stop = _pixel(ends[0]), _pixel(ends[1])
    cv2.line(picture, start, stop, (0, 0, 0), width + 3, cv2.LINE_AA)
    cv2.line(picture, start, stop, color, width, cv2.LINE_AA)


def _free_place(ends: Float64Array, taken: Sequence[Float64Array], width: int) -> Float64Array:
    """Where the number of a step goes: left of its nosing, farther out if taken, else to the right."""
    leftmost, rightmost = ends[np.argmin(ends[:, 0])], ends[np.argmax(ends[:, 0])]
    columns = NUMBER_SPACING * np.arange(1, MAX_NUMBER_COLUMNS + 1)
    places = [leftmost - np.array([column, 0.0]) for column in columns]
    places += [rightmost + np.array([column, 0.0]) for column in columns]
    half = NUMBER_SPACING / 2
    for place in places:
        is_inside = half <= place[0] <= width - half
        if is_inside and all(
            abs(place[0] - other[0]) >= NUMBER_SPACING or abs(place[1] - other[1]) >= NUMBER_HEIGHT
            for other in taken
        ):
            return np.asarray(place)
    return np.asarray(np.clip(leftmost, half, None))


def _draw_nosing(
    picture: Image, kinds: tuple[NosingEnd, NosingEnd], ends: Float64Array, color: Color
) -> None:
    start, stop = _pixel(ends[0]), _pixel(ends[1])
    cv2.line(picture, start, stop, (0, 0, 0), 5, cv2.LINE_AA)
    cv2.line(picture, start, stop, color, 2, cv2.LINE_AA)
    length = float(np.linalg.norm(ends[1] - ends[0]))
    direction = (ends[1] - ends[0]) / max(length, 1e-9)
    for end, outward, kind in ((ends[0], -direction, kinds[0]), (ends[1], direction, kinds[1])):
        if kind is NosingEnd.SEEN:
            cv2.circle(picture, _pixel(end), 6, (0, 0, 0), -1, cv2.LINE_AA)
            cv2.circle(picture, _pixel(end), 4, color, -1, cv2.LINE_AA)
        elif kind is NosingEnd.CUT:
            across = np.array([-outward[1], outward[0]])
            head = [end, end - 12 * outward + 6 * across, end - 12 * outward - 6 * across]
            shape = np.round(np.array(head) * 16).astype(np.int32)
            cv2.fillPoly(picture, [shape], color, cv2.LINE_AA, 4)
            cv2.polylines(picture, [shape], True, (0, 0, 0), 1, cv2.LINE_AA, 4)


def _draw_segments(picture: Image, segments: Float64Array, scale: float) -> None:
    for segment in np.asarray(segments, dtype=np.float64).reshape(-1, 4) * scale:
        cv2.line(picture, _pixel(segment[:2]), _pixel(segment[2:]), _LINE_COLOR, 2, cv2.LINE_AA)
        for end in (segment[:2], segment[2:]):
            cv2.circle(picture, _pixel(end), 3, (255, 255, 255), -1, cv2.LINE_AA)


def _color_bar(near: float, far: float, *, key: str) -> tuple[str, Image, str]:
    levels = np.linspace(0, 255, 128).astype(np.uint8)[None]
    bar = _colored(np.repeat(levels, 10, axis=0))
    return f"{near:.1f} m", bar, f"{far:.1f} m    black: none    {key}"


def _colored(levels: NDArray[np.uint8]) -> Image:
    return np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS), dtype=np.uint8)


def _mask_picture(mask: Mask, camera: PinholeCamera) -> Image:
    return np.repeat(_resized(mask, camera)[..., None].astype(np.uint8) * 255, 3, axis=2)


def _resized(mask: Mask, camera: PinholeCamera) -> Mask:
    # A pixel of the smaller picture is set where any pixel that it covers is: thin edges must not vanish.
    method = cv2.INTER_AREA if camera.width < mask.shape[1] else cv2.INTER_NEAREST
    size = (camera.width, camera.height)
    return np.asarray(cv2.resize(mask.astype(np.float32), size, interpolation=method) > 0.2)


def _enlarged(picture: Image, camera: PinholeCamera) -> Image:
    size = (camera.width, camera.height)
    method = cv2.INTER_AREA if camera.width < picture.shape[1] else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(picture, size, interpolation=method), dtype=np.uint8)


def _pixel(position: Float64Array) -> tuple[int, int]:
    u, v = np.clip(np.round(position), -_MAX_PIXEL, _MAX_PIXEL)
    return int(u), int(v)

"""One HTML page with the map, the stairways and their measures, which any browser opens, offline too.

Everything is inside: the scene as base64, a small WebGL program, styles. Nothing is loaded from
elsewhere and no package is needed to write it. docs/viewers.md tells why no viewer library is used.
"""

from __future__ import annotations

import base64
import html
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import stairmap
from stairmap.arrays import Float64Array, Points
from stairmap.export.loading import ResultsError
from stairmap.export.summary import COLUMNS, stairway_rows
from stairmap.output_files import output_error, write_whole_text
from stairmap.stairway import Stairway
from stairmap.visualization.collecting import ThinnedSequence
from stairmap.visualization.frame_view import FrameView
from stairmap.visualization.solid_shapes import ascent_arrows, bars, stairway_solid
from stairmap.visualization.stairway_labels import (
    ASCENT_COLOR,
    SURFACE_COLOR,
    TRAJECTORY_COLOR,
    Color,
    ascent_arrow,
    find_viewpoint,
    flight_measures,
    flight_title,
    stairway_color,
)
from stairmap.visualization.voxel_cloud import VoxelCloud

MAP_VOXEL = 0.025
MAX_MAP_POINTS = 150_000
"""Six bytes each: about 1.2 MB of the page."""

MAX_FRAME_POINTS = 40_000
MAX_EDGES = 1_500
MAX_WAY_POINTS = 400

_FARTHER = 1.3
"""The page's view is narrower than rerun's, and its table covers a part of it."""

_ASSETS = Path(__file__).with_name("page_assets")
_EDGE_COLOR: Color = (150, 90, 20)


class PageFile:
    """Collects a run and writes it as a page; an existing one is replaced.

    Parameters
    ----------
    path
        The file.
    name
        Name of the run, for the title.
    frame_id
        Name of the map's coordinate frame.
    positions
        (N, 3) way of the camera, map, m.
    is_scan
        Whether it shows a map of points, which no camera went through.

    Raises
    ------
    ResultsError
        If there are no poses: without them there is no map to show.
    """

    def __init__(
        self, path: Path, *, name: str, frame_id: str, positions: Points, is_scan: bool = False
    ) -> None:
        if not len(positions) and not is_scan:
            raise ResultsError(
                "a page shows the map, but this run has no poses; "
                "look at single frames with: stairmap view RUN --save FILE.rrd"
            )
        self._path, self._name, self._frame_id, self._positions = path, name, frame_id, positions
        self._cloud = VoxelCloud(MAP_VOXEL, MAX_MAP_POINTS)
        self._edges: ThinnedSequence[Points] = ThinnedSequence(MAX_EDGES)
        self._stairways: tuple[Stairway, ...] = ()
        self._num_frames = 0
        self._num_points = 0
        self._is_scan = is_scan
        self._rule_counts: Counter[str] = Counter()

    def show_frame(self, view: FrameView) -> None:
        """Take in one frame."""
        self._num_frames += 1
        if not view.observations:
            self._rule_counts.update({rejection.rule for rejection in view.rejections})
        for edge in view.map_edges():
            self._edges.append(edge)
        points = view.camera_points(max_points=MAX_FRAME_POINTS)
        pose = view.map_from_camera
        self._cloud.add(points @ pose[:3, :3].T + pose[:3, 3])

    def show_points(self, points: Points, *, num_points: int) -> None:
        """Take in (N, 3) points of a map, of which there were ``num_points`` before they were thinned."""
        self._num_points += num_points
        self._cloud.add(points)

    def show_stairways(self, stairways: Sequence[Stairway], number: int, stamp_ns: int) -> None:
        """Remember the stairways; the page shows those that came last."""
        self._stairways = tuple(stairways)

    def close(self) -> None:
        """Write the page.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(self._path, error) from error
        write_whole_text(self._path, self._render())

    def _render(self) -> str:
        scene = json.dumps(self._scene(), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
        texts = {name: (_ASSETS / name).read_text(encoding="utf-8") for name in _asset_names()}
        page = texts["page.html"]
        replacements = {
            "TITLE": html.escape(self._name),
            "SUBTITLE": html.escape(
                f"{self._source()} · positions in m, frame “{self._frame_id}”, z up · "
                f"stairmap {stairmap.__version__}"
            ),
            "TABLE": self._table(),
            "STYLE": texts["page.css"],
            "SCRIPT": "\n".join(texts[name] for name in _asset_names() if name.endswith(".js")),
            "SCENE": scene,
        }
        # The scene comes last, so that nothing in it can be taken for a place to fill.
        for name, text in replacements.items():
            page = page.replace(f"<!--{name}-->", text)
        return page

    def _source(self) -> str:
        return f"{self._num_points:,} points" if self._is_scan else f"{self._num_frames} frames"

    def _table(self) -> str:
        if not self._stairways:
            reasons = [f"{rule} in {count} frames" for rule, count in self._rule_counts.most_common(3)]
            against = f" Rules against stairs: {', '.join(reasons)}." if reasons else ""
            return f"<p>No stairway was found.{html.escape(against)}</p>"
        shown = [i for i, column in enumerate(COLUMNS) if column not in {"ends seen", "heading deg"}]
        head = "".join(f"<th>{html.escape(COLUMNS[i])}</th>" for i in shown)
        rows = []
        for row in stairway_rows(self._stairways):
            cells = row.cells()
            color = "rgb({},{},{})".format(*stairway_color(row.stairway_id))
            body = "".join(f"<td>{html.escape(cells[i])}</td>" for i in shown)
            rows.append(f'<tr data-stairway="{row.stairway_id}" style="--color:{color}">{body}</tr>')
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"

    def _scene(self) -> dict[str, Any]:
        # Far outliers of the cloud must not decide from where it is looked at, nor its colours.
        inner = (
            np.percentile(self._cloud.points, [3, 97], axis=0)
            if len(self._cloud.points)
            else np.empty((0, 3))
        )
        viewpoint = find_viewpoint(self._stairways, np.concatenate([self._positions, inner]))
        origin = viewpoint.target
        step = max(len(self._positions) // MAX_WAY_POINTS, 1)
        way = self._positions[::step]
        edges = np.array(self._edges.items()).reshape(-1, 2, 3)
        surfaces = [stairway_solid(stairway) for stairway in self._stairways]
        floor = min(
            (float(stairway.flights[0].base[2]) for stairway in self._stairways),
            default=float(inner[0, 2]) if len(inner) else 0.0,
        )
        known = np.concatenate(
            [self._positions, self._cloud.points, *(s.surface()[0] for s in self._stairways)]
        )
        return {
            "grid": [(known.min(axis=0) - origin).tolist(), (known.max(axis=0) - origin).tolist()],
            "eye": (_FARTHER * (viewpoint.eye - origin)).tolist(),
            "floor": floor - origin[2],
            "heights": (inner[:, 2] - origin[2]).tolist() if len(inner) else [0.0, 1.0],
            "cloud": _encode_cloud(self._cloud.points - origin, self._cloud.voxel_size),
            "layers": [
                {"name": "steps", "meshes": [_mesh(part - origin, SURFACE_COLOR) for part in surfaces]},
                {
                    "name": "nosings",
                    "meshes": [
                        _mesh(bars(stairway.edges(), thickness=0.022) - origin, stairway_color(stairway.id))
                        for stairway in self._stairways
                    ],
                },
                {
                    "name": "way up",
                    "meshes": [_mesh(ascent_arrows(self._stairways) - origin, ASCENT_COLOR)],
                },
                {
                    "name": "camera's way",
                    "meshes": [
                        _mesh(
                            bars(np.stack([way[:-1], way[1:]], axis=1), thickness=0.02) - origin,
                            TRAJECTORY_COLOR,
                        )
                    ],
                },
                {
                    "name": "edges of single frames",
                    "hidden": True,
                    "meshes": [_mesh(bars(edges, thickness=0.006) - origin, _EDGE_COLOR)],
                },
            ],
            "labels": [self._label(s, i, origin) for s in self._stairways for i in range(len(s.flights))],
        }

    def _label(self, stairway: Stairway, index: int, origin: Points) -> dict[str, Any]:
        flight = stairway.flights[index]
        place = ascent_arrow(flight)[1] + [0.0, 0.0, 0.25] - origin
        own = find_viewpoint([stairway], self._positions)
        return {
            "stairway": stairway.id,
            "color": stairway_color(stairway.id),
            "place": place.tolist(),
            "lines": [flight_title(stairway, index), *flight_measures(flight)],
            "eye": (own.target + _FARTHER * (own.eye - own.target) - origin).tolist(),
            "target": (own.target - origin).tolist(),
        }


def _asset_names() -> tuple[str, ...]:
    return ("page.html", "page.css", "orbit.js", "renderer.js", "page.js")


def _mesh(triangles: Float64Array, color: Color) -> dict[str, Any]:
    return {"color": color, "positions": _base64(triangles.astype("<f4").tobytes())}


def _encode_cloud(points: Points, voxel_size: float) -> dict[str, Any]:
    """Quantise points to 16 bits an axis: for a map of 65 m, to a millimetre."""
    if not len(points):
        return {"low": [0, 0, 0], "size": [1, 1, 1], "voxel": voxel_size, "positions": ""}
    low = points.min(axis=0)
    size = np.maximum(points.max(axis=0) - low, 1e-3)
    steps = np.round((points - low) / size * 65535).astype("<u2")
    return {
        "low": low.tolist(),
        "size": size.tolist(),
        "voxel": voxel_size,
        "positions": _base64(steps.tobytes()),
    }


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")

"""Read what ``stairmap export`` and ``stairmap plan`` wrote with programs that know nothing of stairmap.

Needs a virtual environment of its own, without stairmap:

    pip install numpy matplotlib pillow pyyaml geopandas ifcopenshell trimesh meshio
    python docs/show_exports.py RUN/export PLAN docs/images

Prints what each reader found and writes a picture of each output. Rules of nav2_map_server (``map_io.cpp``)
and of nav2_route (``geojson_graph_file_loader.cpp``) are written here again from their C++ sources: Nav2
itself did not run.
"""

from __future__ import annotations

import heapq
import json
import sys
from pathlib import Path
from typing import Any

import geopandas
import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.validate
import matplotlib.pyplot as plt
import meshio
import numpy as np
import trimesh
import yaml
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from PIL import Image

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#777777"
FREE, OCCUPIED, UNKNOWN = 0, 100, -1


def show(text: str) -> None:
    """Write a line to the terminal."""
    sys.stdout.write(f"{text}\n")


def read_map(path: Path) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """Read a map as nav2_map_server does in trinary mode; return cells and (left, right, bottom, top), m."""
    values = yaml.safe_load(path.read_text())
    shades = np.asarray(Image.open(path.parent / values["image"]).convert("L"), dtype=float) / 255
    occupancy = shades if values["negate"] else 1 - shades
    cells = np.full(shades.shape, UNKNOWN)
    cells[occupancy > values["occupied_thresh"]] = OCCUPIED
    cells[occupancy < values["free_thresh"]] = FREE
    (left, bottom, _), size = values["origin"], values["resolution"]
    rows, columns = cells.shape
    return cells, (left, left + columns * size, bottom, bottom + rows * size)


def show_masks(export: Path, plan: Path, picture: Path) -> None:
    """Lay each keep-out mask over the map of its floor."""
    paths = sorted(export.glob("keepout_floor_*.yaml"))
    figure, panels = plt.subplots(1, len(paths), figsize=(3.6 * len(paths), 5.2), sharey=True, squeeze=False)
    extents: list[tuple[float, float, float, float]] = []
    for axes, path in zip(panels[0], paths, strict=True):
        level = path.stem.rpartition("_")[2]
        cells, extent = read_map(plan / f"floor_{level}.yaml")
        mask, mask_extent = read_map(path)
        show(f"{path.name}: {mask.shape[1]} x {mask.shape[0]} cells, {np.sum(mask == OCCUPIED)} forbidden")
        shades = np.select([cells == FREE, cells == OCCUPIED], [1.0, 0.0], 0.8)
        axes.imshow(shades, cmap="gray", vmin=0, vmax=1, extent=extent)
        forbidden = np.ma.masked_where(mask != OCCUPIED, np.ones(mask.shape))
        axes.imshow(forbidden, cmap=ListedColormap([ORANGE]), alpha=0.6, extent=mask_extent)
        extents += [extent, mask_extent]
        axes.set(title=f"floor {level}", xlabel="map x, m")
    panels[0][0].set_ylabel("map y, m")
    left, right, bottom, top = np.array(extents).T
    plt.setp(panels, xlim=(left.min(), right.max()), ylim=(bottom.min(), top.max()))
    figure.suptitle("white: free · black: occupied · grey: unknown · orange: keep-out mask")
    save(figure, picture)


def read_graph(path: Path) -> tuple[dict[int, dict[str, Any]], dict[int, list[tuple[int, float, str]]]]:
    """Load a graph by nav2_route's rules; return nodes, and (end, cost, class) of edges by their start."""
    nodes: dict[int, dict[str, Any]] = {}
    edges: dict[int, list[tuple[int, float, str]]] = {}
    features = json.loads(path.read_text())["features"]
    for feature in features:
        if feature["geometry"]["type"] == "Point":
            x, y = feature["geometry"]["coordinates"][:2]
            nodes[feature["properties"]["id"]] = {"x": x, "y": y, **feature["properties"]["metadata"]}
    for feature in features:
        if feature["geometry"]["type"] == "MultiLineString":
            edge = feature["properties"]
            if edge["startid"] not in nodes or edge["endid"] not in nodes:
                raise SystemExit(f"edge {edge['id']} leads nowhere")
            way = (edge["endid"], float(edge["cost"]), edge["metadata"]["class"])
            edges.setdefault(edge["startid"], []).append(way)
    return nodes, edges


def find_way(edges: dict[int, list[tuple[int, float, str]]], start: int, goal: int) -> list[tuple[Any, ...]]:
    """Return the cheapest way as (from, to, class, cost) of its edges; Dijkstra, as nav2_route does."""
    queue: list[tuple[float, int, tuple[Any, ...]]] = [(0.0, start, ())]
    done: set[int] = set()
    while queue:
        cost, number, way = heapq.heappop(queue)
        if number == goal:
            return list(way)
        if number not in done:
            done.add(number)
            for end, more, kind in edges.get(number, []):
                heapq.heappush(queue, (cost + more, end, (*way, (number, end, kind, more))))
    raise SystemExit(f"no way from node {start} to node {goal}")


def show_graph(path: Path, picture: Path) -> None:
    """Search the graph from the lowest node to the highest."""
    nodes, edges = read_graph(path)
    show(f"{path.name}: {len(nodes)} nodes, {sum(map(len, edges.values()))} edges")
    start = min(nodes, key=lambda number: nodes[number]["z"])
    goal = max(nodes, key=lambda number: nodes[number]["z"])
    way = find_way(edges, start, goal)
    for begin, end, kind, more in way:
        show(f"  node {begin} -> {end}: {kind}, {more:.1f} s")
    cost = sum(more for *_, more in way)
    show(f"  {cost:.1f} s in all")
    figure = plt.figure(figsize=(7, 7))
    axes = figure.add_subplot(projection="3d")
    taken = {(begin, end) for begin, end, _, _ in way}
    for begin, ways in edges.items():
        for end, _, kind in ways:
            ends = np.array([[nodes[number][key] for key in ("x", "y", "z")] for number in (begin, end)])
            color = GREEN if (begin, end) in taken else ORANGE if kind.startswith("stairs") else GREY
            is_taken = (begin, end) in taken
            axes.plot(*ends.T, color=color, linewidth=3 if is_taken else 1, zorder=3 if is_taken else 1)
    for number, node in nodes.items():
        if node["class"] == "stair_staging":
            axes.text(node["x"], node["y"], node["z"] + 0.2, f" {number}: floor {node['floor']}", color=BLUE)
        axes.scatter(node["x"], node["y"], node["z"], color=BLUE, s=8)
    axes.set_title(f"nodes and edges; green: node {start} to node {goal}, {cost:.0f} s")
    finish_3d(axes)
    axes.set_aspect("auto")
    axes.yaxis.set_major_locator(MaxNLocator(3))
    save(figure, picture)


def show_osm(path: Path, picture: Path) -> None:
    """Open the OpenStreetMap features as any GIS does, through GDAL."""
    frame = geopandas.read_file(path)
    metric = frame.to_crs(frame.estimate_utm_crs())
    frame["length_m"] = metric.length.round(2)
    columns = ["highway", "level", "step_count", "incline", "width", "step:height", "length_m"]
    show(f"{path.name}: {frame.crs}, {len(frame)} features")
    show(frame[columns].to_string(na_rep=""))
    figure, axes = plt.subplots(figsize=(6, 6))
    for kind, color in (("footway", GREY), ("steps", ORANGE)):
        frame[frame["highway"] == kind].plot(ax=axes, color=color, linewidth=3, label=f"highway={kind}")
    axes.set(xlabel="longitude, °", ylabel="latitude, °", title="read by GDAL (geopandas)")
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.tick_params(axis="x", rotation=30)
    axes.legend(loc="lower center")
    save(figure, picture)


def show_ifc(path: Path, picture: Path) -> None:
    """Validate the building model and draw what ifcopenshell's geometry kernel makes of it."""
    model = ifcopenshell.open(str(path))
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, logger)
    show(f"{path.name}: {model.schema}, {len(logger.statements)} complaints of the schema check")
    for storey in model.by_type("IfcBuildingStorey"):
        show(f"  {storey.Name}: elevation {storey.Elevation:.2f}")
    for flight in model.by_type("IfcStairFlight"):
        show(
            f"  {flight.Name}: NumberOfRisers {flight.NumberOfRisers}, RiserHeight {flight.RiserHeight:.3f}, "
            f"TreadLength {flight.TreadLength:.3f}"
        )
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    parts = []
    for element in (*model.by_type("IfcStairFlight"), *model.by_type("IfcSlab")):
        shape = ifcopenshell.geom.create_shape(settings, element).geometry
        vertices = np.array(shape.verts).reshape(-1, 3)
        color = BLUE if element.is_a("IfcStairFlight") else GREY
        parts.append((vertices[np.array(shape.faces).reshape(-1, 3)], color))
    draw_triangles(parts, "read by ifcopenshell: flights blue, landings grey", picture)


def show_meshes(ply: Path, obj: Path, picture: Path) -> None:
    """Read the surfaces with two mesh libraries; they must agree."""
    surface = trimesh.load(ply, process=False)
    other = meshio.read(obj)
    for name, triangles in (
        (f"{ply.name}, trimesh", surface.triangles),
        (f"{ply.name}, meshio", triangles_of(meshio.read(ply))),
        (f"{obj.name}, trimesh", trimesh.load(obj, process=False).triangles),
        (f"{obj.name}, meshio", triangles_of(other)),
    ):
        sides = triangles[:, 1:] - triangles[:, :1]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
        show(f"{name}: {len(triangles)} triangles, {area:.2f} m2, top at {triangles[..., 2].max():.2f} m")
    is_nosing = (surface.visual.vertex_colors[:, :3] == (213, 94, 0)).all(axis=1)
    nosings = surface.vertices[is_nosing].reshape(-1, 2, 3)
    title = "stairways.ply read by trimesh; nosings orange"
    draw_triangles([(surface.triangles, "#a0aeba")], title, picture, lines=nosings)


def triangles_of(mesh: meshio.Mesh) -> np.ndarray:
    """Return (N, 3, 3) corners."""
    return np.asarray(mesh.points[mesh.cells_dict["triangle"]])


def draw_triangles(
    parts: list[tuple[np.ndarray, str]], title: str, picture: Path, *, lines: np.ndarray | None = None
) -> None:
    """Draw groups of (N, 3, 3) triangles and (N, 2, 3) lines."""
    figure = plt.figure(figsize=(6, 7))
    axes = figure.add_subplot(projection="3d")
    for triangles, color in parts:
        axes.add_collection3d(Poly3DCollection(triangles, facecolor=color, edgecolor="white", linewidth=0.2))
    if lines is not None:
        axes.add_collection3d(Line3DCollection(lines, color=ORANGE, linewidth=1))
    every = np.concatenate([triangles.reshape(-1, 3) for triangles, _ in parts])
    axes.auto_scale_xyz(*every.T)
    axes.set_title(title)
    finish_3d(axes)
    save(figure, picture)


def finish_3d(axes: Any) -> None:
    """Name the axes and give all the same scale."""
    axes.set(xlabel="x, m", ylabel="y, m", zlabel="z, m")
    axes.set_aspect("equal")
    axes.view_init(elev=22, azim=-55)


def save(figure: Any, path: Path) -> None:
    """Write a picture."""
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


if __name__ == "__main__":
    export_folder, plan_folder, images = map(Path, sys.argv[1:4])
    show_masks(export_folder, plan_folder, images / "navigation-nav2-masks.png")
    show_graph(export_folder / "route_graph.geojson", images / "navigation-nav2-graph.png")
    show_osm(export_folder / "stairways_osm.geojson", images / "navigation-osm.png")
    show_ifc(export_folder / "stairways.ifc", images / "navigation-ifc.png")
    show_meshes(
        export_folder / "stairways.ply", export_folder / "stairways.obj", images / "navigation-mesh.png"
    )

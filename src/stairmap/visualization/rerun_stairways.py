"""A stairway as entities of rerun: surface, nosings, and for each flight a box, an arrow up and a label.

It is handed the package rerun and imports nothing of it itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from stairmap.stairway import Stairway
from stairmap.visualization.stairway_labels import (
    ASCENT_COLOR,
    SURFACE_COLOR,
    ascent_arrow,
    flight_measures,
    flight_title,
    stairway_color,
)


def stairway_entities(rerun: Any, stairway: Stairway, *, label_lift: float) -> Iterator[tuple[str, Any]]:
    """Return the path below the stairway's own, and the archetype, of everything that shows it.

    Parameters
    ----------
    rerun
        The package.
    stairway
        What to show, map, m.
    label_lift
        How high labels stand above the end of their arrow, m.
    """
    color = stairway_color(stairway.id)
    vertices, triangles = stairway.surface()
    yield (
        "surface",
        rerun.Mesh3D(
            vertex_positions=vertices,
            triangle_indices=triangles,
            vertex_colors=np.tile(SURFACE_COLOR, (len(vertices), 1)),
        ),
    )
    yield "nosings", rerun.LineStrips3D(stairway.edges(), colors=color, radii=0.014)
    for index, flight in enumerate(stairway.flights):
        path, box = f"flight_{index + 1}", flight.box
        yield (
            f"{path}/box",
            rerun.Boxes3D(
                centers=[box.center],
                sizes=[[box.depth, box.width, box.height]],
                rotation_axis_angles=[rerun.RotationAxisAngle(axis=[0, 0, 1], radians=flight.heading)],
                colors=color,
                radii=0.004,
                fill_mode=rerun.components.FillMode.MajorWireframe,
            ),
        )
        start, end = ascent_arrow(flight)
        yield (
            f"{path}/up",
            rerun.Arrows3D(origins=[start], vectors=[end - start], colors=ASCENT_COLOR, radii=0.015),
        )
        text = "\n".join([flight_title(stairway, index), *flight_measures(flight)])
        place = end + np.array([0.0, 0.0, label_lift])
        yield (
            f"{path}/label",
            rerun.Points3D([place], radii=0.001, colors=color, labels=[text], show_labels=True),
        )

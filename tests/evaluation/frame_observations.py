"""A view of a flight and the observation that sees it without error, for tests of the judgement of frames."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from stairmap.detection.observation import StairEdge, StairObservation
from stairmap.simulation.kind_scenes import make_ascending_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.viewpoints import look_at
from stairmap.simulation.views import StepsInView, View

SHAPE = FlightShape(rise=0.17, run=0.28, width=1.2, num_risers=8, overhang=0.03)


def make_view_of(shape: FlightShape = SHAPE, **changes: Any) -> View:
    """Return a view that looks up a flight from 1.5 m before it."""
    view = View(
        kind="overhang", group="30 mm", scene=make_ascending_scene("test", shape, np.random.default_rng(0)),
        sensor=make_sensor("kinect_v1", factor=0.5),
        map_from_camera=look_at([-1.5, 0.3, 0.8], [0.5, 0.0, 0.4], roll=0.2), seed=(0,),
    )  # fmt: skip
    return replace(view, **changes)


def all_in_view(num: int = 8) -> StepsInView:
    """Return the account of an image in which every tread and riser covers ten rows and twenty sigma."""
    return StepsInView(
        tread_rows=np.full(num, 10.0), riser_rows=np.full(num, 10.0), riser_sigmas=np.full(num, 20.0)
    )


def observe(
    seen_from: View, *, first: int = 0, num: int = 5, lift: dict[int, float] | None = None, **changes: Any
) -> StairObservation:
    """Return what a method without error says of steps of a view's flight.

    ``lift`` raises single edges, by number from ``first``, m.
    """
    flight, pose = seen_from.flight, seen_from.map_from_camera
    assert flight is not None
    nosings = np.array([step.nosing for step in flight.steps[first : first + num]])
    for index, height in (lift or {}).items():
        nosings[index, :, 2] += height
    in_camera = (nosings - pose[:3, 3]) @ pose[:3, :3]
    edges = tuple(
        StairEdge(
            nosing=nosing, step_index=index, left_bounded=True, right_bounded=True, cue="jump",
            num_pixels=50, std=(0.004, 0.003),
        )
        for index, nosing in enumerate(in_camera)
    )  # fmt: skip
    values: dict[str, Any] = {
        "stamp_ns": 0, "view": "ascending", "up": pose[2, :3], "forward": pose[:3, :3].T @ flight.forward,
        "edges": edges, "rise": flight.rise, "run": flight.run, "width": flight.width,
        "overhang": flight.overhang, "overhang_std": 0.003, "origin": in_camera[0].mean(axis=0),
        "covariance": np.diag([0.001**2, 0.002**2, 1e-4, 1e-4, 1e-4, 1e-4]), "floor_seen": first == 0,
        "points": np.zeros((0, 3)),
    }  # fmt: skip
    return StairObservation(**{**values, **changes})

"""Hypothesis strategies for the values that stairmap passes around."""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from stairmap.arrays import Float64Array, Points, Transform, Vector
from stairmap.geometry import normalized
from stairmap.stairway import Flight, FlightStd
from stairmap.transforms import rotation_from_quat, transform_from_parts

no_deadline = settings(deadline=None)
"""Tests check results, not times."""

coordinates = st.floats(-50, 50)


@st.composite
def vectors(draw: st.DrawFn, size: int = 3, limit: float = 50.0) -> Vector:
    return np.array(draw(st.lists(st.floats(-limit, limit), min_size=size, max_size=size)))


@st.composite
def directions(draw: st.DrawFn) -> Vector:
    return normalized(draw(vectors(limit=1.0).filter(lambda vector: np.linalg.norm(vector) > 0.1)))


@st.composite
def quaternions(draw: st.DrawFn) -> Float64Array:
    quat = draw(vectors(size=4, limit=1.0).filter(lambda vector: np.linalg.norm(vector) > 0.1))
    return np.asarray(quat / np.linalg.norm(quat))


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    return transform_from_parts(rotation_from_quat(draw(quaternions())), draw(vectors()))


@st.composite
def point_clouds(draw: st.DrawFn, min_size: int = 0, max_size: int = 20) -> Points:
    rows = draw(st.lists(vectors(), min_size=min_size, max_size=max_size))
    return np.array(rows).reshape(-1, 3)


@st.composite
def flights(draw: st.DrawFn) -> Flight:
    """Any flight of the envelope that the project states, at any place and heading."""
    deviation = st.floats(0, 0.1)
    return Flight(
        base=draw(vectors()),
        heading=draw(st.floats(-np.pi, np.pi)),
        rise=draw(st.floats(0.10, 0.25)),
        run=draw(st.floats(0.20, 0.40)),
        width=draw(st.floats(0.5, 5.0)),
        num_risers=draw(st.integers(1, 20)),
        left_bounded=draw(st.booleans()),
        right_bounded=draw(st.booleans()),
        overhang=draw(st.one_of(st.just(float("nan")), st.floats(0, 0.045))),
        bottom_seen=draw(st.sampled_from([None, False, True])),
        top_seen=draw(st.sampled_from([None, False, True])),
        std=FlightStd(
            rise=draw(deviation),
            run=draw(deviation),
            width=draw(deviation),
            pitch=draw(deviation),
            heading=draw(deviation),
            base=np.array([draw(deviation), draw(deviation), draw(deviation)]),
            overhang=draw(st.one_of(st.just(float("nan")), deviation)),
        ),
    )

"""Of a robot's transforms those that carry the camera are kept, whatever the order in which they come."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.arrays import Transform
from stairmap.errors import TransformLookupError
from stairmap.recordings.bags.transform_intake import TransformIntake, guess_map_frame
from stairmap.transforms import transform_from_parts

MS = 1_000_000
NUM_STAMPS = 20


def at_x(x: float) -> Transform:
    return transform_from_parts(np.eye(3), [x, 0.0, 0.0])


def fill(intake: TransformIntake, *links: tuple[str, str, bool], offset: float = 0.0) -> TransformIntake:
    """Publish links by turns, 20 ms apart: the child drives 1 m/s, unless it is static."""
    for index in range(NUM_STAMPS):
        for parent, child, is_static in links:
            x = 0.5 if is_static else offset + 0.02 * index
            intake.take(parent, child, index * 20 * MS, at_x(x), is_static=is_static)
    return intake


@pytest.mark.parametrize("is_upward", [True, False])
def test_chain_is_known_from_its_first_stamps_on_in_any_order(is_upward: bool) -> None:
    links = [("map", "odom", False), ("odom", "base", False), ("base", "head", False), ("head", "cam", True)]
    intake = fill(TransformIntake("cam"), *(links if is_upward else links[::-1]))
    assert intake.ancestors() == ("cam", "head", "base", "odom", "map")
    assert intake.buffer.lookup("map", "cam", 0)[0, 3] == pytest.approx(0.5)
    assert intake.buffer.lookup("map", "cam", 110 * MS)[0, 3] == pytest.approx(0.5 + 3 * 0.11)


def test_what_does_not_carry_the_camera_is_named_and_not_kept() -> None:
    intake = fill(
        TransformIntake("cam"), ("odom", "base", False), ("base", "leg", False), ("base", "cam", True)
    )
    assert intake.coordinate_frames == ("base", "cam", "leg", "odom")
    with pytest.raises(TransformLookupError):
        intake.buffer.lookup("odom", "leg", 0)


def test_what_else_is_asked_for_is_kept_too() -> None:
    links = [("map", "base", False), ("map", "cart", False), ("base", "cam", True)]
    intake = fill(TransformIntake("cam", also="/cart"), *links)
    assert intake.buffer.lookup("cart", "cam", 200 * MS)[0, 3] == pytest.approx(0.5)


def test_static_transforms_alone_survive_a_jump_in_time() -> None:
    intake = fill(TransformIntake("cam"), ("odom", "base", False), ("base", "cam", True))
    other = intake.with_static_only()
    assert other.buffer.lookup("base", "cam", 0)[0, 3] == 0.5
    assert other.ancestors() == ("cam", "base")
    assert other.has_static


def test_root_that_the_camera_is_fixed_to() -> None:
    intake = fill(
        TransformIntake("cam"), ("odom", "base", False), ("base", "link", True), ("link", "cam", True)
    )
    assert intake.static_root() == "base"
    assert intake.is_fixed("base")
    assert not intake.is_fixed("odom")


@pytest.mark.parametrize(
    ("links", "expected"),
    [
        ([("earth", "map", True), ("map", "odom", False), ("odom", "cam", False)], "map"),
        ([("odom", "base", False), ("base", "cam", True)], "odom"),
        ([("spot/odom", "spot/body", False), ("spot/body", "cam", True)], "spot/odom"),
        ([("vicon", "base", False), ("base", "cam", True)], "vicon"),
        ([("world", "cam", True)], "world"),
        ([("base", "cam", True)], None),
        ([], None),
    ],
)
def test_map_is_guessed(links: list[tuple[str, str, bool]], expected: str | None) -> None:
    assert guess_map_frame(fill(TransformIntake("cam"), *links)) == expected


def test_loop_of_transforms_ends() -> None:
    intake = fill(TransformIntake("a"), ("b", "a", False), ("a", "b", False))
    assert intake.ancestors() == ("a", "b")
    assert guess_map_frame(intake) == "b"

"""Maps of Nav2: what is written is read back, also by OpenCV and a plain YAML reader."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, MapError, OccupancyGrid, dump_map, load_map
from value_strategies import no_deadline

CELLS = np.array([[FREE, FREE, OCCUPIED], [UNKNOWN, FREE, OCCUPIED]], dtype=np.int8)
GRID = OccupancyGrid(cells=CELLS, resolution=0.05, origin=(-1.5, 2.25))


def read_as_nav2(path):
    """Read a map by the rules of nav2_map_server's map_io.cpp, mode trinary."""
    doc = yaml.safe_load(path.read_text())
    image = cv2.imread(str(path.parent / doc["image"]), cv2.IMREAD_UNCHANGED)
    shade = image / 255.0
    occupancy = shade if doc["negate"] else 1.0 - shade
    cells = np.full(image.shape, -1)
    cells[doc["occupied_thresh"] < occupancy] = 100
    cells[occupancy < doc["free_thresh"]] = 0
    return cells[::-1], doc


@no_deadline
@given(
    npst.arrays(
        np.int8,
        npst.array_shapes(min_dims=2, max_dims=2, max_side=9),
        elements=st.sampled_from([0, 100, -1]),
    )
)
def test_a_map_that_was_written_is_read_back_equal(tmp_path_factory, cells):
    cells[0, 0] = FREE
    folder = tmp_path_factory.mktemp("map")
    path = dump_map(OccupancyGrid(cells=cells, resolution=0.05, origin=(1.0, -2.0)), folder, "floor")
    back = load_map(path)
    assert np.array_equal(back.cells, cells)
    assert (back.resolution, back.origin) == (0.05, (1.0, -2.0))
    assert np.array_equal(read_as_nav2(path)[0], cells)


def test_the_yaml_file_has_the_keys_that_nav2_needs(tmp_path):
    _, doc = read_as_nav2(dump_map(GRID, tmp_path, "floor_0"))
    assert doc["origin"] == [-1.5, 2.25, 0.0]
    assert {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"} <= set(doc)


def test_cells_are_where_their_points_are():
    assert GRID.value_at((-1.49, 2.26)) == FREE
    assert GRID.value_at((-1.36, 2.26)) == OCCUPIED
    assert GRID.value_at((-1.49, 2.31)) == UNKNOWN
    assert GRID.value_at((0, 0)) is None
    assert GRID.centers(np.array([0]), np.array([2]))[0] == pytest.approx([-1.375, 2.275])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"image": "other.pgm"}, "names the image"),
        ({"resolution": -1}, "resolution must be above zero"),
        ({"resolution": "fine"}, "lacks or misstates a key"),
        ({"origin": [0, 0]}, r"expected origin \[x, y, 0\]"),
        ({"origin": [0, 0, 0.3]}, "a map that is not turned"),
        ({"free_thresh": 0.9}, "free_thresh < occupied_thresh"),
        ({"mode": "scale"}, "expected mode trinary"),
        ({"width": 99}, "disagree: width is 99 in the one, 3 px in the other"),
        ({"negate": 1, "occupied_thresh": 0.1, "free_thresh": 0.0}, "disagree: with these thresholds"),
    ],
)
def test_a_map_whose_files_disagree_is_refused_in_one_line(tmp_path, change, words):
    path = dump_map(GRID, tmp_path, "floor")
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **change}))
    with pytest.raises(MapError, match=words) as refusal:
        load_map(path)
    assert "\n" not in str(refusal.value)


def test_an_image_that_is_cut_short_is_refused_in_silence_but_for_one_line(tmp_path, capfd):
    path = dump_map(GRID, tmp_path, "floor")
    image = path.with_suffix(".pgm")
    image.write_bytes(image.read_bytes()[:-1])
    with pytest.raises(MapError, match="cut short"):
        load_map(path)
    assert capfd.readouterr() == ("", "")


def test_the_image_in_place_of_the_yaml_file_is_refused(tmp_path):
    path = dump_map(GRID, tmp_path, "floor").with_suffix(".pgm")
    path.write_bytes(path.read_bytes() + b"\xff\xfe")
    with pytest.raises(MapError, match="name its YAML file"):
        load_map(path)


def test_a_damaged_image_and_a_missing_map_are_refused(tmp_path):
    path = dump_map(GRID, tmp_path, "floor")
    (tmp_path / "floor.pgm").write_bytes(b"a picture of a floor")
    with pytest.raises(MapError, match="damaged or no picture"):
        load_map(path)
    with pytest.raises(MapError, match="cannot read the map"):
        load_map(tmp_path / "none.yaml")

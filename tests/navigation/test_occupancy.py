"""Maps of Nav2: what is written is read back, also by OpenCV and a plain YAML reader."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from stairmap.errors import OutputError
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
        ({"resolution": -1}, "resolution: should be greater than 0, got -1"),
        ({"resolution": "fine"}, "lacks or misstates a key"),
        ({"origin": [0, 0]}, "origin: .* at least 3 items"),
        ({"origin": [0, 0, 0.3]}, "a map that is not turned"),
        ({"free_thresh": 0.9}, "free_thresh < occupied_thresh"),
        ({"mode": "scale"}, "mode: should be 'trinary', got 'scale'"),
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


@pytest.mark.parametrize(
    ("point", "cell", "is_inside"),
    [
        ((-1.5, 2.25), (0, 0), True), ((-1.51, 2.26), (0, -1), False), ((-1.49, 2.24), (-1, 0), False),
        ((-1.36, 2.34), (1, 2), True), ((-1.34, 2.34), (1, 3), False), ((-1.36, 2.36), (2, 2), False),
    ],
)  # fmt: skip
def test_a_point_is_in_the_cell_below_and_left_of_it_and_the_grid_ends_with_its_last(point, cell, is_inside):
    (index,), (inside,) = GRID.cells_at([*point, 9.0])
    assert (tuple(index), inside) == (cell, is_inside)
    assert (GRID.value_at(point) is not None) == is_inside


def test_many_points_are_looked_up_at_once():
    index, inside = GRID.cells_at([[-1.49, 2.26, 5.0], [9.0, 9.0, 5.0]])
    assert index[0].tolist() == [0, 0]
    assert inside.tolist() == [True, False]


@pytest.mark.parametrize("resolution", [0.0, -0.05, float("inf"), float("nan")])
def test_a_grid_without_size_of_cells_is_refused(resolution):
    with pytest.raises(MapError, match="resolution must be above zero"):
        OccupancyGrid(cells=CELLS, resolution=resolution, origin=(0, 0))


@pytest.mark.parametrize("shape", [(0, 3), (3,), (2, 2, 2)])
def test_a_grid_without_rows_and_columns_is_refused(shape):
    with pytest.raises(MapError, match="needs rows and columns"):
        OccupancyGrid(cells=np.zeros(shape, dtype=np.int8), resolution=0.1, origin=(0, 0))


def rewrite(path, **change):
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **change}))
    return path


def test_the_image_of_a_map_is_a_pgm_with_nav2s_shades_top_row_first(tmp_path):
    dump_map(GRID, tmp_path, "floor")
    content = (tmp_path / "floor.pgm").read_bytes()
    assert content == b"P5\n# 0.05 m a pixel\n3 2\n255\n" + bytes([205, 254, 0, 254, 254, 0])


@pytest.mark.parametrize(
    ("shade", "value"),
    [(205, UNKNOWN), (206, FREE), (90, UNKNOWN), (89, OCCUPIED), (0, OCCUPIED), (255, FREE)],
)
def test_a_shade_is_read_by_the_thresholds_of_its_file(tmp_path, shade, value):
    """Occupied above 0.65, free below 0.196 of black."""
    path = dump_map(GRID, tmp_path, "floor")
    (tmp_path / "floor.pgm").write_bytes(b"P5\n3 2\n255\n" + bytes([shade, 254, 254, 254, 254, 254]))
    assert load_map(path).cells[1, 0] == value


def test_a_negated_map_is_read_the_other_way_round(tmp_path):
    path = rewrite(dump_map(GRID, tmp_path, "floor"), negate=1)
    (tmp_path / "floor.pgm").write_bytes(b"P5\n3 2\n255\n" + bytes([0, 255, 100, 0, 0, 0]))
    assert load_map(path).cells.tolist() == [[FREE, FREE, FREE], [FREE, OCCUPIED, UNKNOWN]]


@pytest.mark.parametrize(
    ("change", "is_taken"),
    [
        ({"free_thresh": 0.0, "occupied_thresh": 0.5}, False),
        ({"free_thresh": 0.4, "occupied_thresh": 0.4}, False),
        ({"free_thresh": 0.4, "occupied_thresh": 1.0}, True), ({"occupied_thresh": 1.01}, False),
        ({"free_thresh": -0.01}, False), ({"resolution": 0}, False), ({"resolution": float("inf")}, False),
        ({"height": 2, "width": 3}, True), ({"height": 3}, False), ({"origin": [1, 2, 0, 0]}, False),
    ],
)  # fmt: skip
def test_a_map_right_at_what_can_be_is_taken_and_one_beyond_refused(tmp_path, change, is_taken):
    path = rewrite(dump_map(GRID, tmp_path, "floor"), **change)
    if is_taken:
        assert load_map(path).resolution == 0.05
    else:
        with pytest.raises(MapError):
            load_map(path)


def test_an_image_may_have_comments_and_more_than_its_pixels_but_not_fewer(tmp_path):
    path = dump_map(GRID, tmp_path, "floor")
    pixels = bytes([205, 254, 0, 254, 254, 0])
    for header in (b"P5\n# a\n# b\n3 # c\n2\n255\n", b"P5 3 2 255\n"):
        (tmp_path / "floor.pgm").write_bytes(header + pixels + b"more")
        if b"3 #" not in header:
            assert np.array_equal(load_map(path).cells, CELLS)
        (tmp_path / "floor.pgm").write_bytes(header + pixels[:-1])
        with pytest.raises(MapError, match="3 x 2 px are announced, 5 are there"):
            load_map(path)


def test_an_empty_image_is_refused(tmp_path):
    path = dump_map(GRID, tmp_path, "floor")
    (tmp_path / "floor.pgm").write_bytes(b"")
    with pytest.raises(MapError, match="damaged or no picture"):
        load_map(path)


def test_a_map_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        dump_map(GRID, tmp_path / "file", "floor")


def test_the_yaml_file_reads_like_those_of_nav2_s_map_saver(tmp_path):
    keys = [line.partition(":")[0] for line in dump_map(GRID, tmp_path, "floor").read_text().splitlines()]
    assert [key for key in keys if not key.startswith("-")] == [
        "image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"
    ]  # fmt: skip

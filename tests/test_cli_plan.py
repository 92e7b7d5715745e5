"""``stairmap export`` and ``stairmap plan``: from a recording to files and a way."""

from __future__ import annotations

import json
import shutil
from importlib import resources

import cv2
import numpy as np
import pytest
import yaml

from command_line import check_refused, stairmap
from small_recordings import write_recording
from stairmap.drop import Drop
from stairmap.export.results import RunFolder
from stairmap.navigation.occupancy import OccupancyGrid, dump_map, load_map
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_stairway


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "stairs")


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory, recording):
    folder = tmp_path_factory.mktemp("runs") / "stairs"
    assert stairmap("run", recording, "-o", folder, "--no-report").code == 0
    return folder


@pytest.fixture(scope="module")
def tower(tmp_path_factory):
    """Run folder of a stairway between two floors, without a way, and their maps."""
    folder = tmp_path_factory.mktemp("runs") / "tower"
    folder.mkdir()
    RunFolder(folder).write_stairways(
        [make_stairway(make_flight(base=(4, 5, 0), rise=3.0 / 18, num_risers=18))], num_frames=9
    )
    grid = OccupancyGrid(cells=np.zeros((100, 100), dtype=np.int8), resolution=0.1, origin=(0, 0))
    return folder, [f"{level}={dump_map(grid, folder, f'map_{level}')}" for level in (0, 1)]


@pytest.fixture
def empty_run(tmp_path):
    (tmp_path / "empty").mkdir()
    RunFolder(tmp_path / "empty").write_stairways([], num_frames=0)
    return tmp_path / "empty"


def test_export_writes_every_format_and_prints_the_paths(run_folder, tmp_path):
    pytest.importorskip("ifcopenshell", reason="needs the extra ifc")
    formats = [
        part for name in ("nav2-graph", "keepout", "osm", "ifc", "ply", "obj") for part in ("-f", name)
    ]
    outcome = stairmap("export", run_folder, *formats, "--anchor", "48.2,11.6", "-o", tmp_path / "out")
    assert outcome.code == 0, outcome.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"route_graph.geojson", "keepout_floor_0.yaml", "stairways_osm.geojson"} <= names
    assert {"stairways.ifc", "stairways.ply", "stairways.obj"} <= names
    assert outcome.stdout.splitlines()[0] == str(tmp_path / "out" / "route_graph.geojson")


def test_a_format_that_cannot_be_written_does_not_stop_the_others(run_folder, tmp_path):
    formats = ("-f", "nav2-graph", "-f", "keepout", "-f", "obj", "--robot", "wheeled")
    outcome = stairmap("export", run_folder, *formats, "-o", tmp_path / "out")
    assert outcome.code == 1
    assert "nav2_route refuses a graph without edges" in outcome.stderr
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert "stairways.obj" in names and "keepout_floor_0.pgm" in names


def test_export_goes_into_the_run_folder_by_default(tower):
    folder, _ = tower
    stairmap("export", folder / "stairways.json", "-f", "obj")
    assert (folder / "export" / "stairways.obj").is_file()


def test_geojson_without_a_place_on_earth_is_refused(run_folder):
    check_refused(stairmap("export", run_folder, "-f", "osm"), "--anchor LAT,LON")


def test_an_anchor_that_is_none_is_wrong_usage(run_folder):
    assert stairmap("export", run_folder, "-f", "osm", "--anchor", "here").code == 2
    assert stairmap("export", run_folder, "-f", "osm", "--anchor", "1").code == 2


def test_a_graph_for_wheels_would_have_no_edge(tower):
    folder, _ = tower
    outcome = stairmap("export", folder, "-f", "nav2-graph", "--robot", "wheeled")
    check_refused(outcome, "none of 1 stairways can be used by wheeled robot")


def test_a_robot_that_climbs_all_gets_the_sides_of_the_well_alone(tower, tmp_path):
    folder, _ = tower
    outcome = stairmap("export", folder, "-f", "keepout", "--robot", "spot", "-o", tmp_path / "out")
    assert (outcome.code, outcome.stdout.split()) == (0, [str(tmp_path / "out" / "keepout_floor_1.yaml")])
    assert len((tmp_path / "out" / "keepout_floor_1.pgm").read_bytes()) > 100


def test_an_empty_run_is_told_in_one_line(empty_run):
    check_refused(stairmap("export", empty_run, "-f", "obj"), "no stairway", "nothing to export")
    check_refused(stairmap("plan", empty_run), "there are no floors")


def test_plan_maps_the_recording_and_lists_where_to_explore(recording, run_folder, tmp_path):
    outcome = stairmap("plan", run_folder, "--recording", recording, "-o", tmp_path / "plan")
    assert outcome.code == 0, outcome.stderr
    assert "stairway 1" in outcome.stdout
    assert outcome.last_line == str(tmp_path / "plan")
    assert cv2.imread(str(tmp_path / "plan" / "plan.png")) is not None
    grid = load_map(tmp_path / "plan" / "floor_0.yaml")
    assert grid.value_at((-1.6, 0.05)) == 0  # where the camera was
    assert grid.value_at((0.45, 0.0)) == 100  # on the stairs


def test_plan_finds_the_way_upstairs(tower, tmp_path):
    folder, maps = tower
    options = [part for text in maps for part in ("--map", text)]
    outcome = stairmap(
        "plan", folder, *options, "--from", "1,1,0", "--to", "1,9,1", "--json", "-o", tmp_path / "plan"
    )
    legs = json.loads(outcome.stdout)["route"]["legs"]
    assert [leg["kind"] for leg in legs] == ["floor", "up", "floor"]
    assert json.loads((tmp_path / "plan" / "plan.json").read_text())["route"]["legs"] == legs
    text = stairmap("plan", folder, *options, "--from", "1,1", "--to", "1,9,1").stdout
    assert "stairway 1 up" in text
    assert "s in all" in text


def test_plan_says_why_there_is_no_way(tower):
    folder, maps = tower
    options = [part for text in maps for part in ("--map", text)]
    outcome = stairmap("plan", folder, *options, "--robot", "wheeled", "--from", "1,1", "--to", "1,9,1")
    assert outcome.code == 3
    assert "no way: there is no way to floor 1: stairway 1 (floor 0 to 1) is impassable" in outcome.stdout


def test_plan_refuses_what_it_cannot_use(tower, tmp_path, recording):
    folder, maps = tower
    check_refused(stairmap("plan", folder, "--from", "1,1"), "no map to plan on")
    check_refused(stairmap("plan", folder, "--map", maps[0]), "no trajectory.tum; pass --from")
    check_refused(stairmap("plan", folder, "--map", maps[0], "--map", maps[0]), "floor 0 has two maps")
    check_refused(stairmap("plan", folder, "--map", maps[0].replace("0=", "7=")), "no floor 7")
    check_refused(stairmap("plan", folder, "--recording", recording), "has no trajectory.tum")
    outcome = stairmap("plan", folder, "--map", maps[0], "--from", "1,1", "-o", folder)
    check_refused(outcome, "is not empty")
    for option, value in (("--map", "ground.yaml"), ("--from", "1"), ("--to", "1,2,3,4")):
        assert stairmap("plan", folder, option, value).code == 2


def test_plan_names_the_times_of_a_recording_that_is_not_the_runs(run_folder, recording, tmp_path):
    other = shutil.copytree(recording, tmp_path / "other")
    lines = (other / "depth.txt").read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    (other / "depth.txt").write_text("".join(f"{float(stamp) + 1000} {name}\n" for stamp, name in rows))
    outcome = stairmap("plan", run_folder, "--recording", other)
    check_refused(
        outcome, "expected the recording of this run, but other is another one: first stamp 1000.000"
    )


def test_plan_refuses_its_output_before_it_maps(run_folder, tmp_path):
    (tmp_path / "file").write_text("mine")
    outcome = stairmap("plan", run_folder, "--recording", tmp_path / "none", "-o", tmp_path / "file")
    check_refused(outcome, "is a file; name a folder")


def test_masks_and_graph_of_an_earlier_robot_are_removed_by_the_next_export(tower, tmp_path):
    """Wheels once followed the graph that a climber's export had left beside their masks."""
    folder, _ = tower
    formats = ("-f", "nav2-graph", "-f", "keepout", "-o", tmp_path / "out")
    assert stairmap("export", folder, *formats, "--robot", "spot").code == 0
    (tmp_path / "out" / "keepout_floor_7.yaml").write_text("of another run")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "keepout_floor_1.pgm", "keepout_floor_1.yaml", "keepout_floor_7.yaml", "route_graph.geojson",
    ]  # fmt: skip
    outcome = stairmap("export", folder, *formats, "--robot", "wheeled")
    assert outcome.code == 1
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "keepout_floor_0.pgm", "keepout_floor_0.yaml", "keepout_floor_1.pgm", "keepout_floor_1.yaml",
    ]  # fmt: skip
    assert stairmap("export", folder, *formats, "--robot", "spot").code == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "keepout_floor_1.pgm", "keepout_floor_1.yaml", "route_graph.geojson",
    ]  # fmt: skip


def test_a_map_that_no_format_reads_is_refused(tower, tmp_path):
    """A broken map once passed in silence, and the mask was not laid out like it."""
    folder, maps = tower
    outcome = stairmap("export", folder, "-f", "keepout", "--map", maps[0], "-o", tmp_path / "out")
    check_refused(outcome, "--map is for nav2-graph and rmf alone")
    assert not (tmp_path / "out").exists()


def test_a_run_that_saw_a_drop_and_no_stairs_has_a_mask(tmp_path):
    (tmp_path / "dock").mkdir()
    edge = np.array([[2.0, 1.0, 0.0], [2.0, -1.0, 0.0]])
    drop = Drop(id=1, edge=edge, depth=1.1, num_observations=9, first_seen_ns=0, last_seen_ns=1)
    folder = RunFolder(tmp_path / "dock")
    folder.write_stairways([], num_frames=9, drops=[drop], camera_height=0.3)
    poses = np.tile(np.eye(4), (9, 1, 1))
    poses[:, 2, 3] = 0.3
    folder.write_trajectory(Trajectory(stamps_ns=np.arange(9) * 10**8, map_from_camera=poses))
    outcome = stairmap(
        "export", tmp_path / "dock", "-f", "keepout", "-o", tmp_path / "out", "--robot", "spot"
    )
    assert outcome.code == 0, outcome.stderr
    image = cv2.imread(str(tmp_path / "out" / "keepout_floor_0.pgm"), cv2.IMREAD_GRAYSCALE)
    header = yaml.safe_load((tmp_path / "out" / "keepout_floor_0.yaml").read_text())
    for x, shade in ((1.8, 0), (1.6, 205)):
        column, row = np.floor((np.array([x, 0.0]) - header["origin"][:2]) / header["resolution"]).astype(int)
        assert image[len(image) - 1 - row, column] == shade
    check_refused(stairmap("export", tmp_path / "dock", "-f", "obj"), "holds no stairway")


def test_a_plan_without_a_way_or_with_nothing_left_says_so_by_its_exit_code(tower, tmp_path):
    """Scripts could not tell a way from none: both were exit code 0."""
    folder, maps = tower
    floors = [part for text in maps for part in ("--map", text)]
    ends = ("--from", "1,1,0", "--to", "1,1,1")
    assert stairmap("plan", folder, *floors, *ends, "--robot", "spot").code == 0
    for json_option in ((), ("--json",)):
        outcome = stairmap("plan", folder, *floors, *ends, "--robot", "wheeled", *json_option)
        assert outcome.code == 3
        assert "impassable" in outcome.stdout
        assert outcome.stderr.count("error") == 0
    # Both floors have whole maps: there is no frontier, and no stairs lead elsewhere.
    nothing = stairmap("plan", folder, *floors, "--from", "1,1,0", "--robot", "wheeled")
    assert nothing.code == 3
    assert "nothing left to explore" in nothing.stdout


def test_a_robot_that_takes_stairs_in_one_direction_is_planned_that_way(tower, tmp_path):
    folder, maps = tower
    floors = [part for text in maps for part in ("--map", text)]
    source = (resources.files("stairmap.navigation") / "robots" / "spot.yaml").read_text("utf-8")
    (tmp_path / "climber.yaml").write_text(source + "\nstair_directions: up\n")
    up = ("--from", "1,1,0", "--to", "1,1,1", "--robot", tmp_path / "climber.yaml")
    down = ("--from", "1,1,1", "--to", "1,1,0", "--robot", tmp_path / "climber.yaml")
    assert stairmap("plan", folder, *floors, *up).code == 0
    outcome = stairmap("plan", folder, *floors, *down)
    assert outcome.code == 3
    assert "is used up only" in outcome.stdout
    (tmp_path / "wrong.yaml").write_text(source + "\nstair_directions: sideways\n")
    check_refused(
        stairmap("plan", folder, *floors, "--robot", tmp_path / "wrong.yaml"),
        "stair_directions: should be 'both', 'up' or 'down', got 'sideways'",
    )


def test_spot_is_told_of_no_stairs_that_the_robot_cannot_climb(tower, tmp_path):
    pytest.importorskip("bosdyn.api")
    folder, _ = tower
    out = tmp_path / "out"
    assert stairmap("export", folder, "-f", "spot", "--robot", "spot", "-o", out).code == 0
    assert [path.name for path in out.iterdir()] == ["spot_stairway_1_flight_1.pb"]
    outcome = stairmap("export", folder, "-f", "spot", "--robot", "wheeled", "-o", out)
    check_refused(outcome, "none of 1 stairways can be used by wheeled robot")
    assert not list(out.iterdir())


def test_the_graph_of_stairs_whose_end_nobody_saw_is_written_with_a_warning(tmp_path):
    (tmp_path / "run").mkdir()
    folder = RunFolder(tmp_path / "run")
    folder.write_stairways([make_stairway(make_flight(top_seen=False))], num_frames=9)
    for name in ("nav2-graph", "rmf"):
        outcome = stairmap("export", tmp_path / "run", "-f", name, "-o", tmp_path / "out")
        assert outcome.code == 0, outcome.stderr
        assert "stairway 1: nobody saw its upper end" in outcome.stderr

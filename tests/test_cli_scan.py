"""``stairmap scan`` and what is done with its run folder."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cloud_files import POINTS, write_ascii_pcd, write_binary_pcd, write_binary_ply, write_las, write_xyz
from command_line import check_refused, stairmap
from sampled_clouds import sampled_scene
from stairmap.stairway import Flight

GRID = np.array([691_000.0, 5_335_000.0, 512.0])


@pytest.fixture(scope="module")
def hall() -> tuple[np.ndarray, Flight]:
    points, (flight,) = sampled_scene("free_standing")
    return points, flight


@pytest.fixture(scope="module")
def run(hall, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan")
    write_binary_pcd(folder / "hall.pcd", hall[0])
    outcome = stairmap("scan", folder / "hall.pcd", "-o", folder / "run")
    assert outcome.code == 0, outcome
    assert outcome.last_line == str(folder / "run")
    return folder / "run"


def scanned(path: Path, output: Path, *options: str) -> dict:
    outcome = stairmap("scan", path, "-o", output, "--json", "--no-report", *options)
    assert outcome.code == 0, outcome
    return json.loads(outcome.stdout)


def check_flight(found: dict, flight: Flight, base: np.ndarray) -> None:
    assert found["rise"] == pytest.approx(flight.rise, abs=0.003)
    assert found["run"] == pytest.approx(flight.run, abs=0.003)
    assert found["width"] == pytest.approx(flight.width, abs=0.02)
    assert found["num_risers"] == flight.num_risers
    assert found["base"] == pytest.approx(base.tolist(), abs=0.02)


def test_run_folder_holds_everything(run: Path) -> None:
    names = {path.name for path in run.iterdir()}

    assert names >= {
        "stairways.json", "detections.jsonl", "config.yaml", "stairways.ply", "summary.txt", "report.html",
        "log.txt", "scan.json",
    }  # fmt: skip
    report = (run / "report.html").read_text()
    assert report.count("data:image/png") == 3
    assert "https://" not in report


def test_flight_stands_in_the_files_own_coordinates(run: Path, hall) -> None:
    flight = hall[1]
    (stairway,) = json.loads((run / "stairways.json").read_text())["stairways"]

    check_flight(stairway["flights"][0], flight, flight.base)
    assert stairway["flights"][0]["heading"] == pytest.approx(flight.heading, abs=0.01)
    assert stairway["flights"][0]["bottom_seen"] is True
    assert len(stairway["flights"][0]["steps"]) == flight.num_risers


def test_national_grids_are_kept(hall, tmp_path: Path) -> None:
    points, flight = hall
    write_las(tmp_path / "hall.laz", points + GRID)

    values = scanned(tmp_path / "hall.laz", tmp_path / "run")

    check_flight(values["stairways"][0]["flights"][0], flight, flight.base + GRID)
    assert values["map_from_file"] == np.eye(4).tolist()
    assert stairmap("check", tmp_path / "run", "--robot", "spot").code == 0


def test_millimetres_with_y_up_are_noticed_and_said(hall, tmp_path: Path) -> None:
    points, flight = hall
    y_up = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    write_binary_ply(tmp_path / "hall.ply", 1000 * y_up, order=">")

    outcome = stairmap("scan", tmp_path / "hall.ply", "-o", tmp_path / "run", "--json", "--no-report")

    values = json.loads(outcome.stdout)
    check_flight(values["stairways"][0]["flights"][0], flight, flight.base)
    assert "coordinates are in mm (by the height of the map" in outcome.stderr
    assert "its +y axis is z" in outcome.stderr
    map_from_file = np.array(values["map_from_file"])
    assert map_from_file[:3, :3] @ [0.0, 1000.0, 0.0] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("up", ["-y", "auto"])
def test_a_map_that_stands_on_its_head_is_turned(hall, tmp_path: Path, up: str) -> None:
    points, flight = hall
    y_down = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    write_binary_ply(tmp_path / "hall.ply", y_down, order="<")

    outcome = stairmap("scan", tmp_path / "hall.ply", "-o", tmp_path / "run", "--json", f"--up={up}")

    values = json.loads(outcome.stdout)
    if up == "-y":
        check_flight(values["stairways"][0]["flights"][0], flight, flight.base)
    else:
        # Nothing tells floor from ceiling here; that the axis is y is found out, and said.
        assert "y axis is z" in outcome.stderr


def test_a_map_that_leans_is_measured_along_its_own_up(hall, tmp_path: Path) -> None:
    points, flight = hall
    lean = np.radians(3.0)
    turn = np.array([[np.cos(lean), 0, np.sin(lean)], [0, 1, 0], [-np.sin(lean), 0, np.cos(lean)]])
    write_binary_pcd(tmp_path / "hall.pcd", points @ turn.T)

    values = scanned(tmp_path / "hall.pcd", tmp_path / "run")

    found = values["stairways"][0]["flights"][0]
    assert found["rise"] == pytest.approx(flight.rise, abs=0.003)
    assert values["up"] == pytest.approx((turn @ [0, 0, 1]).tolist(), abs=0.003)
    assert any(re.search(r"leans by (2\.9|3\.[01]) deg", note) for note in values["problems"])


def test_several_files_are_one_map(hall, tmp_path: Path) -> None:
    points, flight = hall
    half = points[:, 2] < flight.base[2] + 0.5 * flight.rise * flight.num_risers
    write_binary_pcd(tmp_path / "low.pcd", points[half])
    write_xyz(tmp_path / "high.xyz", points[~half])

    outcome = stairmap(
        "scan", tmp_path / "low.pcd", tmp_path / "high.xyz", "-o", tmp_path / "run", "--json", "--no-report"
    )

    check_flight(json.loads(outcome.stdout)["stairways"][0]["flights"][0], flight, flight.base)


def test_a_map_without_stairs_says_why(tmp_path: Path) -> None:
    points, _ = sampled_scene("ramp", density=300.0)
    write_binary_pcd(tmp_path / "ramp.pcd", points)

    outcome = stairmap("scan", tmp_path / "ramp.pcd", "-o", tmp_path / "run", "--no-report")

    assert outcome.code == 0
    assert "no stairway was found" in outcome.stdout
    assert "candidate" in outcome.stdout or "nowhere in the map" in outcome.stdout


def test_points_without_coordinates_are_counted(hall, tmp_path: Path) -> None:
    points = np.concatenate([hall[0], np.full((50, 3), np.nan)])
    write_binary_pcd(tmp_path / "hall.pcd", points)

    values = scanned(tmp_path / "hall.pcd", tmp_path / "run")

    assert values["num_invalid"] == 50
    assert "50 points have no coordinates and were left out" in values["problems"]
    assert len(values["stairways"]) == 1


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (POINTS[:10], ("expected at least 100 points with coordinates in map.pcd, got 10",)),
        (np.full((200, 3), np.nan), ("expected at least 100 points with coordinates in map.pcd, got 0",)),
    ],
)
def test_too_few_points_are_refused(tmp_path: Path, points: np.ndarray, words: tuple[str, ...]) -> None:
    write_ascii_pcd(tmp_path / "map.pcd", points)

    check_refused(stairmap("scan", tmp_path / "map.pcd", "-o", tmp_path / "run"), *words)


def test_equal_points_are_a_map_without_stairs(tmp_path: Path) -> None:
    write_ascii_pcd(tmp_path / "map.pcd", np.ones((300, 3)))

    outcome = stairmap("scan", tmp_path / "map.pcd", "-o", tmp_path / "run")

    assert outcome.code == 0
    assert "no stairway was found" in outcome.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--up", "sideways"), ("expected --up to be one of", "'sideways'")),
        (("--unit", "furlong"), ("expected --unit to be one of m, cm, mm, ft, in", "'furlong'")),
    ],
)
def test_unknown_axes_and_units_are_refused(
    tmp_path: Path, options: tuple[str, str], words: tuple[str, ...]
) -> None:
    write_ascii_pcd(tmp_path / "map.pcd", POINTS)

    check_refused(stairmap("scan", tmp_path / "map.pcd", *options), *words)


def test_plan_cuts_the_floors_from_the_map(run: Path, hall, tmp_path: Path) -> None:
    flight = hall[1]
    x, y, _ = flight.base - 1.5 * flight.forward

    outcome = stairmap(
        "plan",
        run,
        "--robot",
        "spot",
        "--from",
        f"{x},{y},0",
        "--to",
        f"{x},{y + 1.2},0",
        "-o",
        tmp_path / "p",
    )

    assert outcome.code == 0, outcome
    assert "floor" in outcome.stdout
    assert (tmp_path / "p" / "floor_0.yaml").is_file()


def test_page_shows_the_map(run: Path, tmp_path: Path) -> None:
    outcome = stairmap("view", run, "--page", tmp_path / "hall.html")

    assert outcome.code == 0, outcome
    assert "points · positions in m" in (tmp_path / "hall.html").read_text()


def test_a_scan_is_shown_as_a_page_only(run: Path, tmp_path: Path) -> None:
    check_refused(stairmap("view", run, "--save", tmp_path / "run.rrd"), "pass --page FILE.html")


def test_a_map_that_went_away_is_told(run: Path, tmp_path: Path) -> None:
    moved = tmp_path / "run"
    moved.mkdir()
    for name in ("stairways.json", "scan.json"):
        (moved / name).write_text((run / name).read_text().replace("hall.pcd", "gone.pcd"))

    check_refused(stairmap("view", moved, "--page", tmp_path / "x.html"), "gone.pcd", "scan it again")


def test_clean_puts_exact_steps_into_the_map(run: Path, hall, tmp_path: Path) -> None:
    points, flight = hall
    source = run.parent / "hall.pcd"

    outcome = stairmap("clean", source, "--run", run, "-o", tmp_path / "clean.ply")
    again = stairmap("clean", source, "-o", tmp_path / "clean.pcd")

    assert outcome.code == again.code == 0, (outcome, again)
    values = scanned(tmp_path / "clean.ply", tmp_path / "second")
    check_flight(values["stairways"][0]["flights"][0], flight, flight.base)
    assert values["num_points"] != len(points)


@pytest.mark.parametrize("name", ["clean.las", "taken.ply"])
def test_clean_refuses_other_kinds_and_files_that_are_there(run: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "taken.ply").write_text("mine")

    outcome = stairmap("clean", run.parent / "hall.pcd", "--run", run, "-o", tmp_path / name)

    check_refused(outcome, name)
    assert (tmp_path / "taken.ply").read_text() == "mine"

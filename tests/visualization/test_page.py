"""The page that opens anywhere."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest

from stairmap.errors import OutputError
from stairmap.export.loading import ResultsError
from stairmap.visualization.page import MAX_MAP_POINTS, PageFile
from stairmap.visualization.run_replay import load_run, show_run

CHROMIUM = Path("/usr/bin/chromium")


def write_page(run, path, **options):
    replay = load_run(run)
    page = PageFile(path, name=options.get("name", "run"), frame_id="map", positions=replay.positions)
    show_run(replay, [page])
    return path.read_text(encoding="utf-8")


def scene_of(text):
    return json.loads(
        re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1]
    )


@pytest.fixture(scope="module")
def page(run_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "run.html"
    write_page(run_folder, path)
    return path


def test_page_loads_nothing_from_elsewhere(page):
    text = page.read_text()
    assert not re.search(r"(?:src|href)\s*=", text)
    assert not re.search(r"https?://|@import|url\(|fetch\(|import\s*\(", text)
    assert "<!--" not in text


def test_cloud_of_the_page_lies_on_the_recorded_scene(page, run_folder):
    cloud = scene_of(page.read_text())["cloud"]
    steps = np.frombuffer(base64.b64decode(cloud["positions"]), "<u2").reshape(-1, 3)
    assert 1000 < len(steps) <= MAX_MAP_POINTS
    points = np.array(cloud["low"]) + steps / 65535 * np.array(cloud["size"])
    view = next(load_run(run_folder).frames())
    seen = (
        view.camera_points(max_points=40_000) @ view.map_from_camera[:3, :3].T + view.map_from_camera[:3, 3]
    )
    extent = np.ptp(points, axis=0)
    assert (extent >= np.ptp(seen, axis=0) - 0.05).all()


def test_steps_of_the_page_have_the_dimensions_of_the_result(page, run_folder):
    scene = scene_of(page.read_text())
    steps = next(layer for layer in scene["layers"] if layer["name"] == "steps")
    points = np.frombuffer(base64.b64decode(steps["meshes"][0]["positions"]), "<f4").reshape(-1, 3)
    flight = load_run(run_folder).stairways[0].flights[0]
    assert np.ptp(points[:, 2]) == pytest.approx(flight.num_risers * flight.rise, abs=1e-4)


def test_table_and_label_tell_the_measures_with_units(page, run_folder):
    text = page.read_text()
    flight = load_run(run_folder).stairways[0].flights[0]
    assert f"<td>{flight.rise * 1e3:.0f} ± " in text
    assert "<th>rise mm</th>" in text
    (label,) = scene_of(text)["labels"]
    assert label["lines"][0] == "stairway 1"
    assert any(line.startswith(f"rise {flight.rise * 1e3:.0f} ±") for line in label["lines"])


def test_run_without_a_stairway_says_so_with_the_rules_against(empty_run_folder, tmp_path):
    text = write_page(empty_run_folder, tmp_path / "page.html")
    assert "No stairway was found. Rules against stairs: " in text
    assert "in 3 frames" in text
    assert scene_of(text)["labels"] == []


def test_name_of_a_run_cannot_break_the_page(run_folder, tmp_path):
    text = write_page(run_folder, tmp_path / "page.html", name="</script><b>&<!--SCENE-->")
    assert "<b>&" not in text
    assert "&lt;/script&gt;&lt;b&gt;" in text
    assert scene_of(text)["floor"] < 1


def test_page_of_frames_without_poses_is_refused(tmp_path):
    with pytest.raises(ResultsError, match="no poses"):
        PageFile(tmp_path / "page.html", name="run", frame_id="map", positions=np.empty((0, 3)))


def test_page_that_cannot_be_written_is_an_error(run_folder, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        write_page(run_folder, tmp_path / "file" / "page.html")


def test_browser_draws_the_page_offline(page, tmp_path):
    sync_api = pytest.importorskip("playwright.sync_api")
    if not CHROMIUM.exists():
        pytest.skip(f"no {CHROMIUM}")
    arguments = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=arguments)
        tab = browser.new_context(viewport={"width": 800, "height": 600}, offline=True).new_page()
        faults, requests = [], []
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.on("request", lambda request: requests.append(request.url))
        tab.goto(page.as_uri())
        tab.wait_for_selector(".label")
        assert "rise" in tab.inner_text(".label")
        assert tab.locator(".failure").count() == 0
        names = tab.locator("#layers").inner_text().split("\n")
        before = tab.locator("canvas").screenshot()
        tab.get_by_label("steps").uncheck()
        tab.wait_for_timeout(300)
        assert tab.locator("canvas").screenshot() != before
        browser.close()
    assert faults == []
    assert requests == [page.as_uri()]
    assert {"cloud", "steps", "nosings", "labels"} <= {name.strip() for name in names}

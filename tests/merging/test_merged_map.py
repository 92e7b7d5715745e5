from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from site_runs import as_input, cut_flight, level_transform, make_flight, see

from command_line import check_refused, stairmap
from stairmap.errors import MergeError
from stairmap.export.loading import load_stairways
from stairmap.export.results import create_run_folder
from stairmap.merging.alignment import SiteAlignment
from stairmap.merging.merged_flight import merge_flights, moved_flight
from stairmap.merging.merged_map import merge_runs
from stairmap.stairway import Stairway, Step

SITE = [
    make_flight((0, 0, 0), 0.3, rise=0.165, run=0.290),
    make_flight((12, 4, 0), 2.1, rise=0.180, run=0.270, num_risers=8),
    make_flight((-6, 15, 2.8), -1.0, rise=0.150, run=0.310, num_risers=12),
]
POSES = (np.eye(4), level_transform(5, 1, 0.5, 1.0), level_transform(-3, 8, 2, -2.0))


def test_stairways_of_three_runs_become_those_of_the_site():
    inputs = [
        see(SITE[:2], POSES[0], seed=1, name="a"),
        see(SITE[1:], POSES[1], seed=2, name="b"),
        see(SITE, POSES[2], seed=3, name="c"),
    ]
    merged = merge_runs(inputs, SiteAlignment(site_from_run=POSES))
    assert [stairway.id for stairway in merged.stairways] == [1, 2, 3]
    for stairway, true, runs in zip(merged.stairways, SITE, ("ac", "abc", "bc"), strict=True):
        flight = stairway.flights[0]
        assert np.linalg.norm(flight.base - true.base) < 0.06
        assert flight.rise == pytest.approx(true.rise, abs=0.002) and flight.num_risers == true.num_risers
        assert flight.std.rise == pytest.approx(0.001 / len(runs) ** 0.5, rel=1e-6)
        assert stairway.num_observations == 5 * len(runs)
        assert [source.run for source in merged.sources[stairway.id]] == [f"/{name}" for name in runs]
    assert merged.stairways[0].first_seen_ns == 100 and merged.stairways[0].last_seen_ns == 301


def test_ids_of_the_first_run_stay_and_new_ones_follow():
    first = see(SITE[:2], POSES[0], seed=1, name="a")
    renumbered = as_input([replace(item, id=item.id + 40) for item in first.stairways], "a")
    merged = merge_runs(
        [renumbered, see(SITE, POSES[1], seed=2, name="b")], SiteAlignment(site_from_run=POSES[:2])
    )
    assert [stairway.id for stairway in merged.stairways] == [41, 42, 43]
    assert merged.stairways[2].flights[0].rise == pytest.approx(0.15, abs=0.003)


def test_run_that_is_there_twice_is_refused():
    run = see(SITE, POSES[0], seed=1, name="a")
    with pytest.raises(MergeError, match="is in a and in b; leave one of them out"):
        merge_runs([run, replace(run, name="b")], SiteAlignment(site_from_run=POSES[:2]))


def test_stairway_seen_in_two_halves_is_one_from_the_bottom_to_the_top():
    whole = make_flight(num_risers=10)
    below, above = cut_flight(whole, 0, 6), cut_flight(whole, 4, 10)
    flight = merge_flights([above, below], [0, -4])
    assert flight.num_risers == 10 and flight.bottom_seen and flight.top_seen
    assert np.allclose(flight.base, whole.base)
    assert flight.rise == pytest.approx(0.17)


def test_surer_measure_weighs_more_and_unknown_ends_stay_unknown():
    sure = make_flight(rise=0.170, bottom_seen=None, top_seen=False)
    unsure = make_flight(rise=0.180, bottom_seen=None, top_seen=None, std=replace(sure.std, rise=0.003))
    flight = merge_flights([sure, unsure], [0, 0])
    assert flight.rise == pytest.approx(0.171)
    assert flight.bottom_seen is None and flight.top_seen is False


def test_width_comes_from_runs_that_saw_both_ends():
    seen = make_flight(width=1.2)
    cut = make_flight(width=0.8, left_bounded=False)
    assert merge_flights([cut, seen], [0, 0]).width == pytest.approx(1.2)
    wider = make_flight(width=0.9, right_bounded=False)
    flight = merge_flights([cut, wider], [0, 0])
    assert flight.width == 0.9 and (flight.left_bounded, flight.right_bounded) == (True, False)


def test_steps_keep_the_views_of_all_runs():
    nosing = np.array([[0, 0.6, 0.17], [0, -0.6, 0.17]])
    first = make_flight(steps=tuple(Step(nosing=nosing + number, num_observations=3) for number in range(3)))
    second = make_flight(steps=tuple(Step(nosing=nosing - number, num_observations=7) for number in range(2)))
    flight = merge_flights([first, second], [0, 1])
    assert [step.num_observations for step in flight.steps] == [3, 10, 10]
    assert np.allclose(flight.steps[2].nosing, nosing - 1)


def test_moving_a_flight_moves_its_place_heading_and_steps():
    flight = make_flight((1, 0, 0), steps=(Step(nosing=np.zeros((2, 3)), num_observations=1),))
    moved = moved_flight(flight, level_transform(0, 0, 2, np.pi / 2))
    assert np.allclose(moved.base, [0, 1, 2]) and moved.heading == pytest.approx(np.pi / 2)
    assert np.allclose(moved.steps[0].nosing, [0, 0, 2])


def write_run(folder, given):
    with create_run_folder(folder, "run") as run:
        run.write_stairways(given.stairways, num_frames=given.num_frames)
    return folder


def test_command_merges_and_merges_again_into_what_it_made(tmp_path):
    first = write_run(tmp_path / "a", see(SITE[:2], POSES[0], seed=1))
    second = write_run(tmp_path / "b", see(SITE[1:], POSES[1], seed=2))
    outcome = stairmap("merge", first, second, "-o", tmp_path / "site")
    assert outcome.code == 0, outcome.stderr
    assert "joined by one flight alone" in outcome.stderr
    assert "2 runs, 3 stairways in the site" in outcome.stdout and outcome.last_line == str(tmp_path / "site")
    third = write_run(tmp_path / "c", see(SITE, POSES[2], seed=3))
    again = stairmap("merge", tmp_path / "site", third, "-o", tmp_path / "site2", "--json")
    assert again.code == 0 and again.stderr == ""
    values = json.loads(again.stdout)
    assert [item["id"] for item in values["stairways"]] == [1, 2, 3]
    assert [len(item["observed_by"]) for item in values["stairways"]] == [2, 3, 2]
    site = load_stairways(tmp_path / "site2")
    assert site.num_frames == 30 and [item.num_observations for item in site.stairways] == [10, 15, 10]
    assert stairmap("check", tmp_path / "site2", "--robot", "spot").code == 0
    given = stairmap(
        "merge",
        tmp_path / "site",
        third,
        "-o",
        tmp_path / "site3",
        "--alignment",
        tmp_path / "site2" / "alignment.yaml",
    )
    assert given.code == 0
    for one, other in zip(site.stairways, load_stairways(tmp_path / "site3").stairways, strict=True):
        assert np.allclose(one.flights[0].base, other.flights[0].base, atol=2e-3)


def test_command_refuses_in_one_line(tmp_path):
    first = write_run(tmp_path / "a", see(SITE[:1], POSES[0], seed=1))
    second = write_run(tmp_path / "b", see(SITE[1:2], POSES[1], seed=2))
    other = write_run(tmp_path / "x" / "a", see(SITE[1:2], POSES[1], seed=2))
    check_refused(stairmap("merge", first, second, "-o", tmp_path / "o"), "no stairway joins b with a")
    check_refused(stairmap("merge", first, other, "-o", tmp_path / "o"), "two runs are called a")
    check_refused(stairmap("merge", first, tmp_path / "none", "-o", tmp_path / "o"), "none")
    check_refused(
        stairmap("merge", first, second, "-o", tmp_path / "o", "--alignment", tmp_path / "no.yaml"), "no.yaml"
    )
    assert not (tmp_path / "o").exists()


def test_flights_of_one_stairway_stay_together_when_runs_saw_different_ones():
    lower, upper = make_flight((0, 0, 0)), make_flight((4, 0, 1.7), 0.0, rise=0.171)
    both = Stairway(id=1, flights=(lower, upper), num_observations=9, first_seen_ns=0, last_seen_ns=1)
    one = Stairway(id=1, flights=(upper,), num_observations=4, first_seen_ns=5, last_seen_ns=6)
    merged = merge_runs(
        [as_input([one], "a"), as_input([both], "b")], SiteAlignment(site_from_run=(np.eye(4), np.eye(4)))
    )
    (stairway,) = merged.stairways
    assert len(stairway.flights) == 2 and len(stairway.landings) == 1 and stairway.num_observations == 13

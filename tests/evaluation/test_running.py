"""A trial that fails, or kills its process, is a row; the others go on."""

from __future__ import annotations

import os
from typing import Any

from stairmap.evaluation.running import TrialSettings, run_trials
from stairmap.evaluation.trials import TrialResult, TrialSpec

SETTINGS = TrialSettings(methods=("stairmap", "delmerico2013"))


def make_spec(scene: str, seed: int) -> TrialSpec:
    return TrialSpec(suite="table1", scene=scene, sensor="kinect_v1", robot="spot", seed=seed)


def pretend(spec: TrialSpec, methods: tuple[str, ...], **_: Any) -> tuple[TrialResult, ...]:
    """Do as the scene's name says."""
    if spec.scene == "raise":
        raise ValueError("this trial raises")
    if spec.scene == "die":
        os._exit(3)
    return tuple(TrialResult(spec=spec, method=method, num_frames=spec.seed) for method in methods)


def test_results_come_in_the_order_of_the_specs_and_crashes_are_rows() -> None:
    names = ["fine", "raise", "fine", "die", "fine", "fine"]
    specs = [make_spec(name, seed) for seed, name in enumerate(names)]
    heard: list[int] = []
    results = run_trials(
        specs, SETTINGS, num_workers=2, trial=pretend,
        on_results=lambda found: heard.append(found[0].spec.seed),
    )  # fmt: skip
    assert [result.spec.seed for result in results[::2]] == list(range(6))
    assert [result.method for result in results[:2]] == ["stairmap", "delmerico2013"]
    crashes = {result.spec.seed: result.crash for result in results if result.crash is not None}
    assert set(crashes) == {1, 3}
    assert "ValueError: this trial raises" in str(crashes[1])
    assert crashes[3] == "its process died"
    assert sorted(heard) == list(range(6))


def test_no_trials_are_no_results() -> None:
    assert run_trials([], SETTINGS, num_workers=2, trial=pretend) == ()

"""The goals of the default method, and whether they are reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.evaluation.real import RealResult
from stairmap.evaluation.summary import Summary, group_results, summarize
from stairmap.evaluation.trials import TrialResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What a method should reach: a text, what was measured, and whether that is enough."""

    text: str
    measured: str
    is_met: bool

    def cells(self) -> list[str]:
        """Return the line of the table."""
        return [self.text, self.measured, "yes" if self.is_met else "**no**"]


def find_goals(results: Sequence[TrialResult], real: Sequence[RealResult]) -> list[Goal]:
    """Return the goals of the default method with what was measured."""
    s = summarize(results)
    by_sensor = summarize_by(results, sensor_of)
    negatives = [result for result in real if result.truth is None and result.method == "stairmap"]
    false_real = sum(result.num_stairways or 0 for result in negatives)
    num_false = s.num_false_frames + sum(result.num_false_frames for result in negatives)
    share = num_false / (s.num_frames + sum(result.num_frames for result in negatives))
    goals = [
        Goal(
            text="every flight found that had to be",
            measured=f"{s.num_found} of {s.num_required}",
            is_met=s.num_missed == 0,
        ),
        Goal(
            text="no false stairway",
            measured=str(s.num_false + false_real),
            is_met=s.num_false + false_real == 0,
        ),
        Goal(
            text="false detections in < 0.5 % of frames",
            measured=f"{100 * share:.2f} %",
            is_met=share < 0.005,
        ),
    ]
    for name in ("rise", "run"):
        errors = s.errors[name]
        goals.append(
            Goal(
                text=f"{name}: mean absolute error ≤ 2 mm, worst ≤ 6 mm",
                measured=f"{1e3 * errors.mean_abs:.1f} mm, {1e3 * errors.worst:.1f} mm",
                is_met=errors.mean_abs <= 0.002 and errors.worst <= 0.006,
            )
        )
        biases = {sensor: group.errors[name].bias for sensor, group in by_sensor.items()}
        worst = max(biases, key=lambda sensor: abs(np.nan_to_num(biases[sensor])))
        goals.append(
            Goal(
                text=f"{name}: bias below 1 mm with every sensor",
                measured=f"largest {1e3 * biases[worst]:+.1f} mm ({worst})",
                is_met=abs(biases[worst]) < 0.001,
            )
        )
    goals += [
        _mean_goal(s, "width", 0.020, "mm"),
        _mean_goal(s, "pitch", float(np.radians(0.3)), "°"),
        _mean_goal(s, "heading", float(np.radians(1.0)), "°"),
        _mean_goal(s, "place", 0.030, "mm"),
        _mean_goal(s, "up", 0.030, "mm"),
    ]
    steps = s.num_steps_right / max(s.num_steps_judged, 1)
    within_1, within_2 = s.errors["all"].share_within_1, s.errors["all"].share_within_2
    goals += [
        Goal(
            text="steps in view counted right in ≥ 95 %",
            measured=f"{100 * steps:.0f} %",
            is_met=steps >= 0.95,
        ),
        Goal(
            text="60 to 76 % of errors within 1σ, ≥ 93 % within 2σ",
            measured=f"{100 * within_1:.0f} %, {100 * within_2:.0f} %",
            is_met=0.60 <= within_1 <= 0.76 and within_2 >= 0.93,
        ),
    ]
    return [*goals, *_verdict_goals(s)]


def sensor_of(result: TrialResult) -> str:
    """Return the sensor with its width."""
    return f"{result.spec.sensor} {result.spec.width or 'full'}"


def summarize_by(results: Sequence[TrialResult], key: Callable[[TrialResult], str]) -> dict[str, Summary]:
    """Return the sums of groups of results."""
    return {name: summarize(some) for name, some in group_results(results, key).items()}


def _verdict_goals(s: Summary) -> list[Goal]:
    v = s.verdicts
    num_clear, num_near = v.right + v.unknown + v.wrong, v.near_right + v.near_unknown + v.near_wrong
    share = v.right / max(num_clear, 1)
    return [
        Goal(
            text="verdicts farther than 2σ from a limit right in ≥ 99 %",
            measured=f"{v.right} of {num_clear} ({100 * share:.1f} %)",
            is_met=share >= 0.99,
        ),
        Goal(
            text="verdicts within 2σ of a limit unknown, not wrong",
            measured=f"{v.near_unknown} of {num_near} unknown, {v.near_wrong} wrong",
            is_met=v.near_wrong == 0,
        ),
        Goal(
            text="no impassable flight called passable",
            measured=str(v.num_dangerous),
            is_met=v.num_dangerous == 0,
        ),
    ]


def _mean_goal(s: Summary, name: str, limit: float, unit: str) -> Goal:
    factor = 1e3 if unit == "mm" else float(np.degrees(1))
    value = s.errors[name].mean_abs
    return Goal(
        text=f"{name}: mean absolute error ≤ {factor * limit:.1f} {unit}",
        measured=f"{factor * value:.2f} {unit}",
        is_met=value <= limit,
    )

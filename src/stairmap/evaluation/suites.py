"""The suites of trials, and how sensors and robots are shared out among their scenes.

A full cross product of scenes, sensors and robots would take a day. Instead each scene is driven a
few times, and sensors and robots are dealt out in turn: as there are six sensor settings and five robots,
thirty trials in a row show every pair once. Another seed begins elsewhere in the deal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stairmap.errors import StairmapError
from stairmap.evaluation.trials import TrialSpec
from stairmap.simulation.meshes import load_building_scenes
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import SCENE_GROUPS

SENSOR_SETTINGS: tuple[tuple[str, int | None], ...] = (
    ("kinect_v1", 320),
    ("d435", None),
    ("kinect_v2", None),
    ("phone_lidar", None),
    ("kinect_v1", None),
    ("d435", 320),
)
"""Sensors and the width at which they are read out, px (``None``: full). The ideal sensor is in no
suite: nobody has one, and it would flatter the means."""

SIMULATED_SUITES = ("table1", "stairs", "buildings", "look-alikes", "kind-drives")
"""Names of the simulated suites; ``real`` has no simulation. A suite's place begins its deal: new ones go
to the end."""

NUM_DRIVES = {"table1": 6, "stairs": 3, "buildings": 2, "look-alikes": 3, "kind-drives": 2}
"""Drives per scene."""

NUM_RANDOM_DRIVES = 12
"""Drives of the scene that draws a new flight each time."""

QUICK_FRAMES = 45
QUICK_WIDTH = 320


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialChoice:
    """What of a suite to run; ``None`` leaves it as it is.

    Attributes
    ----------
    only
        Keep scenes whose name holds one of these words.
    sensor, width, robot
        Use these in every trial.
    seed
        Seed of the first drive of each scene; the following count up from it.
    num_drives
        Drives per scene.
    is_quick
        One drive per scene, few frames of 320 px: for a first look and for CI.
    """

    only: tuple[str, ...] = ()
    sensor: str | None = None
    width: int | None = None
    robot: str | None = None
    seed: int = 0
    num_drives: int | None = None
    is_quick: bool = False


def make_specs(suite: str, choice: TrialChoice, *, buildings: Path | None = None) -> tuple[TrialSpec, ...]:
    """Return the trials of a simulated suite, none if no scene has such a name.

    Raises
    ------
    ValueError
        If there is no such suite.
    StairmapError
        If the suite needs the buildings and they are not there.
    """
    if suite not in SIMULATED_SUITES:
        raise ValueError(f"unknown suite {suite!r}; choose one of: {', '.join(SIMULATED_SUITES)}, real")
    names = _building_names(buildings) if suite == "buildings" else list(SCENE_GROUPS[suite])
    specs, turn = [], 7 * SIMULATED_SUITES.index(suite) + choice.seed
    for name in names:
        for drive in range(_num_drives(suite, name, choice)):
            specs.append(_make_spec(suite, name, turn, drive, choice))
            turn += 1
    # Chosen last, so that a trial that is run alone has the sensor, robot and seed that it has in the suite.
    return tuple(spec for spec in specs if not choice.only or any(word in spec.scene for word in choice.only))


def _make_spec(suite: str, name: str, turn: int, drive: int, choice: TrialChoice) -> TrialSpec:
    sensor, width = SENSOR_SETTINGS[turn % len(SENSOR_SETTINGS)]
    robots = list(ROBOTS)
    if choice.sensor is not None:
        sensor, width = choice.sensor, None
    if choice.is_quick:
        # The phone's own image is smaller than that.
        width = None if sensor == "phone_lidar" else QUICK_WIDTH
    if choice.width is not None:
        width = choice.width
    return TrialSpec(
        suite=suite,
        scene=name,
        sensor=sensor,
        width=width,
        robot=choice.robot or robots[turn % len(robots)],
        seed=choice.seed + drive,
        num_frames=QUICK_FRAMES if choice.is_quick else None,
    )


def _num_drives(suite: str, name: str, choice: TrialChoice) -> int:
    if choice.num_drives is not None:
        return choice.num_drives
    if choice.is_quick:
        return 1
    return NUM_RANDOM_DRIVES if name == "random" else NUM_DRIVES[suite]


def _building_names(buildings: Path | None) -> Sequence[str]:
    if buildings is None or not buildings.is_dir():
        raise StairmapError(
            "suite buildings needs measured meshes of buildings, which are no part of stairmap: a folder "
            "'buildings' with NAME/mesh.ply and NAME/stairs.json; docs/evaluation.md says where they may "
            "come from; pass --data DIR"
        )
    folders = sorted(path for path in buildings.iterdir() if (path / "stairs.json").exists())
    return [scene.name for folder in folders for scene in load_building_scenes(folder)]

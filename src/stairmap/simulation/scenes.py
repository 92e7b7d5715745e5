"""Every simulated scene by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stairmap.simulation.flight_scenes import FLIGHT_SCENES, TABLE_1, SceneMaker
from stairmap.simulation.kind_drives import KIND_SCENES
from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.meshes import load_building_scenes
from stairmap.simulation.more_look_alikes import MORE_LOOK_ALIKES
from stairmap.simulation.scene import Scene
from stairmap.simulation.stairway_scenes import STAIRWAY_SCENES

SCENES: dict[str, SceneMaker] = {
    **FLIGHT_SCENES, **STAIRWAY_SCENES, **LOOK_ALIKES, **KIND_SCENES, **MORE_LOOK_ALIKES,
}  # fmt: skip
"""Scene makers by the name that ``stairmap simulate`` takes."""

SCENE_GROUPS: dict[str, tuple[str, ...]] = {
    "table1": tuple(TABLE_1),
    "stairs": tuple(name for name in (*FLIGHT_SCENES, *STAIRWAY_SCENES) if name not in TABLE_1),
    "look-alikes": tuple(LOOK_ALIKES),
    "kind-drives": (*KIND_SCENES, *MORE_LOOK_ALIKES),
}
"""Names of the scenes of each suite."""

BUILDING_PREFIX = "building:"


def make_scene(name: str, seed: int, *, buildings: Path | None = None) -> Scene:
    """Return a scene; the same name and seed give the same scene, bit for bit.

    Parameters
    ----------
    name
        A key of ``SCENES``, or ``building:NAME/FLIGHT`` for the drive to flight number FLIGHT
        (from 1) of a building; ``building:NAME`` is its first.
    seed
        Seed of whatever the scene draws.
    buildings
        Folder with one folder per building, each with ``mesh.ply`` and ``stairs.json``.

    Raises
    ------
    ValueError
        If there is no such scene, or a building was asked for without its folder.
    RecordingError
        If the building's files cannot be read.
    """
    if name.startswith(BUILDING_PREFIX):
        return _make_building_scene(name, buildings)
    if name not in SCENES:
        raise ValueError(
            f"unknown scene {name!r}; choose one of: {', '.join(sorted(SCENES))}, or building:NAME/FLIGHT"
        )
    return SCENES[name](name, np.random.default_rng([seed, 1]))


def _make_building_scene(name: str, buildings: Path | None) -> Scene:
    if buildings is None:
        raise ValueError(f"scene {name!r} needs the folder that holds the buildings")
    building, _, number = name.removeprefix(BUILDING_PREFIX).partition("/")
    scenes = load_building_scenes(buildings / building)
    if number and not (number.isdecimal() and 1 <= int(number) <= len(scenes)):
        raise ValueError(f"scene {name!r}: flights of {building} are numbered 1 to {len(scenes)}")
    return scenes[int(number) - 1 if number else 0]

"""Every simulated scene by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stairmap.simulation.flight_scenes import FLIGHT_SCENES, TABLE_1, SceneMaker
from stairmap.simulation.kind_drives import KIND_SCENES
from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.meshes import load_building_scenes, load_ply
from stairmap.simulation.more_look_alikes import MORE_LOOK_ALIKES
from stairmap.simulation.scene import Scene
from stairmap.simulation.stairway_scenes import STAIRWAY_SCENES
from stairmap.simulation.storeys import STOREY_SCENES
from stairmap.simulation.triangle_mesh import TriangleMesh

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


def load_world(name: str, seed: int, *, buildings: Path | None = None) -> TriangleMesh:
    """Return all surfaces of a scene, or of a building: of that only ``mesh.ply`` is needed.

    Raises
    ------
    ValueError
        If there is no such scene, or a building was asked for without its folder.
    RecordingError
        If the building's mesh cannot be read.
    """
    if name in STOREY_SCENES:
        return STOREY_SCENES[name](name, np.random.default_rng([seed, 1])).mesh
    if not name.startswith(BUILDING_PREFIX):
        if name not in SCENES:
            raise ValueError(
                f"unknown world {name!r}; choose one of: {', '.join(STOREY_SCENES)}, any scene of "
                "'stairmap simulate --list', or building:NAME"
            )
        return make_scene(name, seed).mesh
    if buildings is None:
        raise ValueError(f"{name!r} needs the folder that holds the buildings: --buildings DIR")
    building = name.removeprefix(BUILDING_PREFIX).partition("/")[0]
    return load_ply(buildings / building / "mesh.ply")


def _make_building_scene(name: str, buildings: Path | None) -> Scene:
    if buildings is None:
        raise ValueError(f"scene {name!r} needs the folder that holds the buildings")
    building, _, number = name.removeprefix(BUILDING_PREFIX).partition("/")
    scenes = load_building_scenes(buildings / building)
    if number and not (number.isdecimal() and 1 <= int(number) <= len(scenes)):
        raise ValueError(f"scene {name!r}: flights of {building} are numbered 1 to {len(scenes)}")
    return scenes[int(number) - 1 if number else 0]

"""Scenes to drive through of the kinds that a map is made of too, one feature each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.simulation.flight_scenes import SceneMaker
from stairmap.simulation.kind_scenes import make_ascending_scene, make_descending_scene, make_sloping_scene
from stairmap.simulation.scene import Scene
from stairmap.simulation.stair_shapes import FlightShape

_USUAL = FlightShape(rise=0.17, run=0.29, width=1.3, num_risers=8)


def _overhang_thin(name: str, random: np.random.Generator) -> Scene:
    """Treads 30 mm thick that overhang by 30 mm, as in a real building."""
    return make_ascending_scene(name, replace(_USUAL, overhang=0.030, lip=0.030), random)


def _overhang_wide(name: str, random: np.random.Generator) -> Scene:
    """Treads 45 mm thick that overhang by 45 mm, more than any code allows."""
    return make_ascending_scene(name, replace(_USUAL, overhang=0.045, lip=0.045), random)


def _sloping_ground(name: str, random: np.random.Generator) -> Scene:
    """Floor and treads fall by 3 % towards the front."""
    return make_sloping_scene(name, _USUAL, random, along=0.03, across=0.0)


def _sloping_aside(name: str, random: np.random.Generator) -> Scene:
    """Floor and treads fall by 3 % to the right."""
    return make_sloping_scene(name, _USUAL, random, along=0.0, across=0.03)


def _falling_treads(name: str, random: np.random.Generator) -> Scene:
    """Treads fall by 2 % towards the front on a level floor."""
    return make_ascending_scene(name, replace(_USUAL, tread_slope=0.02), random)


def _terrace_down(name: str, random: np.random.Generator) -> Scene:
    """Six steps from a terrace down to open ground."""
    return make_descending_scene(name, replace(_USUAL, num_risers=6), random, is_walled=False)


def _few_down(name: str, random: np.random.Generator) -> Scene:
    """Four steps down between walls."""
    return make_descending_scene(name, replace(_USUAL, num_risers=4), random)


def _wide_steps(name: str, random: np.random.Generator) -> Scene:
    """Three risers 4 m wide on a flat floor, with nothing behind."""
    return make_ascending_scene(name, replace(_USUAL, num_risers=3, width=4.0), random, is_walled=False)


def _last_step_free(name: str, random: np.random.Generator) -> Scene:
    """Five steps up to a platform, with nothing behind its edge."""
    return make_ascending_scene(name, replace(_USUAL, num_risers=5), random, is_walled=False)


def _odd_riser(name: str, random: np.random.Generator) -> Scene:
    """Third riser 12 mm higher than the others."""
    return make_ascending_scene(name, replace(_USUAL, odd_risers=((2, 0.012),)), random)


KIND_SCENES: dict[str, SceneMaker] = {
    "overhang_thin": _overhang_thin,
    "overhang_wide": _overhang_wide,
    "sloping_ground": _sloping_ground,
    "sloping_aside": _sloping_aside,
    "falling_treads": _falling_treads,
    "terrace_down": _terrace_down,
    "few_down": _few_down,
    "wide_steps": _wide_steps,
    "last_step_free": _last_step_free,
    "odd_riser": _odd_riser,
}
"""Scene makers of this module by name."""

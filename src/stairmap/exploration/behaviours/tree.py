"""The tree: look around, decide, drive, and do what is to be done there; recover when that fails."""

from __future__ import annotations

import py_trees

from stairmap.exploration.behaviours.decide import Decide
from stairmap.exploration.behaviours.drive import Drive
from stairmap.exploration.behaviours.look_around import LookAround
from stairmap.exploration.behaviours.look_at_frontier import LookAtFrontier
from stairmap.exploration.behaviours.look_at_stairs import LookAtStairs
from stairmap.exploration.behaviours.recover import Recover
from stairmap.exploration.behaviours.use_stairs import UseStairs
from stairmap.exploration.mission import Mission


def make_mission_tree(mission: Mission) -> py_trees.behaviour.Behaviour:
    """Return the tree of a mission; each time it comes to its end it begins anew."""
    at_place = py_trees.composites.Selector(name="what is to be done there", memory=True)
    at_place.add_children([LookAtFrontier(mission), LookAtStairs(mission), UseStairs(mission)])
    task = py_trees.composites.Sequence(name="do the task", memory=True)
    task.add_children([Drive(mission), at_place])
    attempt = py_trees.composites.Selector(name="do it or recover", memory=True)
    attempt.add_children([task, Recover(mission)])
    root = py_trees.composites.Sequence(name="explore", memory=True)
    root.add_children([LookAround(mission), Decide(mission), attempt])
    return root

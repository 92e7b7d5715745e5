"""A flight of an exploring robot as the goal of ``stairmap_msgs/ClimbStairway``."""

from __future__ import annotations

from stairmap_msgs.action import ClimbStairway
from std_msgs.msg import Header

from stairmap.exploration.stair_links import UNEXPLORED, Link
from stairmap.modeling.landings import top_of
from stairmap_ros.messages import make_flight, point_from, pose_at


def make_climb_goal(link: Link, header: Header, *, is_up: bool) -> ClimbStairway.Goal:
    """Return the goal to use a flight upwards or downwards."""
    portal = link.portal
    near, far = (portal.lower, portal.upper) if is_up else (portal.upper, portal.lower)
    levels = (link.lower, link.upper) if is_up else (link.upper, link.lower)
    flights = link.stairway.flights
    number = next((n for n, flight in enumerate(flights) if flight is link.flight), 0)
    goal = ClimbStairway.Goal(
        header=header,
        stairway=link.stairway.id,
        direction=ClimbStairway.Goal.UP if is_up else ClimbStairway.Goal.DOWN,
        staging=pose_at(near.position, near.heading),
        end=pose_at(far.position, near.heading),
        flights=[make_flight(link.flight)],
        tops=[point_from(top_of(link.flight))],
        flight_numbers=[number],
        way=[point_from(point) for point in (portal.way if is_up else portal.way[::-1])],
    )
    unknown = ClimbStairway.Goal.LEVEL_UNKNOWN
    goal.level_from, goal.level_to = (unknown if level >= UNEXPLORED else level for level in levels)
    return goal

"""What planners need as messages: drops, floors, portals, keep-out masks, and points for obstacle layers."""

from __future__ import annotations

import array
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Pose, PoseArray
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from sensor_msgs.msg import PointCloud2, PointField
from stairmap_msgs import msg as stairmap_msgs
from std_msgs.msg import Header

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.export.verdicts import format_limit, format_measured
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.limits import LimitCheck
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import Portal, StagingPose
from stairmap_ros.messages import point_from, pose_at, time_from_ns

KEEPOUT_FILTER = 0
"""Type of a keep-out filter in ``nav2_msgs/CostmapFilterInfo``."""

VERDICTS = {
    "unknown": stairmap_msgs.Portal.UNKNOWN,
    "passable": stairmap_msgs.Portal.PASSABLE,
    "impassable": stairmap_msgs.Portal.IMPASSABLE,
}


def make_drop_array(drops: Sequence[Drop], header: Header) -> stairmap_msgs.DropArray:
    """Return all drops as one message."""
    return stairmap_msgs.DropArray(header=header, drops=[_make_drop(drop) for drop in drops])


def make_floor_array(
    floors: FloorStack | None, current: int | None, topics: Mapping[int, tuple[str, str]], header: Header
) -> stairmap_msgs.FloorArray:
    """Return all floors as one message.

    Parameters
    ----------
    floors
        What is known; ``None``: nothing.
    current
        Id of the floor that the robot is on.
    topics
        Topics of mask and filter info by the id of a floor.
    header
        Its header.
    """
    message = stairmap_msgs.FloorArray(header=header, camera_height=float("nan"))
    if floors is None:
        return message
    message.camera_height = float(floors.camera_height)
    message.floors = [_make_floor(floor, topics) for floor in floors.floors]
    message.has_current_floor = current is not None
    message.current_floor = 0 if current is None else current
    return message


def make_portal_array(
    portals: Sequence[Portal], floors: FloorStack | None, robot: str, header: Header
) -> stairmap_msgs.PortalArray:
    """Return all portals of a robot as one message."""
    ids = {} if floors is None else {floor.level: id_of(floor) for floor in floors.floors}
    return stairmap_msgs.PortalArray(
        header=header, robot=robot, portals=[_make_portal(portal, ids) for portal in portals]
    )


def make_staging_poses(portals: Sequence[Portal], header: Header) -> PoseArray:
    """Return the staging poses of all portals, lower and upper by turns."""
    poses = [_staging(pose) for portal in portals for pose in (portal.lower, portal.upper)]
    return PoseArray(header=header, poses=poses)


def make_mask(grid: OccupancyGrid, height: float, header: Header) -> OccupancyGridMessage:
    """Return a keep-out mask of a floor at a height, m: 100 is forbidden, -1 leaves a costmap as it is."""
    message = OccupancyGridMessage(header=header)
    rows, columns = grid.cells.shape
    message.info.map_load_time = header.stamp
    message.info.resolution = float(grid.resolution)
    message.info.width, message.info.height = columns, rows
    message.info.origin = pose_at(np.array([*grid.origin, height]), 0.0)
    message.data = array.array("b", np.ascontiguousarray(grid.cells, dtype=np.int8).tobytes())
    return message


def make_filter_info(mask_topic: str, header: Header) -> Any:
    """Return what names a mask to Nav2's costmap filters; ``None`` without nav2_msgs."""
    try:
        from nav2_msgs.msg import CostmapFilterInfo  # noqa: PLC0415
    except ImportError:
        return None
    return CostmapFilterInfo(
        header=header, type=KEEPOUT_FILTER, filter_mask_topic=mask_topic, base=0.0, multiplier=1.0
    )


def make_cloud(points: Points, header: Header) -> PointCloud2:
    """Return (N, 3) points, m, as a cloud of x, y, z."""
    fields = [
        PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
        for index, name in enumerate("xyz")
    ]
    values = np.ascontiguousarray(points, dtype=np.float32)
    return PointCloud2(
        header=header,
        height=1,
        width=len(values),
        fields=fields,
        point_step=12,
        row_step=12 * len(values),
        is_dense=True,
        data=array.array("B", values.tobytes()),
    )


def id_of(floor: Floor) -> int:
    """Return a floor's id, its level where it has none."""
    return floor.level if floor.id is None else floor.id


def _make_drop(drop: Drop) -> stairmap_msgs.Drop:
    left, right = drop.edge
    return stairmap_msgs.Drop(
        id=drop.id,
        left=point_from(left),
        right=point_from(right),
        depth=float("nan") if drop.depth is None else drop.depth,
        num_observations=drop.num_observations,
        first_seen=time_from_ns(drop.first_seen_ns),
        last_seen=time_from_ns(drop.last_seen_ns),
        stairway=drop.stairway_id or 0,
    )


def _make_floor(floor: Floor, topics: Mapping[int, tuple[str, str]]) -> stairmap_msgs.Floor:
    mask_topic, info_topic = topics.get(id_of(floor), ("", ""))
    return stairmap_msgs.Floor(
        id=id_of(floor),
        level=floor.level,
        height=float(floor.height),
        is_explored=floor.is_explored,
        is_open=floor.is_open,
        keepout_mask_topic=mask_topic,
        keepout_filter_info_topic=info_topic,
    )


def _make_portal(portal: Portal, ids: Mapping[int, int]) -> stairmap_msgs.Portal:
    low, high = portal.assessment.probability
    return stairmap_msgs.Portal(
        stairway=portal.stairway_id,
        lower_floor=ids[portal.lower_level],
        upper_floor=ids[portal.upper_level],
        leads_to_unexplored=portal.leads_to_unexplored,
        lower=_staging(portal.lower),
        upper=_staging(portal.upper),
        is_lower_open=portal.is_lower_open,
        is_upper_open=portal.is_upper_open,
        way=[point_from(point) for point in portal.way],
        length=float(portal.length),
        height=float(portal.height),
        cost_up=float(portal.cost_up),
        cost_down=float(portal.cost_down),
        verdict=VERDICTS[portal.verdict],
        probability=[float(low), float(high)],
        limiting=_describe_check(portal.assessment.limiting),
        notes=list(portal.notes),
    )


def _describe_check(check: LimitCheck) -> str:
    flight = f"flight {check.flight_number}"
    return f"{flight}: {check.limit.measure} {format_measured(check)}, limit {format_limit(check)}"


def _staging(pose: StagingPose) -> Pose:
    return pose_at(pose.position, pose.heading)

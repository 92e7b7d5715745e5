"""What the nodes are told by ROS parameters; ``parameter_files`` lists them for people. No ROS in here."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class InputConfig(BaseModel):
    """Depth images and their poses, as every node takes them."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    map_frame: str = Field("map", min_length=1)
    """Coordinate frame with z up in which stairways are placed; all results carry it. A map that SLAM
    keeps is best; odom does where there is none, with its drift."""
    camera_frame: str = ""
    """Optical coordinate frame of the depth camera; empty: the one that the image names."""
    reliability: Literal["best_effort", "reliable"] = "best_effort"
    """Reliability of the depth and camera_info subscriptions. best_effort takes what any publisher sends;
    reliable asks for lost images again, and gets nothing from a publisher that is best_effort."""
    depth_transport: Literal["raw", "compressedDepth"] = "raw"
    """Whether depth comes as Image on depth/image_rect_raw, or as CompressedImage on that topic's
    compressedDepth."""
    depth_unit: float = Field(0.001, ge=1e-5, le=0.1)
    """What one unit of a 16-bit depth image is, m: 0.001 by ROS's convention. A raw L515 has 0.00025. Not for
    32FC1, which is in metres."""
    max_transform_gap: float = Field(0.5, ge=0.01, le=10)
    """Transforms farther apart than this, s, are not interpolated, except of a frame that moves less than
    0.1 m and 2 deg within 2.5 s, as map -> odom does when it is corrected. Odometry of 5 Hz may lose a
    message."""
    max_transform_wait: float = Field(1.5, ge=0, le=10)
    """How long an image waits for the transform of its stamp, s; then it is dropped and counted. It must be
    longer than the period of the slowest transform, such as that of map -> odom."""
    max_silence: float = Field(5.0, gt=0, le=60)
    """After so long without an image and its camera_info, s, a warning names the silent topic."""


class NodeConfig(InputConfig):
    """What the map's node is told beside the configuration of the stages."""

    inputs: Literal["depth", "points", "both"] = "depth"
    """What is looked at: depth images, sweeps of a LiDAR on the topic points (PointCloud2), or both."""
    lidar_frame: str = ""
    """Coordinate frame of the LiDAR's points; empty: the one that the cloud names."""
    method: Literal["stairmap", "delmerico2013"] = "stairmap"
    """Method: stairmap, or the one of ARL-TR-6381."""
    views_per_place: int = Field(10, ge=1, le=1000)
    """How many images from one place (0.1 m, 10 deg) enter the map: a robot that waits before a stairway
    does not fill the memory."""
    robot: str = ""
    """Robot whose verdicts count: a profile of `stairmap check --list`, or a YAML file. Stairs that it can
    climb are no obstacle and not in its keep-out masks. Empty: a robot on wheels."""
    path_frame: str = "base_link"
    """Coordinate frame whose poses a corrected path (topic corrected_path) lists."""
    map_file: str = ""
    """File that keeps the map over a restart (NAME.npz; NAME.json beside it is for people); empty: none."""
    map_save_period: float = Field(5.0, ge=0.5, le=600)
    """How often a changed map is written, s; also at the end."""
    autostart: bool = True
    """Whether the node configures and activates itself at the start. false where a lifecycle manager does."""


class ExplorerConfig(InputConfig):
    """What the explorer is told."""

    robot: str = ""
    """Robot that explores: a profile of `stairmap check --list`, or a YAML file; the same as the map's node
    has. Its body, its speeds and what it can climb decide, so it must be named."""
    robot_frame: str = Field("base_footprint", min_length=1)
    """Coordinate frame of the robot, x ahead."""
    robot_height: float = Field(0.0, ge=-2, le=2)
    """How far robot_frame is above the ground that the robot stands on, m; 0 for base_footprint."""
    map_node: str = Field("stairmap", min_length=1)
    """Name of the map's node: its stairways, floors and keep-out masks are taken."""
    navigate_action: str = Field("navigate_to_pose", min_length=1)
    """Action nav2_msgs/NavigateToPose that drives and turns."""
    climb_action: str = Field("climb_stairway", min_length=1)
    """Action stairmap_msgs/ClimbStairway that climbs."""
    strategy: Literal["gain", "nearest", "stairs-free", "stairs-ignored"] = "gain"
    """What comes next: by cost and gain, or a simpler rule to compare with."""
    allow_unknown: bool = False
    """Whether stairs are also tried where the robot's limits were never published."""
    output: str = ""
    """Folder for decisions.jsonl and the maps of the levels; it is made, or is empty. '': no files."""

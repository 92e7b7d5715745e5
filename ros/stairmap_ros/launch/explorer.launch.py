"""Starts the explorer: ``ros2 launch stairmap_ros explorer.launch.py robot:=spot``."""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description():
    """Return the node; the map's node is started by stairmap.launch.py."""
    share = FindPackageShare("stairmap_ros")
    arguments = [
        DeclareLaunchArgument(
            "params_file",
            default_value=PathJoinSubstitution([share, "config", "explorer.yaml"]),
            description="YAML file with the parameters",
        ),
        DeclareLaunchArgument("robot", description="profile of this robot, as the map's node has it"),
        DeclareLaunchArgument(
            "image", default_value="depth/image_rect_raw", description="topic of depth images"
        ),
        DeclareLaunchArgument(
            "info", default_value="depth/camera_info", description="topic of their camera_info"
        ),
        DeclareLaunchArgument(
            "use_sim_time", default_value="false", description="true with a simulator or a bag"
        ),
    ]
    node = Node(
        package="stairmap_ros",
        executable="explorer",
        name="explorer",
        output="screen",
        parameters=[
            LaunchConfiguration("params_file"),
            {
                "robot": LaunchConfiguration("robot"),
                "use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool),
            },
        ],
        remappings=[
            ("depth/image_rect_raw", LaunchConfiguration("image")),
            ("depth/camera_info", LaunchConfiguration("info")),
        ],
    )
    return LaunchDescription([*arguments, node])

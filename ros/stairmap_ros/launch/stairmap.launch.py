"""Starts the node: ``ros2 launch stairmap_ros stairmap.launch.py image:=/camera/depth/image_rect_raw``."""

from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description():
    """Return the node, and RViz where it is asked for: both hear the same topics and the same clock."""
    share = FindPackageShare("stairmap_ros")
    arguments = [
        DeclareLaunchArgument(
            "params_file",
            default_value=PathJoinSubstitution([share, "config", "stairmap.yaml"]),
            description="YAML file with the parameters",
        ),
        DeclareLaunchArgument(
            "image", default_value="depth/image_rect_raw", description="topic of depth images"
        ),
        DeclareLaunchArgument(
            "info", default_value="depth/camera_info", description="topic of their camera_info"
        ),
        DeclareLaunchArgument(
            "use_sim_time", default_value="false", description="true with a simulator or a bag"
        ),
        DeclareLaunchArgument(
            "autostart", default_value="true", description="false where a lifecycle manager starts the node"
        ),
        DeclareLaunchArgument("rviz", default_value="false", description="whether to start RViz too"),
    ]
    clock = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    remaps = [
        ("depth/image_rect_raw", LaunchConfiguration("image")),
        ("depth/camera_info", LaunchConfiguration("info")),
    ]
    node = Node(
        package="stairmap_ros",
        executable="stairmap_node",
        name="stairmap",
        output="screen",
        parameters=[
            LaunchConfiguration("params_file"),
            clock,
            {"autostart": ParameterValue(LaunchConfiguration("autostart"), value_type=bool)},
        ],
        remappings=remaps,
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", PathJoinSubstitution([share, "rviz", "stairmap.rviz"])],
        parameters=[clock],
        # The display asks for the topics by their full names.
        remappings=[(f"/{source}", target) for source, target in remaps],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription([*arguments, node, rviz])

"""The node's own parameters, beside those of ``stairmap.config``; config/stairmap.yaml is made of both.

No ROS in here. ``python -m stairmap_ros.node_config PACKAGE PAGE`` writes config/stairmap.yaml in the package
and the table of parameters in the page, as ``make docs`` does.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field

from stairmap.config import Config

TABLE_BEGIN, TABLE_END = "<!-- parameters: begin -->", "<!-- parameters: end -->"


class NodeConfig(BaseModel):
    """What the node is told beside the configuration of the stages."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    inputs: Literal["depth", "points", "both"] = "depth"
    """What is looked at: depth images, sweeps of a LiDAR on the topic points (PointCloud2), or both."""
    map_frame: str = Field("map", min_length=1)
    """Coordinate frame with z up in which stairways are placed; all results carry it. A map that SLAM
    keeps is best; odom does where there is none, with its drift."""
    camera_frame: str = ""
    """Optical coordinate frame of the depth camera; empty: the one that the image names."""
    lidar_frame: str = ""
    """Coordinate frame of the LiDAR's points; empty: the one that the cloud names."""
    reliability: Literal["best_effort", "reliable"] = "best_effort"
    """Reliability of the depth and camera_info subscriptions. best_effort takes what any publisher sends;
    reliable asks for lost images again, and gets nothing from a publisher that is best_effort."""
    depth_transport: Literal["raw", "compressedDepth"] = "raw"
    """Whether depth comes as Image on depth/image_rect_raw, or as CompressedImage on that topic's
    compressedDepth."""
    method: Literal["stairmap", "delmerico2013"] = "stairmap"
    """Method: stairmap, or the one of ARL-TR-6381."""
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


def parameters_yaml() -> str:
    """Return config/stairmap.yaml: every parameter with its default, explained."""
    lines = [
        "# Parameters of the stairmap node with their defaults, made by `make docs`; copy, then change it:",
        "# ros2 launch stairmap_ros stairmap.launch.py params_file:=/path/to/my.yaml",
        "/**:",
        "  ros__parameters:",
    ]
    lines += _section_lines(NodeConfig(), "    ")
    for name, section in Config():
        lines.append(f"    {name}:")
        lines += _section_lines(section, "      ")
    return "\n".join(lines) + "\n"


def parameters_table() -> str:
    """Return the node's own parameters as a Markdown table, for docs/ros2.md."""
    lines = ["| parameter | default | what and why |", "|---|---|---|"]
    for name, field in NodeConfig.model_fields.items():
        lines.append(f"| `{name}` | `{_yaml_value(field.default)}` | {describe_field(field)} |")
    return "\n".join(lines) + "\n"


def describe_field(field: Any) -> str:
    """Return a parameter's description on one line."""
    return " ".join((field.description or "").split())


def _section_lines(section: BaseModel, indent: str) -> list[str]:
    lines = []
    for name, field in type(section).model_fields.items():
        lines.append(f"{indent}# {describe_field(field)}")
        lines.append(f"{indent}{name}: {_yaml_value(getattr(section, name))}")
    return lines


def _yaml_value(value: Any) -> str:
    return yaml.safe_dump(value).partition("\n")[0]


def write_generated(package: Path, page: Path) -> None:
    """Write config/stairmap.yaml of the package, and the table in the page between its marks."""
    (package / "config/stairmap.yaml").write_text(parameters_yaml(), encoding="utf-8")
    text = page.read_text(encoding="utf-8")
    before, _, rest = text.partition(TABLE_BEGIN)
    _, _, after = rest.partition(TABLE_END)
    page.write_text(f"{before}{TABLE_BEGIN}\n\n{parameters_table()}\n{TABLE_END}{after}", encoding="utf-8")


if __name__ == "__main__":
    write_generated(Path(sys.argv[1]), Path(sys.argv[2]))

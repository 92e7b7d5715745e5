"""The node as an ament_python package; stairmap itself is the package beside it."""

from setuptools import find_packages, setup

PACKAGE = "stairmap_ros"
CONFIGS = ["config/explorer.yaml", "config/fastdds_large_images.xml", "config/stairmap.yaml"]

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", CONFIGS),
        (f"share/{PACKAGE}/launch", ["launch/explorer.launch.py", "launch/stairmap.launch.py"]),
        (f"share/{PACKAGE}/rviz", ["rviz/stairmap.rviz"]),
    ],
    install_requires=["setuptools"],
    tests_require=["pytest"],
    zip_safe=True,
    maintainer="stairmap contributors",
    description="ROS 2 node of stairmap: depth images and TF in, stairways out",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            f"explorer = {PACKAGE}.explorer_main:main",
            f"play_recording = {PACKAGE}.play_recording:main",
            f"print_stairways = {PACKAGE}.print_stairways:main",
            f"stairmap_node = {PACKAGE}.main:main",
        ]
    },
)

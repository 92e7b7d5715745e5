"""The ROS packages are such as a build farm takes: all that is imported is declared, and nothing more."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("stairmap", "stairmap_msgs", "stairmap_ros")
NODE = ROOT / "ros/stairmap_ros"
SYSTEM_PACKAGES = {
    "cv2": "python3-opencv",
    "numpy": "python3-numpy",
    "pydantic": "python3-pydantic",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
}
"""Names of rosdep for what Debian and Ubuntu carry."""

CORE_WITHOUT = """
import importlib, sys
import numpy as np

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("typer", "rich", "click", "rosbags", "matplotlib"):
            raise ModuleNotFoundError(f"blocked: {name}")

sys.meta_path.insert(0, Blocked())
for name in sys.argv[1].split(","):
    importlib.import_module(name)
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap_ros.stairway_map import StairwayMap
camera = PinholeCamera(width=160, height=120, fx=140.0, fy=140.0, cx=79.5, cy=59.5)
for method in ("stairmap", "delmerico2013"):
    stairway_map = StairwayMap(Config(), method=method, views_per_place=10)
    frame = stairway_map.frame(np.full((120, 160), 2.0, dtype=np.float32), camera)
    detection = stairway_map.detect(frame, np.eye(4))
    stairway_map.add(frame, detection, 1, np.eye(4))
    stairway_map.answer()
from pathlib import Path
from stairmap.errors import MissingPackageError
from stairmap.recordings.open import open_recording
try:
    open_recording(Path(sys.argv[2]))
except MissingPackageError as error:
    assert "reading a bag needs the package rosbags" in str(error), error
else:
    raise AssertionError("a bag was opened without rosbags")
standard = sys.stdlib_module_names
print(",".join(sorted({name.partition(".")[0] for name, module in sys.modules.items() if module} - standard)))
"""


def package(name: str) -> ElementTree.Element:
    return ElementTree.parse(ROOT / "ros" / name / "package.xml").getroot()


def declared(name: str, *kinds: str) -> set[str]:
    return {str(element.text) for kind in kinds for element in package(name).iter(kind)}


def imported_names() -> set[str]:
    """Full names of all modules that the node and the launch file import, also inside functions."""
    names: set[str] = set()
    for file in [*NODE.glob("stairmap_ros/*.py"), *NODE.glob("launch/*.py")]:
        for element in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(element, ast.Import):
                names |= {alias.name for alias in element.names}
            elif isinstance(element, ast.ImportFrom):
                names.add(str(element.module))
    return names


def test_what_the_node_imports_is_declared_and_nothing_else() -> None:
    modules = {name.partition(".")[0] for name in imported_names()}
    modules -= {*sys.stdlib_module_names, "stairmap_ros"}
    # The explorer asks stairmap for it, which imports it by its name.
    assert "import_py_trees" in (NODE / "stairmap_ros/explorer.py").read_text()
    modules.add("py_trees")
    wanted = {SYSTEM_PACKAGES.get(module, module) for module in modules}
    assert declared("stairmap_ros", "exec_depend", "depend") == wanted
    assert "rviz2" not in wanted


def test_the_core_of_the_node_needs_only_what_debian_carries(tmp_path: Path) -> None:
    """No typer, no rich, no rosbags: these are for the command line and bags."""
    modules = sorted(name for name in imported_names() if name.partition(".")[0] == "stairmap")
    (tmp_path / "walk.bag").touch()
    ended = subprocess.run(
        [sys.executable, "-c", CORE_WITHOUT, ",".join(modules), tmp_path / "walk.bag"],
        env={**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{NODE}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    used = {SYSTEM_PACKAGES[name] for name in ended.stdout.strip().split(",") if name in SYSTEM_PACKAGES}
    assert declared("stairmap", "exec_depend", "depend") == used


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_has_its_licence_changelog_and_version(name: str) -> None:
    folder, root = ROOT / "ros" / name, package(name)
    assert (folder / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
    assert next(root.iter("license")).attrib == {"file": "LICENSE"}
    assert (folder / "CHANGELOG.rst").read_text().splitlines()[1] == f"Changelog for package {name}"
    version = str(next(root.iter("version")).text)
    assert f'__version__ = "{version}"' in (ROOT / "src/stairmap/__init__.py").read_text()
    setup = folder / "setup.py"
    assert not setup.exists() or f'version="{version}"' in setup.read_text()


def test_a_clone_in_a_workspace_builds_our_packages_and_no_others() -> None:
    """The tests' parts of tf2_msgs, vision_msgs and nav2_msgs would take the place of the real ones."""
    marks = ("package.xml", "CMakeLists.txt", "setup.py")
    found = set()
    for folder, subfolders, files in os.walk(ROOT):
        if "COLCON_IGNORE" in files or Path(folder).name.startswith("."):
            subfolders.clear()
        elif any(mark in files for mark in marks):
            found.add(Path(folder).relative_to(ROOT).as_posix())
            subfolders.clear()
    assert found == {f"ros/{name}" for name in PACKAGES}


def test_every_message_is_built() -> None:
    folder = ROOT / "ros/stairmap_msgs"
    listed = (folder / "CMakeLists.txt").read_text()
    for file in [file for kind in ("msg", "srv", "action") for file in folder.glob(f"{kind}/*.{kind}")]:
        assert f'"{file.parent.name}/{file.name}"' in listed

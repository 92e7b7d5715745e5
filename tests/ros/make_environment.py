"""Make ``.venv-ros``: ROS 2 from wheels, the messages that they lack built from .msg, stairmap and its node.

``make test`` runs it before the tests. A stamp keeps it from working twice; what prevents it (no Python 3.11
or 3.12, no compiler, no network) is written down, and the tests are skipped with that reason.
Run it with any Python 3.10 or newer; it needs nothing but the standard library.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / ".venv-ros"
STAMP = ENVIRONMENT / ".installed"
UNAVAILABLE = ENVIRONMENT / "unavailable.txt"
LOG = ENVIRONMENT / "log.txt"

DISTRIBUTION = "jazzy"
WHEELS = (
    *(
        "rclpy",
        "rmw-fastrtps-cpp",
        "sensor-msgs",
        "visualization-msgs",
        "nav-msgs",
        "geometry-msgs",
        "std-msgs",
        "std-srvs",
    ),
    *(
        "diagnostic-msgs",
        "ament-cmake",
        "ament-package",
        "ament-cmake-include-directories",
        "ament-cmake-gtest",
    ),
    *("ament-cmake-gmock", "ament-cmake-pytest", "ament-cmake-ros", "python-cmake-module"),
    *("rosidl-core-generators", "rosidl-default-generators"),
)
OTHER_PACKAGES = (
    "catkin_pkg",
    "setuptools<80",
    "wheel",
    "ninja",
    "numpy==1.26.4",
    "opencv-python-headless==4.6.0.66",
    "py-trees",
    "embreex",
)
"""numpy and OpenCV are those of Ubuntu 24.04, the lowest that stairmap allows. py-trees is the explorer's,
embreex that of the world that it is let loose in."""

INTERFACES = (
    ROOT / "tests/ros/interfaces/nav2_msgs",
    ROOT / "tests/ros/interfaces/tf2_msgs",
    ROOT / "tests/ros/interfaces/vision_msgs",
    ROOT / "ros/stairmap_msgs",
)
NODE = ROOT / "ros/stairmap_ros"


class CannotMakeError(Exception):
    """What this machine lacks."""


def main() -> int:
    """Make what is missing; return 0 also when that cannot be done, for the tests say so."""
    wanted = wanted_parts()
    made: dict[str, str] = json.loads(STAMP.read_text(encoding="utf-8")) if STAMP.exists() else {}
    if made == wanted:
        return 0
    UNAVAILABLE.unlink(missing_ok=True)
    try:
        if made.get("wheels") != wanted["wheels"]:
            shutil.rmtree(ENVIRONMENT, ignore_errors=True)
            made = {}
            install_wheels()
            note(made, "wheels", wanted)
        if made.get("stairmap") != wanted["stairmap"]:
            pip_install("--editable", str(ROOT))
            note(made, "stairmap", wanted)
        for folder in INTERFACES:
            if made.get(folder.name) != wanted[folder.name]:
                build_interfaces(folder)
                note(made, folder.name, wanted)
        if made.get("node") != wanted["node"]:
            install_node()
            note(made, "node", wanted)
    except CannotMakeError as error:
        ENVIRONMENT.mkdir(exist_ok=True)
        UNAVAILABLE.write_text(f"{error}\n", encoding="utf-8")
        print(f"no tests of the ROS 2 node: {error}")
    return 0


def wanted_parts() -> dict[str, str]:
    """Return a sum for each part of the environment: what has the same sum need not be made again."""
    wheels = hashlib.sha256(" ".join((DISTRIBUTION, *WHEELS, *OTHER_PACKAGES)).encode()).hexdigest()
    interfaces = {folder.name: digest(*message_files(folder)) for folder in INTERFACES}
    return {"wheels": wheels, "stairmap": digest(ROOT / "pyproject.toml"), **interfaces, "node": digest(NODE)}


def note(made: dict[str, str], part: str, wanted: dict[str, str]) -> None:
    """Write down that a part is made."""
    made[part] = wanted[part]
    STAMP.write_text(json.dumps(made), encoding="utf-8")


def install_wheels() -> None:
    """Make the virtual environment with ROS 2 in it."""
    python = find_python()
    if shutil.which("c++") is None:
        raise CannotMakeError("no C++ compiler; on Debian: apt install g++ python3-dev")
    print(f"making {ENVIRONMENT.name}: ROS 2 from wheels, about a minute", flush=True)
    run([python, "-m", "venv", str(ENVIRONMENT)])
    pip_install(*(f"ros-{DISTRIBUTION}-{name}" for name in WHEELS), *OTHER_PACKAGES)
    if shutil.which("cmake") is None:
        pip_install("cmake<4")
    replace_build_paths()


def find_python() -> str:
    """Return a Python that the wheels are made for, with headers to compile against."""
    check = (
        "import sys, sysconfig, venv, ensurepip, pathlib;"
        "sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12))"
        " or not pathlib.Path(sysconfig.get_path('include'), 'Python.h').exists())"
    )
    for name in (sys.executable, "python3.12", "python3.11", "python3"):
        path = shutil.which(name)
        if path and subprocess.run([path, "-c", check], capture_output=True, check=False).returncode == 0:
            return path
    raise CannotMakeError(
        "the wheels of ROS 2 need Python 3.11 or 3.12 with its headers (Debian: apt install python3-dev)"
    )


def pip_install(*arguments: str) -> None:
    """Install packages into the environment."""
    pip = [str(ENVIRONMENT / "bin/python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    run([*pip, *arguments])


def replace_build_paths() -> None:
    """Point the CMake files of the wheels at this Python instead of the one they were built with."""
    code = "import sysconfig, numpy; print(sysconfig.get_path('include')); print(numpy.get_include())"
    output = subprocess.run(
        [str(ENVIRONMENT / "bin/python"), "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=clean_env(),
    ).stdout
    python_include, numpy_include = output.split()
    for file in ENVIRONMENT.glob("share/*/cmake/*rosidl_generator_pyExport.cmake"):
        text = file.read_text(encoding="utf-8")
        text = re.sub(r"/opt/python/[^;\"]*/numpy/_core/include", numpy_include, text)
        text = re.sub(r"/opt/python/[^;\"/]*/include/python3\.\d+", python_include, text)
        file.write_text(text, encoding="utf-8")


def build_interfaces(folder: Path) -> None:
    """Build one package of messages and install it into the environment."""
    build = ENVIRONMENT / "build" / folder.name
    packages = next(ENVIRONMENT.glob("lib/python3.*/site-packages")).relative_to(ENVIRONMENT)
    definitions = {
        "CMAKE_PREFIX_PATH": ENVIRONMENT,
        "CMAKE_INSTALL_PREFIX": ENVIRONMENT,
        "CMAKE_MESSAGE_LOG_LEVEL": "WARNING",
        "Python3_EXECUTABLE": ENVIRONMENT / "bin/python",
        "PYTHON_INSTALL_DIR": packages,
        "BUILD_TESTING": "OFF",
        "CMAKE_C_FLAGS": "-O0",
        "CMAKE_CXX_FLAGS": "-O0",
    }
    options = [f"-D{name}={value}" for name, value in definitions.items()]
    run(["cmake", "-S", str(folder), "-B", str(build), "-G", "Ninja", *options])
    run(["cmake", "--build", str(build)])
    run(["cmake", "--install", str(build)])
    shutil.rmtree(build)


def install_node() -> None:
    """Install the node's package as a user's pip would."""
    pip_install("--no-deps", "--no-build-isolation", "--force-reinstall", str(NODE))
    shutil.rmtree(NODE / "build", ignore_errors=True)
    shutil.rmtree(NODE / "stairmap_ros.egg-info", ignore_errors=True)


def run(command: list[str]) -> None:
    """Run a command with its output in the log; say how it ended if it failed."""
    ENVIRONMENT.mkdir(exist_ok=True)
    with LOG.open("a", encoding="utf-8") as log:
        log.write(f"$ {' '.join(command)}\n")
        log.flush()
        ended = subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, env=clean_env(), check=False)
    if ended.returncode:
        raise CannotMakeError(f"{' '.join(command[:4])} … failed with code {ended.returncode}; see {LOG}")


def clean_env() -> dict[str, str]:
    """Return the process environment with the new environment's programs first."""
    environment = dict(os.environ)
    # The wheels leave this behind to start Python only once; another environment's must not inherit it.
    environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
    environment["PATH"] = f"{ENVIRONMENT / 'bin'}{os.pathsep}{environment['PATH']}"
    return environment


def message_files(folder: Path) -> list[Path]:
    """Return the files of a package that its messages are built from."""
    kinds = ("msg", "srv", "action")
    return [folder / "CMakeLists.txt", *(file for kind in kinds for file in folder.glob(f"{kind}/*.{kind}"))]


def digest(*paths: Path) -> str:
    """Return a sum of files, and of all files in folders."""
    total = hashlib.sha256()
    files = [file for path in paths for file in (path.rglob("*") if path.is_dir() else [path])]
    for file in sorted(file for file in files if file.is_file()):
        parts = file.relative_to(ROOT).parts
        if not any(part == "__pycache__" or part.endswith((".egg-info", "_cache")) for part in parts):
            total.update("/".join(parts).encode() + file.read_bytes())
    return total.hexdigest()


if __name__ == "__main__":
    sys.exit(main())

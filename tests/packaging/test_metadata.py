"""What pyproject.toml and the files beside it say of the package is true."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
import yaml

import stairmap

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]

PACKAGE_OF_MODULE = {"dask": "distributed", "foxglove": "foxglove-sdk", "rerun": "rerun-sdk"}
"""Where a package that may not be installed is not called as what it is imported as."""

INSTALLED_WITH = {
    "backports": "rosbags",
    "click": "typer",
    "lazrs": "laspy",
    "lz4": "rosbags",
    "mpl_toolkits": "matplotlib",
    "pydantic_core": "pydantic",
    "zstandard": "rosbags",
}
"""Modules that come with a package which needs them itself."""


NEW_IN_PYTHON = {"compression"}
"""Modules of the standard library of newer versions than the one that runs this."""


def requirement_name(requirement: str) -> str:
    return re.split(r"[\s<>=!~;\[]", requirement)[0].lower()


def imported_modules() -> dict[str, set[str]]:
    """Return the modules that are not of the standard library or stairmap, and where they are imported."""
    found: dict[str, set[str]] = {}
    for file in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module]
            for name in names:
                top = name.split(".")[0]
                if top not in {*sys.stdlib_module_names, *NEW_IN_PYTHON, "stairmap"}:
                    found.setdefault(top, set()).add(str(file.relative_to(ROOT / "src/stairmap")))
    return found


def test_every_package_that_is_imported_is_declared() -> None:
    declared = {requirement_name(item) for item in PROJECT["project"]["dependencies"]}
    users = [extra for name, extra in EXTRAS.items() if name not in {"dev", "docs"}]
    declared |= {requirement_name(item) for extra in users for item in extra}
    installed = packages_distributions()
    for module, places in imported_modules().items():
        package = INSTALLED_WITH.get(module, PACKAGE_OF_MODULE.get(module, module))
        names = {package, *installed.get(module, ())}
        assert {name.lower().replace("_", "-") for name in names} & {
            name.replace("_", "-") for name in declared
        }, (module, places)


def test_all_and_dev_name_extras_that_there_are() -> None:
    for group in ("all", "dev"):
        named = re.search(r"stairmap\[([^\]]+)\]", " ".join(EXTRAS[group]))
        assert named is not None
        assert set(named[1].split(",")) <= set(EXTRAS)


def test_version_stands_in_one_place_and_files_that_must_repeat_it_agree() -> None:
    assert "version" not in PROJECT["project"] and "version" in PROJECT["project"]["dynamic"]
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == stairmap.__version__
    for package in ("stairmap", "stairmap_ros", "stairmap_msgs"):
        text = (ROOT / "ros" / package / "package.xml").read_text()
        assert f"<version>{stairmap.__version__}</version>" in text, package
    assert f'version="{stairmap.__version__}"' in (ROOT / "ros/stairmap_ros/setup.py").read_text()
    recipe = yaml.safe_load((ROOT / "packaging/conda-forge/recipe.yaml").read_text())
    assert recipe["context"]["version"] == stairmap.__version__


def test_no_address_is_invented() -> None:
    """``package.xml`` must have an address; one that ends in .invalid is nobody's (RFC 2606)."""
    files = [
        ROOT / "pyproject.toml",
        ROOT / "CITATION.cff",
        ROOT / "SECURITY.md",
        ROOT / "CODE_OF_CONDUCT.md",
    ]
    files += [
        *(ROOT / "ros").glob("*/package.xml"),
        *(ROOT / "ros").glob("*/setup.py"),
        *(ROOT / "packaging").rglob("*.*"),
    ]
    for file in files:
        for address in re.findall(r"[\w.+-]+@[\w-]+\.[\w.]*\w", file.read_text(encoding="utf-8")):
            assert address.endswith(".invalid"), (file.name, address)


def test_conda_recipe_asks_for_the_same_packages() -> None:
    recipe = yaml.safe_load((ROOT / "packaging/conda-forge/recipe.yaml").read_text())["requirements"]
    called = {"opencv-python-headless": "py-opencv"}
    expected = {called.get(requirement_name(item), requirement_name(item)): item.partition(">=")[2]
                for item in PROJECT["project"]["dependencies"]}  # fmt: skip
    found = {item.split()[0]: item.partition(">=")[2] for item in recipe["run"] if item != "python"}
    assert found == expected
    built = {item.split()[0]: item.partition(">=")[2] for item in recipe["host"] if ">=" in item}
    assert built == {requirement_name(item): item.partition(">=")[2]
                     for item in PROJECT["build-system"]["requires"]}  # fmt: skip


def test_container_installs_extras_that_there_are_and_gives_up_rights() -> None:
    text = (ROOT / "Dockerfile").read_text()
    extras = re.search(r"^ARG EXTRAS=(\S+)$", text, re.M)
    assert extras is not None and set(extras[1].split(",")) <= set(EXTRAS)
    for name in ("Dockerfile", "ros/Dockerfile"):
        assert re.search(r"^USER [1-9]\d*:", (ROOT / name).read_text(), re.M), name


def test_ros_container_installs_what_the_packages_ask_for() -> None:
    text = (ROOT / "ros/Dockerfile").read_text()
    with_ros_core = {
        "action_msgs", "builtin_interfaces", "geometry_msgs", "launch", "launch_ros", "rcl_interfaces",
        "rclpy", "rosidl_default_runtime", "sensor_msgs", "std_msgs", "std_srvs",
    }  # fmt: skip
    ours = {"stairmap", "stairmap_msgs", "stairmap_ros"}
    for package in ours:
        manifest = (ROOT / "ros" / package / "package.xml").read_text()
        for name in re.findall(r"<(?:exec_)?depend>([\w-]+)<", manifest):
            if name not in with_ros_core | ours | {"python3-pydantic"}:
                wanted = name if name.startswith("python3-") else f"ros-jazzy-{name.replace('_', '-')}"
                assert wanted in text, (package, name)


def test_pythons_of_classifiers_workflows_and_wheels_are_the_same() -> None:
    classified = {
        match[1] for item in PROJECT["project"]["classifiers"] if (match := re.search(r":: (3\.\d+)$", item))
    }
    workflow = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text())
    assert set(workflow["jobs"]["tests"]["strategy"]["matrix"]["python"]) == classified
    wheels = {re.sub(r"cp3(\d+)-\*", r"3.\1", item) for item in PROJECT["tool"]["cibuildwheel"]["build"]}
    assert wheels == classified
    assert min(classified, key=lambda text: int(text[2:])) == PROJECT["project"]["requires-python"].lstrip(
        ">="
    )


def test_workflows_have_least_rights_and_an_end() -> None:
    for file in (ROOT / ".github/workflows").glob("*.yml"):
        workflow = yaml.safe_load(file.read_text())
        assert workflow["permissions"] == {"contents": "read"}, file
        for name, job in workflow["jobs"].items():
            assert "timeout-minutes" in job, (file.name, name)


def test_issue_forms_ask_for_what_inspect_says() -> None:
    for name in ("wrong_result", "fault", "wish"):
        form = yaml.safe_load((ROOT / f".github/ISSUE_TEMPLATE/{name}.yml").read_text())
        assert any("stairmap inspect" in str(item) for item in form["body"]), name


PLATFORMS = {
    "x86_64": (
        "manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64", "manylinux_2_31_x86_64",
    ),
    "aarch64": (
        "manylinux_2_28_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64", "manylinux_2_31_aarch64",
    ),
}  # fmt: skip


def expanded(extra: str) -> list[str]:
    """The requirements of an extra, with those of other extras that it names."""
    found = []
    for text in EXTRAS[extra]:
        named = re.fullmatch(r"stairmap\[([^\]]+)\]", text)
        found += (
            [text] if named is None else [item for name in named[1].split(",") for item in expanded(name)]
        )
    return found


@pytest.mark.nightly
@pytest.mark.parametrize("machine", PLATFORMS)
@pytest.mark.parametrize("extra", sorted(set(EXTRAS) - {"dev", "all"}))
def test_every_extra_has_wheels_or_is_left_out_by_a_marker(extra: str, machine: str, tmp_path: Path) -> None:
    from packaging.requirements import Requirement  # noqa: PLC0415

    environment = {"platform_machine": machine, "sys_platform": "linux", "python_version": "3.12"}
    wanted = []
    for text in expanded(extra):
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate({**environment, "extra": ""}):
            requirement.marker = None
            wanted.append(str(requirement))
    if not wanted:
        pytest.skip(f"{extra} is left out on {machine}")
    platforms = [word for name in PLATFORMS[machine] for word in ("--platform", name)]
    result = subprocess.run(
        [sys.executable, "-m", "pip", "install", "--dry-run", "--quiet", "--only-binary=:all:", "--no-deps",
         "--python-version", "3.12", *platforms, "--target", str(tmp_path / "none"), *wanted],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr[-600:]

"""Check the conda recipe, the rosdistro entry and the ROS manifests with the parsers of those who read them.

Run by ``make lint-files``, which installs the parsers.
"""

from __future__ import annotations

import sys
from pathlib import Path

import yaml
from catkin_pkg.package import parse_package
from rattler_build import RenderConfig, Stage0Recipe, VariantConfig
from rosdistro.distribution_file import DistributionFile

ROOT = Path(__file__).resolve().parents[1]
COMPILERS = {"c_compiler": ["gxx"], "cxx_compiler": ["gxx"], "c_stdlib": ["sysroot"], "python": ["3.12.*"]}
"""What conda-forge's own settings give; any value will do to render the recipe."""


def rendered_packages(path: Path) -> list[str]:
    """Return name and version of each package that rattler-build makes of a recipe."""
    recipe = Stage0Recipe.from_file(path)
    rendered = recipe.render(VariantConfig(COMPILERS), RenderConfig())
    packages = [variant.recipe.package for variant in rendered]
    return [f"{package.name} {package.version}" for package in packages]


def repositories(path: Path) -> list[str]:
    """Return the repositories of a rosdistro file."""
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    return sorted(DistributionFile("jazzy", data).repositories)


def manifest_warnings(folder: Path) -> list[str]:
    """Return what catkin_pkg, the reader of all ROS tools, finds odd in a package.xml; an error is raised."""
    warnings: list[str] = []
    parse_package(str(folder), warnings=warnings)
    return warnings


def main() -> None:
    """Print what was read; end with an error where a file is wrong."""
    print("conda:", *rendered_packages(ROOT / "packaging/conda-forge/recipe.yaml"))
    print("rosdistro:", *repositories(ROOT / "packaging/rosdistro/distribution.yaml"))
    for manifest in sorted((ROOT / "ros").glob("*/package.xml")):
        warnings = manifest_warnings(manifest.parent)
        print(f"{manifest.parent.name}:", *(warnings or ["no warnings"]))
        if warnings:
            sys.exit(1)


if __name__ == "__main__":
    main()

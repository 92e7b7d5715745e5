"""The reference names the whole public API, and the site's pages are all in its navigation."""

from __future__ import annotations

import re
from pathlib import Path

import stairmap

ROOT = Path(__file__).parents[1]


def test_reference_has_every_public_name_once() -> None:
    page = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    named = re.findall(r"^::: (\S+)$", page, flags=re.MULTILINE)
    assert sorted(named) == sorted(f"{home}.{name}" for name, home in stairmap._HOME_OF_NAME.items())


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    named = set(re.findall(r": (\S+\.md)$", navigation, flags=re.MULTILINE))
    pages = {path.name for path in (ROOT / "docs").glob("*.md")}
    assert pages <= named and all((ROOT / name).exists() for name in named - pages)

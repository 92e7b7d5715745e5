"""Links between the project's pages lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    ROOT / "BENCHMARKS.md",
    *sorted((ROOT / "docs").glob("*.md")),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_that_exist(page):
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text())
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []


def test_every_page_of_docs_is_in_the_index():
    index = (ROOT / "docs" / "index.md").read_text()
    assert [page.name for page in (ROOT / "docs").glob("*.md") if f"({page.name})" not in index] == [
        "index.md"
    ]


def test_every_picture_is_shown_on_a_page_and_is_small():
    pictures = sorted(path for path in (ROOT / "docs" / "images").iterdir())
    text = "".join(page.read_text() for page in PAGES)
    assert [path.name for path in pictures if path.name not in text] == []
    assert [path.name for path in pictures if path.stat().st_size > 300_000] == []


def test_site_holds_the_pictures_of_pages_beside_docs():
    site_files = (ROOT / "docs" / "site_files.py").read_text()
    pattern = re.search(r'_LINK_BESIDE = re.compile\(r"(.+)"\)', site_files)
    assert pattern is not None and "_LINK_BESIDE.findall" in site_files
    found = re.findall(pattern[1], (ROOT / "BENCHMARKS.md").read_text())
    pictures = [name for name in found if name.endswith(".png")]
    assert pictures and all((ROOT / name).exists() for name in pictures)

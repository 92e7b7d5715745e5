"""Bring files beside docs/ into the site, and keep it free of files that need a network.

Pages link to files beside docs/ as ``../NAME``, which also works on GitHub.
"""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from mkdocs.utils import get_relative_url

ROOT = Path(__file__).resolve().parents[1]

PAGES = ("BENCHMARKS.md", "CHANGELOG.md", "CONTRIBUTING.md", "benchmarks/trials.md")
"""Pages of the site that stand beside docs/."""

SEARCH_SCRIPT, OWN_SEARCH_SCRIPT = "https://unpkg.com/iframe-worker/shim", "javascripts/iframe-worker.js"
"""What the theme fetches to search without a server, and the same file in the site."""

_LINK = re.compile(r"\]\(\.\./([^)#\s]+)")
_LINK_BESIDE = re.compile(r"\]\((?!docs/|https?:)([^)#\s]+)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages, and each file that a page of docs/ or one of these pages links to."""
    names = set(PAGES)
    for file in files.documentation_pages():
        names.update(_LINK.findall(file.content_string))
    for page in PAGES:
        links = _LINK_BESIDE.findall((ROOT / page).read_text(encoding="utf-8"))
        names.update(str((ROOT / page).parent.joinpath(link).relative_to(ROOT)) for link in links)
    for name in sorted(names):
        if (ROOT / name).is_file():
            files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
        elif (ROOT / name).is_dir():
            raise FileNotFoundError(f"the site can link to files, not to the folder {name}")
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links find these files in the site, from docs/ and from the pages beside it."""
    if page.file.src_uri in PAGES:
        markdown = markdown.replace("](docs/", "](")
    return _LINK.sub(r"](\1", markdown)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Take the search's script from the site itself."""
    return output.replace(SEARCH_SCRIPT, get_relative_url(OWN_SEARCH_SCRIPT, page.url))

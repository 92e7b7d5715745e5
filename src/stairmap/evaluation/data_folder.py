"""Where real recordings and architects' buildings lie, which are no part of the project."""

from __future__ import annotations

from pathlib import Path

DATA_FOLDER = Path("../shared/data")
"""Folder beside the project with ``real/`` and ``buildings/``; ``--data`` names another."""

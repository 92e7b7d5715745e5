"""Where a report comes from: date, recording, command."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path


def report_facts(recording: Path | str) -> Mapping[str, str]:
    """Return what a report says about its origin."""
    place = str(recording.resolve()) if isinstance(recording, Path) else recording
    return {
        "date": datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
        "recording": place,
        "command": shlex.join(["stairmap", *sys.argv[1:]]),
    }

"""Entry point of ``stairmap`` and ``python -m stairmap``."""

from __future__ import annotations

import io
import sys


def main() -> None:
    """Run the command line and exit with its code: 0 ran, 1 a refusal, 2 wrong usage, 130 interrupted."""
    try:
        _run()
    except KeyboardInterrupt:
        # Ctrl-C while the program is still being loaded, before the commands can answer it.
        sys.stderr.write("interrupted\n")
        sys.exit(130)


def _run() -> None:
    from stairmap.cli.app import app  # noqa: PLC0415

    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot spell "±" or "≥" gets "?", not a traceback after an hour of frames.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    app(prog_name="stairmap")


if __name__ == "__main__":
    main()

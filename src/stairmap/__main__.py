"""Entry point of ``stairmap`` and ``python -m stairmap``."""

from __future__ import annotations

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
    from stairmap.cli.streams import QUIET_ERRORS, guard_streams  # noqa: PLC0415

    stdout, stderr = guard_streams(shows_noise="--debug" in sys.argv)
    code = _exit_code()
    stdout.flush()
    error = stdout.error
    if error is not None and error.errno not in QUIET_ERRORS:
        stderr.write(
            f"error: cannot write the output: {error.strerror}; results that have files are written\n"
        )
        code = code or 1
    stderr.flush()
    sys.exit(code)


def _exit_code() -> int:
    from stairmap.cli.app import app  # noqa: PLC0415

    try:
        app(prog_name="stairmap")
    except SystemExit as ending:
        return ending.code if isinstance(ending.code, int) else int(ending.code is not None)
    return 0


if __name__ == "__main__":
    main()

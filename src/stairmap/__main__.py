"""Entry point of ``stairmap`` and ``python -m stairmap``."""

from __future__ import annotations


def main() -> None:
    """Run the command line and exit with its code (ARCHITECTURE.md section 6)."""
    from stairmap.cli.app import app  # noqa: PLC0415

    app(prog_name="stairmap")


if __name__ == "__main__":
    main()

"""Options of ``stairmap config``."""

from __future__ import annotations

from typing import Annotated

import typer

from stairmap.cli.options import ConfigOption, DebugOption, SetOption


def config(
    *,
    config: ConfigOption = None,
    overrides: SetOption = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print docs/configuration.md.")] = False,
    debug: DebugOption = False,
) -> None:
    """Print the configuration as YAML: defaults and changes, each with unit, range and reason.

    \b
    Examples:
      stairmap config > my.yaml
      stairmap config --config my.yaml --set detection.max_depth=4
    """
    from stairmap.cli.config_text import commented_yaml, configuration_page  # noqa: PLC0415
    from stairmap.config import load_config  # noqa: PLC0415

    resolved = load_config(config, overrides or ())
    typer.echo(configuration_page() if markdown else commented_yaml(resolved), nl=False)

"""``stairmap config``, and docs/configuration.md which it writes."""

from __future__ import annotations

from pathlib import Path

from command_line import stairmap
from stairmap.config import Config, load_config

PAGE = Path(__file__).parents[1] / "docs" / "configuration.md"


def test_printed_configuration_is_read_back_equal(tmp_path):
    (tmp_path / "my.yaml").write_text(stairmap("config").stdout)
    assert load_config(tmp_path / "my.yaml") == Config()


def test_changes_are_resolved_in_the_order_file_then_set(tmp_path):
    (tmp_path / "my.yaml").write_text("detection: {max_depth: 4.5, min_steps: 4}\n")
    outcome = stairmap("config", "--config", tmp_path / "my.yaml", "--set", "detection.min_steps=5")
    (tmp_path / "resolved.yaml").write_text(outcome.stdout)
    resolved = load_config(tmp_path / "resolved.yaml").detection
    assert (resolved.max_depth, resolved.min_steps) == (4.5, 5)


def test_each_value_has_its_reason_and_range():
    text = stairmap("config").stdout
    assert "# Smallest run, m. Ship stairs go down to 0.19. (> 0, < 2)\n  min_run: 0.18\n" in text


def test_committed_page_is_what_the_code_says():
    assert PAGE.read_text() == stairmap("config", "--markdown").stdout, "run: make docs"

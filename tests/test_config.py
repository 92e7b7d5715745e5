from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from stairmap.config import Config, dump_config, load_config
from stairmap.errors import ConfigError
from value_strategies import no_deadline


def test_without_file_and_overrides_the_defaults_hold() -> None:
    assert load_config() == Config()
    assert load_config().delmerico2013.min_cluster_points == 250


def test_file_overrides_defaults_and_set_overrides_the_file(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("detection:\n  min_steps: 4\n  max_depth: 5.0\n")
    config = load_config(path, ["detection.max_depth=4.5"])
    assert (config.detection.min_steps, config.detection.max_depth) == (4, 4.5)
    assert config.envelope == Config().envelope


def test_last_override_of_a_key_wins() -> None:
    config = load_config(None, ["detection.min_steps=4", "detection.min_steps=5"])
    assert config.detection.min_steps == 5


@no_deadline
@given(st.floats(0.01, 0.2), st.floats(0.21, 0.9), st.integers(1, 1000), st.floats(0.6, 20))
def test_dumped_file_is_read_back_equal(
    tmp_path_factory: pytest.TempPathFactory, low: float, high: float, count: int, depth: float
) -> None:
    config = Config.model_validate(
        {
            "envelope": {"min_rise": low, "max_rise": high},
            "detection": {"max_depth": depth},
            "delmerico2013": {"detections_per_fit": count},
        }
    )
    path = tmp_path_factory.getbasetemp() / "dumped.yaml"
    path.write_text(dump_config(config))
    assert load_config(path) == config


def test_empty_file_means_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("# nothing\n")
    assert load_config(path) == Config()


@pytest.mark.parametrize(
    ("key", "nearest"),
    [
        ("detection.min_step", "detection.min_steps"),
        ("detecton.max_depth", "detection.max_depth"),
        ("delmerico2013.max_pitch", "delmerico2013.max_pitch_deg"),
    ],
)
def test_unknown_key_is_refused_and_the_nearest_known_one_named(key: str, nearest: str) -> None:
    with pytest.raises(
        ConfigError, match=rf"unknown config key {key.split('.', maxsplit=1)[0]}.*did you mean {nearest}\?"
    ):
        load_config(None, [f"{key}=3"])


def test_unknown_key_in_a_file_is_refused_too(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("envelope:\n  min_rize: 0.1\n")
    with pytest.raises(
        ConfigError, match=r"unknown config key envelope\.min_rize; did you mean envelope\.min_rise"
    ):
        load_config(path)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("detection.min_steps=1", r"config detection\.min_steps: .*greater than or equal to 2, got 1"),
        ("detection.min_steps=many", r"config detection\.min_steps: .*integer.*got 'many'"),
        ("detection.max_depth=-1", r"config detection\.max_depth: .*greater than 0\.5, got -1"),
        ("envelope.min_rise=0.3", r"min_rise \(0\.3\) must be below max_rise \(0\.26\)"),
        ("envelope.min_pitch_deg=60", r"min_pitch_deg \(60\) must be below max_pitch_deg \(52\)"),
        ("detection=3", "config detection is a section"),
        ("detection.min_steps.more=3", r"detection\.min_steps"),
    ],
)
def test_wrong_value_is_refused_with_its_key_and_the_limit(override: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load_config(None, [override])


@pytest.mark.parametrize("override", ["detection.min_steps", "=3", "detection.=3", ".min_steps=3"])
def test_override_that_is_no_assignment_is_refused(override: str) -> None:
    with pytest.raises(ConfigError, match=r"expected --set section\.key=value, got"):
        load_config(None, [override])


def test_override_with_unreadable_value_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"cannot read the value of --set detection\.min_steps=\["):
        load_config(None, ["detection.min_steps=["])


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"cannot read the config file .*absent\.yaml"):
        load_config(tmp_path / "absent.yaml")


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"a: [", "not a YAML file"), (b"\xff\xfe\x00", "to be UTF-8 text"), (b"- 1\n", "must hold sections")],
)
def test_file_that_holds_no_sections_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=message):
        load_config(path)


def test_config_cannot_be_changed() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Config().detection.min_steps = 7  # type: ignore[misc]


def test_every_parameter_says_what_it_is() -> None:
    for section in Config.model_fields.values():
        assert section.annotation is not None
        for name, field in section.annotation.model_fields.items():
            assert field.description, f"{section.annotation.__name__}.{name} has no docstring"

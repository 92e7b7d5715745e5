"""Fixtures of all tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import Phase, settings

from command_line import stairmap
from small_recordings import write_recording
from stairmap.evaluation.data_folder import DATA_FOLDER

# benchmarks/mutants.py: the same examples each time, and a fault that was noticed need not be made smaller.
settings.register_profile("mutants", derandomize=True, database=None, phases=[Phase.explicit, Phase.generate])


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real recordings and buildings beside the project; where it is absent, skip."""
    folder = Path(__file__).resolve().parents[1] / DATA_FOLDER
    if not folder.is_dir():
        pytest.skip(f"no real data at {folder}")
    return folder.resolve()


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run folder of a camera that comes up to a staircase; its recording lies beside it."""
    folder = tmp_path_factory.mktemp("runs")
    recording = write_recording(folder / "stairs")
    outcome = stairmap("run", recording, "-o", folder / "run", "--no-report")
    assert outcome.code == 0, outcome.stderr
    return folder / "run"


@pytest.fixture(scope="session")
def empty_run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run folder without a stairway."""
    folder = tmp_path_factory.mktemp("runs")
    recording = write_recording(folder / "floor", num_frames=3, has_stairs=False)
    outcome = stairmap("run", recording, "-o", folder / "run", "--no-report")
    assert outcome.code == 0, outcome.stderr
    return folder / "run"

"""All errors that stairmap raises on purpose can be caught as one."""

from __future__ import annotations

import inspect

from stairmap import errors


def test_every_error_is_a_stairmap_error() -> None:
    members = [value for _, value in inspect.getmembers(errors, inspect.isclass)]
    classes = [value for value in members if issubclass(value, Exception)]
    assert len(classes) > 5
    assert all(issubclass(error, errors.StairmapError) for error in classes)


def test_bad_poses_are_a_fault_of_the_recording() -> None:
    assert issubclass(errors.TrajectoryError, errors.RecordingError)


def test_a_missing_package_names_what_to_install() -> None:
    error = errors.MissingPackageError("embreex", "sim", "simulation")
    assert str(error) == (
        "simulation needs the package embreex, which is not installed; run: pip install 'stairmap[sim]'"
    )


def test_package_that_is_not_built_for_a_processor_says_so_instead_of_what_to_install(monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    error = errors.MissingPackageError("embreex", "sim", "simulating a camera", no_wheel_on=("aarch64",))
    assert "not built for aarch64" in str(error) and "pip install" not in str(error)
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    assert "pip install 'stairmap[sim]'" in str(
        errors.MissingPackageError("embreex", "sim", "simulating a camera", no_wheel_on=("aarch64",))
    )

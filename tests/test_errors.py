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

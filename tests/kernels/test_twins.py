"""The compiled kernels and their NumPy twins: the same answers, and the same refusals."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from recorded_calls import Call, kernel_names, recorded_calls

from stairmap import kernels
from stairmap.kernels.choice import load_compiled

RELATIVE, ABSOLUTE = 1e-9, 1e-9
"""How far the two may differ: sums are taken in another order. A millimetre in a metre is a million of it."""


@pytest.fixture(scope="module")
def compiled() -> ModuleType:
    """The compiled module, whichever variant is in use."""
    try:
        return load_compiled()
    except ImportError:
        pytest.skip("the compiled kernels were not built: make kernels")


def twin_of(name: str) -> Any:
    """Return the NumPy twin of a kernel."""
    modules = [member for member in vars(kernels).values() if isinstance(member, ModuleType)]
    return next(vars(module)[name] for module in modules if name in vars(module))


def assert_alike(mine: Any, other: Any, what: str) -> None:
    """Compare two results of kernels."""
    assert type(mine) is type(other), what
    if isinstance(mine, tuple):
        assert len(mine) == len(other), what
        for place, (first, second) in enumerate(zip(mine, other, strict=True)):
            assert_alike(first, second, f"{what}[{place}]")
    elif isinstance(mine, np.ndarray):
        assert (mine.dtype, mine.shape) == (other.dtype, other.shape), what
        if mine.dtype in (np.float64, np.float32):
            scale = max(1.0, float(np.abs(other[np.isfinite(other)]).max(initial=0.0)))
            np.testing.assert_allclose(mine, other, rtol=RELATIVE, atol=ABSOLUTE * scale, err_msg=what)
        else:
            np.testing.assert_array_equal(mine, other, err_msg=what)
    elif isinstance(mine, str):
        assert mine == other, what
    else:
        assert mine == pytest.approx(other, rel=RELATIVE, abs=ABSOLUTE), what


@pytest.mark.parametrize("name", kernel_names())
def test_a_compiled_kernel_says_what_its_twin_says(
    name: str, compiled: ModuleType, shared_data: Path
) -> None:
    calls = recorded_calls(shared_data)[name]
    assert calls, "the detector does not use it"
    for place, call in enumerate(calls):
        assert_alike(getattr(compiled, name)(*call), twin_of(name)(*call), f"{name}, call {place}")


@pytest.mark.parametrize("name", kernel_names())
def test_both_refuse_what_is_no_such_array_in_the_same_words(
    name: str, compiled: ModuleType, shared_data: Path
) -> None:
    call = recorded_calls(shared_data)[name][0]
    num_refused = 0
    for spoilt in spoilt_calls(call):
        messages = []
        for kernel in (twin_of(name), getattr(compiled, name)):
            with pytest.raises(ValueError, match=r"^\w+(\[\d\])?: expected .*, got ") as refusal:
                kernel(*spoilt)
            messages.append(str(refusal.value))
        assert messages[0] == messages[1]
        num_refused += 1
    assert num_refused >= 4


@pytest.mark.parametrize("name", kernel_names())
def test_arrays_may_be_read_only(name: str, compiled: ModuleType, shared_data: Path) -> None:
    call = changed_arrays(recorded_calls(shared_data)[name][0], read_only)
    for kernel in (twin_of(name), getattr(compiled, name)):
        kernel(*call)


def read_only(array: np.ndarray) -> np.ndarray:
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def spoilt_calls(call: Call) -> list[Call]:
    """Return the call with each of its arrays spoilt in each way that must be refused."""
    spoilt = []
    for place, argument in enumerate(call):
        parts = argument if is_arrays(argument) else (argument,)
        for index, part in enumerate(parts):
            if not isinstance(part, np.ndarray):
                continue
            wrong = [
                part.astype(np.complex64),
                part.astype(part.dtype.newbyteorder(">")) if part.dtype.itemsize > 1 else part.astype(">i8"),
                part[..., None],
                np.repeat(part, 2, axis=-1)[..., ::2],
                unaligned(part),
                part.tolist(),
            ]
            for one in wrong:
                changed = one if not is_arrays(argument) else (*parts[:index], one, *parts[index + 1 :])
                spoilt.append((*call[:place], changed, *call[place + 1 :]))
    return spoilt


def is_arrays(argument: Any) -> bool:
    return isinstance(argument, tuple) and any(isinstance(part, np.ndarray) for part in argument)


def unaligned(array: np.ndarray) -> np.ndarray:
    """Return the array at an odd address, or as bytes where that is no fault."""
    if array.dtype.itemsize == 1:
        return array.astype(np.int16)
    memory = np.zeros(array.nbytes + 1, dtype=np.uint8)
    moved = memory[1:].view(array.dtype).reshape(array.shape)
    moved[...] = array
    return moved


def changed_arrays(call: Call, change: Any) -> Call:
    def changed(argument: Any) -> Any:
        if is_arrays(argument):
            return tuple(changed(part) for part in argument)
        return change(argument) if isinstance(argument, np.ndarray) else argument

    return tuple(changed(argument) for argument in call)

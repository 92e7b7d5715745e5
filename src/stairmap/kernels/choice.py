"""Choose between the compiled kernels and their NumPy twins, once, when stairmap is imported.

The compiled module is used where it was built and belongs to these sources. ``STAIRMAP_KERNELS=numpy`` in the
environment takes the twins all the same.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

VARIABLE = "STAIRMAP_KERNELS"
"""Environment variable that forces a variant: ``numpy`` or ``compiled``."""

COMPILED_FILE = "STAIRMAP_COMPILED"
"""Environment variable that names another build of the module: ``make sanitize`` uses it."""

_SOURCES = Path(__file__).parent / "cpp"

_HOW = "install a C++ compiler and the Python headers (Debian, Ubuntu: apt install g++ python3-dev), then "


def _source_sum() -> str | None:
    """Sum of the C++ sources beside this package, as CMake takes it; ``None`` where there are none."""
    paths = sorted([*_SOURCES.glob("*.cpp"), *_SOURCES.glob("*.hpp")])
    if not paths:
        return None
    sums = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    return hashlib.sha256("".join(sums).encode()).hexdigest()


def load_compiled() -> ModuleType:
    """Import the compiled module: the one built into this package, or the file that ``COMPILED_FILE`` names.

    Raises
    ------
    ImportError
        If there is none, or it does not load.
    """
    name, path = "stairmap.kernels._compiled", os.environ.get(COMPILED_FILE)
    if not path:
        return importlib.import_module(name)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{COMPILED_FILE} names no extension module: {path}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _find_module() -> tuple[ModuleType | None, str]:
    """The compiled module, or why it is not used and what to do."""
    wanted = os.environ.get(VARIABLE, "").strip().lower()
    if wanted == "numpy":
        return None, f"{VARIABLE}=numpy asks for them"
    expected = _source_sum()
    again = "reinstall stairmap" if expected is None else "run: make kernels"
    try:
        module = load_compiled()
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError):
            return None, f"the compiled ones were not built; {_HOW}{again}"
        return None, f"the compiled ones do not load ({error}); {again}"
    if expected is not None and expected != module.SOURCE_SUM:
        return None, f"the compiled ones are of other sources; {again}"
    return module, ""


_MODULE, _REASON = _find_module()

VARIANT = "NumPy" if _MODULE is None else "compiled"
"""Which kernels are used."""


def describe_kernels() -> str:
    """Return which kernels are used, and if not the compiled ones, why, and what to install."""
    return VARIANT if _MODULE is not None else f"{VARIANT}, several times slower: {_REASON}"


def chosen(twin: Kernel) -> Kernel:
    """Return the compiled kernel of a twin's name, or the twin where the compiled ones are not used."""
    return twin if _MODULE is None else cast(Kernel, getattr(_MODULE, twin.__name__))

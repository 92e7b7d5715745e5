"""The one function that travels to dask workers by value, so that schedulers need no stairmap.

Schedulers unpickle what they hand on. All that is ours travels as bytes, which only workers unpickle.
"""

from __future__ import annotations

from collections.abc import Callable

RunPayload = Callable[[bytes, list[bytes]], bytes]


def make_run_payload() -> RunPayload:
    """Return a function that calls a pickled (function, arguments) and pickles the result.

    Its second argument, where it is not empty, are the pickled results of other such calls, which become one
    more argument. Being made here, not found by a name, it is pickled by value.
    """

    def run_payload(payload: bytes, parts: list[bytes]) -> bytes:
        import pickle  # noqa: PLC0415 - by value, it brings no module

        function, arguments = pickle.loads(payload)
        results = [pickle.loads(part) for part in parts]
        return pickle.dumps(function(*arguments, *([results] if results else [])))

    return run_payload

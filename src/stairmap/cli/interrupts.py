"""Ctrl-C, SIGTERM and SIGHUP, noted instead of obeyed at once, so that a run can write what it has so far."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Interrupt:
    """Becomes true when the first signal arrives.

    Attributes
    ----------
    signal_number
        The signal; ``None`` before it.
    """

    def __init__(self) -> None:
        self.signal_number: int | None = None

    def __bool__(self) -> bool:
        return self.signal_number is not None

    @property
    def exit_code(self) -> int:
        """Exit code that shells expect: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP, 0 without one."""
        return 0 if self.signal_number is None else 128 + self.signal_number

    def handle(self, signal_number: int, _stack_frame: FrameType | None) -> None:
        """Note the first signal; at the second one leave at once.

        Raises
        ------
        SystemExit
            At the second signal.
        """
        if self:
            raise SystemExit(128 + signal_number)
        self.signal_number = signal_number


@contextmanager
def noted_interrupts() -> Iterator[Interrupt]:
    """Note SIGINT, SIGTERM and SIGHUP while the context lasts; the handlers before are restored at its end.

    SIGHUP, which a terminal sends when its connection is lost, stays ignored under nohup.
    """
    interrupt = Interrupt()
    if threading.current_thread() is not threading.main_thread():
        yield interrupt  # Python lets only the main thread handle signals
        return
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, interrupt.handle) for number in numbers}
    try:
        yield interrupt
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

"""Ctrl-C that is not lost: some libraries catch everything while they are being imported."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_pressed: list[int] = []


@contextmanager
def remembered() -> Iterator[None]:
    """While this lasts, Ctrl-C raises KeyboardInterrupt as ever and is also kept in mind for :func:`check`."""
    _pressed.clear()
    # Only the main thread may set handlers; and who ignores interrupts (nohup) goes on doing so.
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return
    before = signal.signal(signal.SIGINT, _press)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def pressed() -> bool:
    """Whether Ctrl-C was pressed, even where nothing came of it."""
    return bool(_pressed)


def check() -> None:
    """Raises KeyboardInterrupt where one was swallowed."""
    if _pressed:
        raise KeyboardInterrupt


def _press(number: int, frame: FrameType | None) -> None:
    _pressed.append(number)
    raise KeyboardInterrupt

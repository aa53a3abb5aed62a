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
    """While this lasts, Ctrl-C raises KeyboardInterrupt as ever and is also kept in mind for :func:`check`.

    In another thread than the main one, which alone hears of it, this changes nothing.
    """
    # Only the main thread may set handlers, and only its own new run may forget what was pressed.
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _pressed.clear()
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as under nohup: it stays so
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
    """Raises KeyboardInterrupt where one was swallowed; in any thread, so that work for an ended run ends too."""
    if _pressed:
        raise KeyboardInterrupt


def _press(number: int, frame: FrameType | None) -> None:
    _pressed.append(number)
    raise KeyboardInterrupt

"""Keeps the chatter of file-reading libraries off the user's terminal: what matters is said once, as a LabError."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import warnings
from collections.abc import Iterator


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Warnings of numpy and Pillow and log lines of trimesh and PIL are dropped inside."""
    silent = logging.NullHandler()  # without any handler, Python's last resort prints to stderr
    logs = [logging.getLogger("trimesh"), logging.getLogger("PIL")]
    for log in logs:
        log.addHandler(silent)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for log in logs:
            log.removeHandler(silent)


@contextlib.contextmanager
def native_quiet() -> Iterator[None]:
    """Like :func:`quiet`, and what native code writes to stderr (RPly inside open3d does) is dropped too."""
    sys.stderr.flush()
    saved = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        with quiet():
            yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)

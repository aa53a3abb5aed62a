"""What is printed while something runs, by whatever code of the process."""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
from collections.abc import Callable


def messages_of(work: Callable[[], object]) -> list[str]:
    """The lines that `work` and every library below it print, which do not reach the screen, and its error, if any."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    with tempfile.TemporaryFile() as file:
        try:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            try:
                work()
            except Exception:
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            for number, original in enumerate(kept, 1):
                os.dup2(original, number)
                os.close(original)
        file.seek(0)
        return file.read().decode("utf-8", "replace").splitlines()

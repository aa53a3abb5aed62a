"""The one exception for bad input, and the nearest-name helper its messages use."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class LabError(ValueError):
    """Bad input: what was given, what is wrong with it, what to do.

    The command line prints the message alone and exits with code 2.
    """


def nearest(word: str, names: Iterable[str]) -> str:
    """``"; did you mean 'alpha'?"`` for the closest of `names`, or ``""`` when none is close."""
    match = difflib.get_close_matches(word, list(names), n=1, cutoff=0.5)
    return f"; did you mean {match[0]!r}?" if match else ""

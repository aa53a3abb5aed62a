"""Where what took long to make is kept from one run to the next."""

from __future__ import annotations

import os
from pathlib import Path


def cache_root() -> Path:
    """``LAB_CACHE``, or ``many-lights-lab`` in the user's cache folder."""
    given = os.environ.get("LAB_CACHE", "")
    home = os.environ.get("XDG_CACHE_HOME", "") or str(Path.home() / ".cache")
    return Path(given) if given else Path(home) / "many-lights-lab"

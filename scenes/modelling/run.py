"""How a make.py is run: into its own folder, or into the one given."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path


def run(make: Callable[[Path], str], script: str) -> None:
    """Calls `make(folder)` with the folder named on the command line (`script`'s own by default); prints its report."""
    parser = argparse.ArgumentParser(
        description=f"Makes the files of the scene '{Path(script).resolve().parent.name}'."
    )
    parser.add_argument("folder", nargs="?", type=Path, default=Path(script).resolve().parent, help="where to write")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    print(make(folder))

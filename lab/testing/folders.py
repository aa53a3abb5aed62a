"""The evidence folder of the test that runs: made when something is put in it, kept only if the test fails."""

from __future__ import annotations

import hashlib
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

_LONGEST = 80

_running: list[Folder] = []
# A stack: a test of pytest plugins runs pytest inside a test.


@dataclass
class Folder:
    """One test's evidence.

    Attributes:
        test: pytest's id of the test.    root: the folder of all evidence.    path: this test's, under `root`.
        keep: the test failed.

    """

    test: str
    root: Path
    path: Path
    keep: bool = False

    def make(self) -> Path:
        """The folder, made if need be. A root made here keeps itself out of version control."""
        fresh = not self.root.exists()
        self.path.mkdir(parents=True, exist_ok=True)
        if fresh:
            (self.root / ".gitignore").write_text("# Made by many-lights-lab.\n*\n", encoding="utf-8")
        return self.path

    def remove(self) -> None:
        """Removes the folder, and those above it that are left empty, up to the root."""
        if not self.path.is_dir():
            return
        shutil.rmtree(self.path, ignore_errors=True)
        try:
            for folder in self.path.parents:
                if folder == self.root:
                    break
                folder.rmdir()
            if [entry.name for entry in self.root.iterdir()] == [".gitignore"]:
                shutil.rmtree(self.root, ignore_errors=True)
        except OSError:  # something else lies there
            return


def begin(test: str, root: Path) -> None:
    """`test` starts; what an earlier run left of it goes."""
    folder = Folder(test, root, root / relative_path(test))
    folder.remove()
    _running.append(folder)


def failed(test: str) -> None:
    """A part of `test` (set-up, call or clean-up) failed."""
    for folder in reversed(_running):
        if folder.test == test:
            folder.keep = True
            return


def end(test: str) -> None:
    """`test` is over. Ids that never began are none of ours (a process that only reports of other processes' tests)."""
    if any(folder.test == test for folder in _running):
        while (folder := _running.pop()).test != test:
            pass
        if not folder.keep:
            folder.remove()


def current() -> Folder | None:
    """The folder of the test that runs; None outside pytest."""
    return _running[-1] if _running else None


def relative_path(test: str) -> Path:
    """A path for a test's id, ``tests/test_a.py::test_b[1-x]`` to ``tests/test_a.py/test_b[1-x]``.

    What no file name should hold is replaced, and long names are cut; a short digest then keeps the path unique.
    """
    head, bracket, values = test.partition("[")
    names = [name for part in head.split("::") for name in part.split("/") if name]
    names[-1:] = [(names or ["test"])[-1] + bracket + values]
    safe = [re.sub(r"[^\w.,=+()\[\]-]", "-", name)[:_LONGEST] for name in names]
    safe = [name if name.strip(".") else "_" for name in safe]
    if safe != names:
        safe[-1] += "-" + hashlib.sha256(test.encode()).hexdigest()[:8]
    return Path(*safe)

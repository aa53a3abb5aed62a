"""A mutant: one formula of the tree, broken on purpose, and the tests that must notice."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).with_name("mutants.toml")


@dataclass(frozen=True)
class Mutant:
    """`file` with the one occurrence of `source` replaced; each of `tests` must fail in at least one of its cases.

    Attributes:
        name: for people and ``--only``.
        file: from the top of the repository: C++ (the core is built anew), Slang or Python.
        source, replacement: exact text; `source` occurs exactly once, so that the table cannot rot silently.
        tests: ``tests/folder/test_file.py::test_function``.
    """

    name: str
    file: str
    source: str
    replacement: str
    tests: tuple[str, ...]

    @property
    def needs_the_core_built(self) -> bool:
        """Whether it is in C++: Python runs as it is, and the engine compiles its shaders by itself."""
        return not self.file.endswith((".py", ".slang"))

    def problems(self, top: Path = ROOT) -> list[str]:
        """What is wrong with this entry in the tree at `top`."""
        path = top / self.file
        if not path.is_file():
            return [f"{self.name}: there is no {self.file}"]
        found = path.read_text(encoding="utf-8").count(self.source)
        wrong = [] if found == 1 else [f"{self.name}: its source text occurs {found} times in {self.file}, not once"]
        if self.source == self.replacement:
            wrong.append(f"{self.name}: the replacement is the source text")
        if not self.tests:
            wrong.append(f"{self.name}: no test is named")
        for test in self.tests:
            page, _, function = test.partition("::")
            if not (top / page).is_file() or f"def {function}(" not in (top / page).read_text(encoding="utf-8"):
                wrong.append(f"{self.name}: there is no {test}")
        return wrong

    def apply(self, top: Path) -> str:
        """Breaks the formula in the tree at `top`; returns the file's text as it was."""
        path = top / self.file
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(self.source, self.replacement), encoding="utf-8")
        return text


def load() -> list[Mutant]:
    """The mutants of ``mutants.toml``."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutant"]
    return [Mutant(**row | {"tests": tuple(row["tests"])}) for row in rows]

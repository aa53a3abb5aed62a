"""The table of mutants fits the tree: a formula that is moved or reworded takes its mutant along."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter

import pytest

from .mutant import ROOT, Mutant, load

MUTANTS = load()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_each_mutant_can_be_made(mutant: Mutant) -> None:
    """Its source text occurs exactly once, and the tests that it names are there."""
    assert mutant.problems() == []


def test_names_are_unique() -> None:
    assert [name for name, count in Counter(mutant.name for mutant in MUTANTS).items() if count > 1] == []


def test_every_statistical_test_has_a_mutant_that_it_must_catch() -> None:
    named = {test for mutant in MUTANTS for test in mutant.tests}
    for page in sorted((ROOT / "tests" / "statistical").glob("test_*.py")):
        tree = ast.parse(page.read_text(encoding="utf-8"))
        functions = [node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        missing = {f"tests/statistical/{page.name}::{name}" for name in functions if name.startswith("test_")} - named
        assert not missing, "give each a mutant in tests/mutants/mutants.toml and run 'make mutants'"


def test_a_table_that_does_not_fit_is_refused(tmp_path) -> None:
    """What the first test relies on: each way to be wrong is named."""
    (tmp_path / "formula.h").write_text("return f / g; // f / g\n")
    (tmp_path / "test_it.py").write_text("def test_it() -> None: ...\n")

    def problems(source="return f / g;", replacement="return g / f;", file="formula.h", tests=("test_it.py::test_it",)):
        return Mutant("m", file, source, replacement, tests).problems(tmp_path)

    assert problems() == []
    assert "occurs 2 times" in problems(source="f / g")[0]
    assert "occurs 0 times" in problems(source="f * g")[0]
    assert "no other.h" in problems(file="other.h")[0]
    assert "replacement" in problems(replacement="return f / g;")[0]
    assert "no test" in problems(tests=())[0]
    assert "there is no test_it.py::test_that" in problems(tests=("test_it.py::test_that",))[0]
    assert "there is no test_x.py" in problems(tests=("test_x.py::test_it",))[0]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "tests" / "mutants" / "run.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_runner_lists_its_mutants() -> None:
    done = run("--list")
    assert done.returncode == 0 and len(done.stdout.splitlines()) == len(MUTANTS)


def test_the_runner_knows_its_mutants() -> None:
    done = run("--only", "lobe q")
    assert done.returncode == 1 and "no mutant is called lobe q" in done.stdout

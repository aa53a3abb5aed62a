"""Where evidence lies, and that it stays for failing tests only."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from lab.testing import folders

from .inner_pytest import evidence, load_everything, run

pytest_plugins = "pytester"

Run = Callable[..., pytest.RunResult]


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """All modules, before the first inner run."""
    load_everything(tmp_path_factory.mktemp("loading"))


@pytest.fixture
def inner(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs pytest on a text of tests."""
    return lambda body, *args: run(pytester, monkeypatch, body, *args)


def test_the_evidence_folder_stays_where_a_test_fails(inner: Run, pytester: pytest.Pytester) -> None:
    body = """
        FAIL = True

        @pytest.fixture
        def breaks_at_the_end():
            yield
            assert not FAIL

        def test_passes(lab_evidence):
            (lab_evidence / "a.txt").write_text("a")

        @pytest.mark.parametrize("name", ["b", "../c"])
        def test_fails(lab_evidence, name):
            (lab_evidence / "b.txt").write_text(name)
            assert not FAIL

        def test_clean_up_fails(lab_evidence, breaks_at_the_end):
            (lab_evidence / "d.txt").write_text("d")
    """
    inner(body).assert_outcomes(passed=2, failed=2, errors=1)
    left = evidence(pytester)
    assert len(left) == 4 and left[0] == ".gitignore"
    assert {"test_experiment.py/test_clean_up_fails/d.txt", "test_experiment.py/test_fails[b]/b.txt"} < set(left)
    assert sum(path.startswith("test_experiment.py/test_fails[..-c]-") for path in left) == 1
    inner(body.replace("FAIL = True", "FAIL = False")).assert_outcomes(passed=4)
    assert not (pytester.path / ".lab-evidence").exists(), "what an earlier run left is gone, and so is the folder"


def test_another_evidence_folder_keeps_what_is_not_ours(inner: Run, pytester: pytest.Pytester) -> None:
    (pytester.path / "mine").mkdir()
    (pytester.path / "mine" / "notes.txt").write_text("keep me")
    body = "def test_fails(lab_evidence):\n    (lab_evidence / 'x').write_text('x')\n    assert {}\n"
    inner(body.format(False), "--lab-evidence", "mine").assert_outcomes(failed=1)
    assert evidence(pytester, "mine") == ["notes.txt", "test_experiment.py/test_fails/x"]
    inner(body.format(True), "--lab-evidence", "mine").assert_outcomes(passed=1)
    assert evidence(pytester, "mine") == ["notes.txt"]
    assert [path.name for path in (pytester.path / "mine").iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("test", "path"),
    [
        ("tests/test_a.py::test_b", "tests/test_a.py/test_b"),
        ("test_a.py::TestC::test_b[1-x.y=2]", "test_a.py/TestC/test_b[1-x.y=2]"),
        ("test_a.py::test_b[a/b::c]", r"test_a.py/test_b\[a-b--c\]-[0-9a-f]{8}"),
        ("../up/test_a.py::test_b", r"_/up/test_a.py/test_b-[0-9a-f]{8}"),
        ("test_a.py::test_b[..]", "test_a.py/test_b[..]"),
        ("test_a.py::test_b[" + 200 * "x" + "]", r"test_a.py/test_b\[x{73}-[0-9a-f]{8}"),
        ("", r"test-[0-9a-f]{8}|test"),
    ],
)
def test_every_test_has_a_folder_under_the_root(test: str, path: str) -> None:
    found = str(folders.relative_path(test))
    assert found == path or re.fullmatch(path, found), found


def test_different_tests_have_different_folders() -> None:
    ids = [
        "a.py::t[x/y]",
        "a.py::t[x:y]",
        "a.py::t[x-y]",
        "a.py::t[x y]",
        "a.py::t[../x]",
        "a/../b.py::t",
        "a/_/b.py::t",
    ]
    assert len({folders.relative_path(test) for test in ids}) == len(ids)


def test_reports_of_other_processes_tests_touch_nothing(tmp_path: Path) -> None:
    """The process that collects the reports of parallel ones hears of tests that it does not run."""
    (tmp_path / "a.py" / "t").mkdir(parents=True)
    before = folders.current()
    folders.failed("a.py::t")
    folders.end("a.py::t")
    assert folders.current() is before and (tmp_path / "a.py" / "t").is_dir()
    folders.begin("a.py::t", tmp_path)
    folders.begin("inner.py::never ends", tmp_path)
    folders.end("a.py::t")
    assert folders.current() is before


def test_a_test_starts_with_an_empty_folder_and_only_its_own_failure_keeps_it(tmp_path: Path) -> None:
    old = tmp_path / "a.py" / "t" / "old.png"
    old.parent.mkdir(parents=True)
    old.write_text("of an earlier run")
    folders.begin("a.py::t", tmp_path)
    assert not old.exists()
    outer = folders.current()
    assert outer
    (outer.make() / "new.png").write_text("of this run")
    folders.begin("inner.py::t", tmp_path)
    folders.failed("inner.py::t")
    folders.end("inner.py::t")
    folders.failed("another.py::t")
    folders.end("a.py::t")
    assert not outer.path.exists()

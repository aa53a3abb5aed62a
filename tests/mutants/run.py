"""Are the tests able to fail? Breaks one formula at a time in a copy of the tree, and demands that they do.

    make mutants                                       all of tests/mutants/mutants.toml
    python tests/mutants/run.py --only NAME [NAME ...] some
    python tests/mutants/run.py --list                 their names

The C++ core, the shaders and the package are copied to a scratch folder and built once (where only shaders and
Python are to be broken, the installed core is taken); the unbroken copy must pass. Then, for each mutant, the text is
replaced, what depends on it is compiled again (shaders by the tests themselves, which need a Vulkan device: make
software-vulkan), and every test that the mutant names must fail in at least one of its cases. Exit code 1 if a mutant
survives, if it does not compile, or if its source text is no longer found exactly once.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from mutant import ROOT, TABLE, Mutant, load

COPIED = ("core_cpp", "lab", "shaders", "tests", "scenes", "pyproject.toml")
PATIENCE_S = 600.0


class BrokenError(Exception):
    """The copy can not be judged: it does not compile, or its tests do not run."""


def say(text: str, end: str = "\n") -> None:
    sys.stdout.write(text + end)
    sys.stdout.flush()


class Copy:
    """A copy of the tree in `top`, with a core of its own."""

    def __init__(self, top: Path) -> None:
        self.top = top
        left_out = shutil.ignore_patterns("__pycache__", "*.so", "*.pyd", "*.tmp")
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, top / name, ignore=left_out)
            else:
                shutil.copy2(source, top / name)

    def _run(self, *command: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
        pipe = subprocess.PIPE
        with subprocess.Popen(
            command, cwd=self.top, env=environment, stdout=pipe, stderr=pipe, text=True, start_new_session=True
        ) as process:
            try:
                output, errors = process.communicate(timeout=PATIENCE_S)
            except BaseException as reason:
                # It is asked to end, not killed: ninja ends its compilers, which would go on writing into a folder
                # that is about to go.
                os.killpg(process.pid, signal.SIGTERM)
                try:
                    process.wait(timeout=20)
                except subprocess.TimeoutExpired:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
                if isinstance(reason, subprocess.TimeoutExpired):
                    raise BrokenError(f"{Path(command[0]).name} took more than {PATIENCE_S:.0f} s") from None
                raise
        return subprocess.CompletedProcess(command, process.returncode, output, errors)

    def configure(self) -> None:
        found = self._run(sys.executable, "-m", "pybind11", "--cmakedir")
        if found.returncode:
            raise BrokenError(f"pybind11 is not installed beside this Python:\n{found.stderr[-1000:]}")
        done = self._run(
            tool("cmake"), "-S", "core_cpp", "-B", "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
            f"-DCMAKE_MAKE_PROGRAM={tool('ninja')}", f"-DPython_EXECUTABLE={sys.executable}",
            f"-Dpybind11_DIR={found.stdout.strip()}", f"-DCMAKE_LIBRARY_OUTPUT_DIRECTORY={self.top / 'lab'}",
        )  # fmt: skip
        if done.returncode:
            raise BrokenError(f"cmake failed:\n{done.stderr[-3000:]}")

    def build(self) -> None:
        done = self._run(tool("ninja"), "-C", "build", "_core")
        if done.returncode:
            errors = [line for line in done.stdout.splitlines() if "error" in line]
            raise BrokenError("it does not compile:\n" + "\n".join(errors[:10]))

    def take_core(self) -> None:
        """The core that is installed here, for mutants that leave it as it is."""
        found = importlib.util.find_spec("lab._core")
        if found is None or found.origin is None:
            raise BrokenError("the core is not built; run 'make test' first")
        shutil.copy2(found.origin, self.top / "lab")

    def failing(self, tests: list[str]) -> set[str]:
        """Those of `tests` that fail in any of their cases."""
        report = self.top / "report.xml"
        report.unlink(missing_ok=True)
        # -S: without it, the editable installation would hand out the tree's own package instead of this copy.
        paths = [str(self.top), *(path for path in sys.path if Path(path).name == "site-packages")]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "PYTHONDONTWRITEBYTECODE": "1",
            "LAB_CACHE": str(self.top / "cache"),  # no broken shader goes into the user's
        }
        done = self._run(
            sys.executable, "-S", "-m", "pytest", "-q", "-p", "no:cacheprovider", "--tb=no",
            f"--junitxml={report}", *tests, environment=environment,
        )  # fmt: skip
        if done.returncode not in (0, 1) or not report.is_file():
            output = (done.stdout + done.stderr)[-3000:]
            raise BrokenError(f"its tests do not run (exit code {done.returncode}):\n{output}")
        found = set()
        for case in ElementTree.parse(report).iter("testcase"):
            test = case.get("classname", "").replace(".", "/") + ".py::" + re.sub(r"\[.*", "", case.get("name", ""))
            if case.find("error") is not None or case.find("skipped") is not None:
                raise BrokenError(f"{test} did not run: error or skip in its set-up")
            if case.find("failure") is not None:
                found.add(test)
        return found


def tool(name: str) -> str:
    """A build tool of this environment, or of the system."""
    path = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if path is None:
        raise BrokenError(f"{name} is not installed; run 'make test' first")
    return path


def survivors_of(mutant: Mutant, copy: Copy) -> list[str]:
    """The tests that the mutant names and that pass all the same."""
    text = mutant.apply(copy.top)
    try:
        if mutant.needs_the_core_built:
            copy.build()
        failing = copy.failing(list(mutant.tests))
    finally:
        (copy.top / mutant.file).write_text(text, encoding="utf-8")
    return [test for test in mutant.tests if test not in failing]


def judge(mutants: list[Mutant], copy: Copy) -> int:
    """Builds, checks the unbroken copy, then breaks it; returns how many mutants were not caught."""
    start = time.perf_counter()
    if any(mutant.needs_the_core_built for mutant in mutants):
        say("building the core ... ", end="")
        copy.configure()
        copy.build()
        say(f"{time.perf_counter() - start:.0f} s")
    else:
        copy.take_core()
    tests = sorted({test for mutant in mutants for test in mutant.tests})
    say(f"unbroken: {len(tests)} tests ... ", end="")
    failing = copy.failing(tests)
    if failing:
        raise BrokenError("they fail without any mutant: " + ", ".join(sorted(failing)))
    say("pass")

    missed = 0
    width = max(len(mutant.name) for mutant in mutants)
    for number, mutant in enumerate(mutants, 1):
        begin = time.perf_counter()
        say(f"{number:3}/{len(mutants)}  {mutant.name:<{width}}  ", end="")
        try:
            survivors = survivors_of(mutant, copy)
            verdict = f"caught by {len(mutant.tests)}" if not survivors else "NOT CAUGHT by " + ", ".join(survivors)
        except BrokenError as problem:
            survivors, verdict = ["?"], f"BROKEN: {problem}"
        missed += bool(survivors)
        say(f"{time.perf_counter() - begin:4.0f} s  {verdict}")
    say(f"{len(mutants) - missed} of {len(mutants)} mutants caught in {(time.perf_counter() - start) / 60:.1f} min")
    return missed


def chosen(mutants: list[Mutant], only: list[str]) -> list[Mutant]:
    """Those called `only`, or all, if they fit the tree."""
    unknown = sorted(set(only) - {mutant.name for mutant in mutants})
    if unknown:
        raise BrokenError(f"no mutant is called {', '.join(unknown)}; --list names them all")
    wanted = [mutant for mutant in mutants if not only or mutant.name in only]
    problems = [problem for mutant in wanted for problem in mutant.problems()]
    if problems:
        raise BrokenError("\n  ".join([f"{TABLE.name} does not fit the tree:", *problems]))
    return sorted(wanted, key=lambda mutant: mutant.file)  # neighbours share what is compiled again


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="only these mutants")
    parser.add_argument("--list", action="store_true", help="print the mutants and what they break")
    arguments = parser.parse_args()
    if arguments.list:
        for mutant in load():
            say(f"{mutant.name}: {mutant.file}, {len(mutant.tests)} tests")
        return 0
    os.nice(10)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the scratch folder goes, too
    try:
        mutants = chosen(load(), arguments.only)
        with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
            return 1 if judge(mutants, Copy(Path(folder))) else 0
    except BrokenError as problem:
        say(f"mutants: {problem}")
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())

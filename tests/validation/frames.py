"""Renders whole frames under Vulkan's validation layers, which must have nothing to say.

    make validate-vulkan                            in a Debian 13 where this machine's layers are too old
    python -m tests.validation.frames               with this machine's layers
    python -m tests.validation.frames --checks gpu --only lamps

Three runs: what the layers check by default; hazards between the commands of a queue (``sync``); and what shaders read
and write beyond their buffers (``gpu``: every shader is instrumented). Each first makes a mistake on purpose, which the
layers must report: so silence means something. Exit code 1 if they report anything else.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from .cases import CASES, render
from .messages import messages_of
from .mistakes import MISTAKES

CHECKS = {
    "core": {"enable_message_limit": "false"},
    "sync": {"enable_message_limit": "false", "validate_sync": "true", "syncval_shader_accesses_heuristic": "true"},
    "gpu": {"enable_message_limit": "false", "gpuav_enable": "true", "validate_core": "false"},
}
"""Settings of the layer ``khronos_validation``."""


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def run(checks: str, only: str) -> int:
    """All cases in this process; returns how many had messages."""
    from lab.engine.vulkan.device import Gpu

    gpu = Gpu(os.environ.get("LAB_TEST_DEVICE", ""), validate=True)
    failed = 0

    def judge(name: str, work: Callable[[], object], wanted: str = "") -> None:
        nonlocal failed
        start = time.perf_counter()
        found = messages_of(work)
        good = any(wanted in line for line in found) if wanted else not found
        failed += not good
        verdict = "reported" if wanted and good else "NOT REPORTED" if wanted else "silent" if good else "MESSAGES:"
        say(f"{checks:5} {time.perf_counter() - start:5.1f} s  {name}: {verdict}")
        if not good:
            for line in found[:40]:
                say(f"    {line}")

    mistake = MISTAKES[checks]
    judge(mistake.name, lambda: mistake.make(gpu), mistake.message)
    for name, case in CASES.items():
        if only in name:
            judge(name, lambda case=case: render(gpu, case))  # type: ignore[misc]
    found = messages_of(gpu.close)
    failed += bool(found)
    for line in found:
        say(f"    at the end: {line}")
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--checks", choices=list(CHECKS), help="only this run; all by default")
    parser.add_argument("--only", default="", metavar="TEXT", help="only cases whose name has this in it")
    arguments = parser.parse_args()
    if not any(arguments.only in name for name in CASES):
        parser.error(f"--only {arguments.only!r}: no case has this in its name; there are\n  " + "\n  ".join(CASES))
    if arguments.checks and "VK_LAYER_SETTINGS_PATH" in os.environ:
        return 1 if run(arguments.checks, arguments.only) else 0
    failed = False
    for checks in [arguments.checks] if arguments.checks else CHECKS:
        # The loader reads the settings once in a process.
        with tempfile.TemporaryDirectory() as folder:
            settings = Path(folder) / "vk_layer_settings.txt"
            lines = [f"khronos_validation.{name} = {value}" for name, value in CHECKS[checks].items()]
            settings.write_text("\n".join([*lines, ""]), encoding="utf-8")
            environment = os.environ | {"VK_LAYER_SETTINGS_PATH": folder}
            command = [sys.executable, "-m", "tests.validation.frames", "--checks", checks, "--only", arguments.only]
            failed |= subprocess.run(command, env=environment, check=False).returncode != 0
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

"""Finding a Vulkan device: what is missing is said, with what mends it; nothing crashes."""

from __future__ import annotations

import builtins
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import lab
from lab.cli import main
from lab.commands.info import vulkan_devices
from lab.engine import create_engine
from lab.engine.cpu import CpuEngine
from lab.engine.vulkan import adapters as looking
from lab.engine.vulkan.adapters import Adapter, choose_adapter, import_slangpy, open_device
from lab.engine.vulkan.engine import VulkanEngine
from lab.errors import LabError

from .command_line import SMALL, refused

FOUND = [
    Adapter(0, "NVIDIA GeForce RTX 4090", (1,)),
    Adapter(1, "llvmpipe (LLVM 15.0.6, 256 bits)", (2,)),
    Adapter(2, "NVIDIA GeForce RTX 2080", (3,)),
]


@pytest.mark.parametrize(
    ("wanted", "index"),
    [("", 0), ("0", 0), ("2", 2), ("llvmpipe", 1), ("LLVM 15", 1), ("2080", 2), ("nvidia geforce rtx 4090", 0)],
)
def test_a_device_is_named_by_number_or_name(wanted: str, index: int) -> None:
    assert choose_adapter(FOUND, wanted).index == index


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ("7", "--device 7: there is no such Vulkan device.*0 = NVIDIA GeForce RTX 4090"),
        ("nvidia", "--device nvidia: fits 2 devices; name one by its number"),
        ("NVIDIA GeForce RTX 3090", "did you mean 'NVIDIA GeForce RTX"),
        ("9" * 5000, "no such Vulkan device"),
        ("-1", "no such Vulkan device"),
    ],
)
def test_a_device_that_is_not_there_is_refused(wanted: str, message: str) -> None:
    with pytest.raises(LabError, match=message):
        choose_adapter(FOUND, wanted)


def test_no_device_at_all_names_the_software_driver() -> None:
    with pytest.raises(LabError, match=r"no Vulkan device was found.*make software-vulkan"):
        choose_adapter([], "")


@pytest.mark.parametrize(
    ("name", "driver"),
    [("VK_DRIVER_FILES", "none at all"), ("VK_ICD_FILENAMES", "not JSON"), ("VK_DRIVER_FILES", "no driver")],
)
def test_a_driver_that_can_t_be_loaded_is_no_device(gpu: Any, tmp_path: Path, name: str, driver: str) -> None:
    """The loader looks once in a process, so this needs one of its own."""
    described = tmp_path / "icd.json"
    if driver == "not JSON":
        described.write_text('{"file_format_version": "1.0.0", "ICD": {"library_')
    if driver == "no driver":
        library = {"library_path": importlib.util.find_spec("math").origin, "api_version": "1.3.0"}
        described.write_text(json.dumps({"file_format_version": "1.0.0", "ICD": library}))
    others = {key: value for key, value in os.environ.items() if key not in looking.DRIVERS}
    done = subprocess.run(
        [sys.executable, "-c", "from lab.engine.vulkan.adapters import *; choose_adapter(list_adapters(), '')"],
        env=others | {name: str(described)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert f"LabError: no Vulkan device was found ({name}={described}: only that driver" in done.stderr


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ModuleNotFoundError("No module named 'slangpy'", name="slangpy"), "make setup EXTRA=vulkan"),
        (ImportError("libX11.so.6: cannot open shared object file"), r"libX11\.so\.6.*apt-get install libx11-6"),
        (ImportError("libatomic.so.1: cannot open shared object file"), "apt-get install libx11-6 libatomic1"),
    ],
)
def test_a_library_that_can_t_be_loaded_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, error: ImportError, message: str
) -> None:
    real = builtins.__import__

    def failing(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "slangpy":
            raise error
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", failing)
    with pytest.raises(LabError, match=message):
        import_slangpy()


def test_torch_is_not_loaded_with_it(gpu: Any) -> None:
    """That takes seconds, of every command; it can be imported afterwards as if nothing had been."""
    script = "import sys, lab.engine.vulkan.adapters as a; a.import_slangpy(); print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout == "False\n", done.stderr


class Opened:
    """A device with some features."""

    def __init__(self, features: set[str]) -> None:
        self.features, self.closed = features, False

    def has_feature(self, feature: str) -> bool:
        return feature in self.features

    def close(self) -> None:
        self.closed = True


def fake_slangpy(monkeypatch: pytest.MonkeyPatch, device: Any) -> None:
    names = {name: name for name in looking.REQUIRED}
    made = SimpleNamespace(Device=device, DeviceType=SimpleNamespace(vulkan="vulkan"), Feature=SimpleNamespace(**names))
    monkeypatch.setattr(looking, "import_slangpy", lambda: made)


def test_an_old_driver_is_told_from_a_missing_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def device(**_: Any) -> None:
        raise RuntimeError("Failed to create device!\nsomewhere.cpp:280")

    fake_slangpy(monkeypatch, device)
    with pytest.raises(LabError, match=r"RTX 2080: its Vulkan driver can't be used .Failed to create device.*too old"):
        open_device(FOUND[2])


@pytest.mark.parametrize("missing", list(looking.REQUIRED))
def test_each_feature_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    opened = Opened(set(looking.REQUIRED) - {missing})
    fake_slangpy(monkeypatch, lambda **_: opened)
    with pytest.raises(LabError, match=f"lacks {missing} .*lab info.*make software-vulkan"):
        open_device(FOUND[0])
    assert opened.closed


def test_info_lists_the_devices(gpu: Any) -> None:
    lines = vulkan_devices()
    assert f"vulkan device {gpu.adapter.index}: {gpu.adapter.name}: ready" in lines


def test_info_says_what_each_device_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every device has its line, and is closed again; one that can't be opened keeps no other from being listed."""
    devices = [Opened(set(looking.REQUIRED)), None, Opened({"double", "int64", "timestamp_query"})]
    waiting = iter(devices)

    def device(**_: Any) -> Opened:
        made = next(waiting)
        if made is None:
            raise RuntimeError("Vulkan 1.0 is too old!\nsomewhere.cpp:280")
        return made

    pytest.importorskip("slangpy")
    fake_slangpy(monkeypatch, device)
    monkeypatch.setattr(looking, "list_adapters", lambda: FOUND)
    assert vulkan_devices() == [
        "vulkan device 0: NVIDIA GeForce RTX 4090: ready",
        "vulkan device 1: llvmpipe (LLVM 15.0.6, 256 bits): can't be used: Vulkan 1.0 is too old",
        "vulkan device 2: NVIDIA GeForce RTX 2080: lacks ray_tracing, acceleration_structure, atomic_int64",
    ]
    assert devices[0].closed and devices[2].closed


def test_info_says_why_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("slangpy")
    monkeypatch.setattr(looking, "list_adapters", lambda: [])
    assert "make software-vulkan" in vulkan_devices()[0]


@pytest.mark.parametrize("command", ["render", "heatmap"])
def test_a_device_is_for_vulkan_alone(quads: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags = [command, str(quads), "-o", "a", *SMALL, "--device", "0"]
    assert "engine cpu runs on the processor and takes no device" in refused(flags, capsys)


def test_commands_of_the_processor_refuse_the_card(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "works with --engine cpu alone" in refused(
        ["export", str(quads), "-o", "a.npz", "--engine", "vulkan"], capsys
    )


def test_the_library_refuses_alike() -> None:
    with pytest.raises(LabError, match="did you mean 'vulkan'"):
        create_engine("vulcan", None)  # type: ignore[arg-type]
    with pytest.raises(LabError, match="takes no device"):
        create_engine("cpu", None, device="0")  # type: ignore[arg-type]


def test_an_unknown_device_is_refused_before_anything_is_read(
    gpu: Any, quads: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refused(["render", str(quads), "-o", "a", "--engine", "vulkan", "--device", "quantum"], capsys)
    assert "there is no such Vulkan device" in said and gpu.adapter.name in said


def test_the_record_of_a_cpu_run_names_no_device(quads: Path, tmp_path: Path) -> None:
    assert main(["render", str(quads), "-o", str(tmp_path / "a"), "--quiet", *SMALL]) == 0
    assert json.loads((tmp_path / "a.json").read_text())["device"] is None


def test_the_radius_of_a_scene_is_the_core_s(gpu: Any, quads: Path) -> None:
    scene = lab.load_scene(quads)
    engine = VulkanEngine(scene, gpu)
    assert engine.scene_radius == pytest.approx(CpuEngine(scene).scene_radius, rel=1e-6)
    made = engine.build_hierarchy(lab.Lights([[0, 0, 0], [1, 1, 1]], [[1, 1, 1], [2, 2, 2]]), lab.Params())
    assert made.top == 1 and engine.stages_ms()["build_hierarchy"] > 0

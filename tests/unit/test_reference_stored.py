"""References on disk: found again, gone on with, never stale, and no worse for interruptions and damage."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.reference import SETTINGS_THAT_COUNT, Budget, Reference, cache_folder, path_traced, stored

from .referred import SIZE, listed, refer, scene


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "references"


# --- going on --------------------------------------------------------------------------------------------------------

LAYERS = ("direct", "indirect", "direct_variance", "indirect_variance", "colour_variance")


def same(a: Reference, b: Reference) -> bool:
    return all(np.array_equal(getattr(a, layer), getattr(b, layer)) for layer in LAYERS) and a.samples == b.samples


@pytest.mark.parametrize("pixel", ["centre", "area"])
def test_64_and_64_paths_are_128_bit_for_bit(pixel: str) -> None:
    """Any other parts add up to rounding."""
    first = refer(spp=64, pixel=pixel)
    second = refer(spp=128, pixel=pixel)
    assert (first.samples, first.reused, second.samples, second.reused) == (64, 0, 128, 64)
    assert same(second, refer(spp=128, pixel=pixel, cache=False))
    assert second.seconds > first.seconds
    odd = [refer(spp=spp, pixel=pixel, params=Params(seed=5)) for spp in (7, 50)][1]
    whole = refer(spp=50, pixel=pixel, params=Params(seed=5), cache=False)
    for layer in LAYERS:
        np.testing.assert_allclose(getattr(odd, layer), getattr(whole, layer), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("method", SETTINGS_THAT_COUNT)
def test_what_is_there_is_not_computed_again(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    params = Params(vpls=300)
    first = refer(method=method, params=params, spp=32)
    monkeypatch.setattr(CpuEngine, "trace_paths", None)
    monkeypatch.setattr(CpuEngine, "brute_force", None)
    for spp in (32, 8):
        again = refer(method=method, params=params, spp=spp)
        assert same(first, again) and again.reused == 32
        assert (again.unshadowed is None) == (method == "path_tracer")


def test_more_lights_are_drawn_beside_the_earlier_ones() -> None:
    params = Params(vpls=3000)
    first = refer(method="brute_force", params=params, spp=64)
    second = refer(method="brute_force", params=params, spp=128)
    assert (second.reused, second.samples) == (64, 128)
    assert 0.3 < second.indirect_variance.mean() / first.indirect_variance.mean() < 0.7
    assert not np.array_equal(first.indirect, second.indirect)


def test_without_the_cache_nothing_is_kept(folder: Path) -> None:
    refer(cache=False)
    assert not folder.exists()
    assert refer().reused == 0
    assert len(list(folder.iterdir())) == 1
    assert refer(cache=False).reused == 0


def test_the_same_as_the_plain_functions() -> None:
    given = scene()
    plain = path_traced(CpuEngine(given), given.cameras[0], SIZE, budget=Budget(spp=16))
    assert same(plain, refer(given))


# --- interruptions ---------------------------------------------------------------------------------------------------


class Stop:
    """Raises KeyboardInterrupt in the midst of the n-th call of an engine's method, before or after the work."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, method: str, at: int, after: bool) -> None:
        original, self.calls = getattr(CpuEngine, method), 0

        def wrapped(*arguments: Any, **named: Any) -> Any:
            self.calls += 1
            if self.calls == at and not after:
                raise KeyboardInterrupt
            found = original(*arguments, **named)
            if self.calls == at:
                raise KeyboardInterrupt
            return found

        monkeypatch.setattr(CpuEngine, method, wrapped)


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("at", [1, 2, 5])
def test_an_interrupted_path_tracer_goes_on(at: int, after: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.reference.path_tracer._PATHS_A_STEP", 16 * SIZE[0] * SIZE[1])
    with monkeypatch.context() as patch:
        Stop(patch, "trace_paths", at, after)
        with pytest.raises(KeyboardInterrupt):
            refer(spp=128)
    found = refer(spp=128)
    assert found.reused == 16 * (at - 1)
    assert same(found, refer(spp=128, cache=False))


@pytest.mark.parametrize(
    ("method", "at"), [("brute_force", 1), ("brute_force", 4), ("trace_direct", 1), ("trace_compensation", 2)]
)
def test_an_interrupted_sum_goes_on(method: str, at: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the midst of a pass, too: its bands of rows are kept."""
    params = Params(vpls=2000, compensation="path", clamp_distance=0.2)
    for name, value in (("_RAYS_A_BAND", 64.0 * SIZE[0]), ("_PATHS_A_STEP", 20 * SIZE[0] * SIZE[1])):
        monkeypatch.setattr(sys.modules["lab.reference.brute_force"], name, value)
    with monkeypatch.context() as patch:
        stop = Stop(patch, method, at, after=False)
        with pytest.raises(KeyboardInterrupt):
            refer(method="brute_force", params=params, spp=64)
        assert stop.calls == at
    calls = Stop(monkeypatch, "brute_force", 0, after=False)
    found = refer(method="brute_force", params=params, spp=64)
    rows = 0 if method != "brute_force" else SIZE[1] - (at - 1)
    assert calls.calls == rows, "finished rows are not summed again"
    assert same(found, refer(method="brute_force", params=params, spp=64, cache=False))


def test_progress_may_interrupt_too() -> None:
    def stop(share: float, line: str) -> None:
        if share >= 0.5:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lab.reference.path_tracer._PATHS_A_STEP", 16 * SIZE[0] * SIZE[1])
        with pytest.raises(KeyboardInterrupt):
            refer(spp=128, progress=stop)
    assert refer(spp=128).reused == 64


# --- damage ----------------------------------------------------------------------------------------------------------


def damage_truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def damage_empty(path: Path) -> None:
    path.write_bytes(b"")


def damage_text(path: Path) -> None:
    path.write_text("this is no archive")


def damage_bytes(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0xFF
    path.write_bytes(bytes(content))


def damage_missing(path: Path) -> None:
    with np.load(path) as file:
        state = {name: file[name] for name in file.files if name != "samples"}
    np.savez(path, **state)


def damage_shape(path: Path) -> None:
    with np.load(path) as file:
        state = {name: file[name] for name in file.files}
    np.savez(path, **state | {"direct": np.zeros((2, 2, 3))})


def damage_pickled(path: Path) -> None:
    with np.load(path) as file:
        state = {name: file[name] for name in file.files}
    np.savez(path, **state | {"samples": np.array({"a": 1}, dtype=object)})


DAMAGE = [damage_truncated, damage_empty, damage_text, damage_bytes, damage_missing, damage_shape, damage_pickled]


@pytest.mark.parametrize("damage", DAMAGE, ids=lambda f: f.__name__)
def test_a_damaged_file_is_computed_anew(damage: Callable[[Path], None], folder: Path) -> None:
    first = refer()
    path = next(folder.iterdir())
    damage(path)
    again = refer()
    assert again.reused == 0 and same(first, again)
    assert refer().reused == 16, "and replaced"
    assert [p.name for p in folder.iterdir()] == [path.name]


def test_any_damaged_byte_is_noticed(folder: Path) -> None:
    first = refer(spp=2)
    path = next(folder.iterdir())
    content = path.read_bytes()
    rng = np.random.default_rng(1)
    for at in rng.integers(0, len(content), 60):
        damaged = bytearray(content)
        damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(bytes(damaged))
        found = refer(spp=2)
        assert same(first, found), at


def test_a_folder_that_can_not_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "file"))
    with pytest.raises(LabError, match=r"LAB_CACHE.*--no-cache"):
        refer()
    assert refer(cache=False).samples == 16


def test_a_full_disk_costs_no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(stored, "write_all", full)
    assert refer().samples == 16
    assert refer().reused == 0


@pytest.mark.parametrize(
    ("variables", "wanted"),
    [
        ({"LAB_CACHE": "a"}, Path("a/references")),
        ({"XDG_CACHE_HOME": "b"}, Path("b/many-lights-lab/references")),
        ({"HOME": "/c"}, Path("/c/.cache/many-lights-lab/references")),
    ],
)
def test_where_they_are(variables: dict[str, str], wanted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LAB_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == wanted


# --- refusals --------------------------------------------------------------------------------------------------------


def test_refusals() -> None:
    with pytest.raises(LabError, match="path_tracer"):
        refer(method="path_trace")
    with pytest.raises(LabError, match="front"):
        refer(camera="frnt")
    with pytest.raises(LabError, match="compensation"):
        refer(listed(), "brute_force", params=Params(compensation="path"))


def test_too_little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.engine.memory.available_bytes", lambda: 30_000)
    with pytest.raises(LabError, match=r"10x6 pixels"):
        refer()
    with pytest.raises(LabError, match=r"100,000 lights"):
        refer(method="brute_force")
    monkeypatch.setattr("lab.engine.memory.available_bytes", lambda: None)
    assert refer().samples == 16

"""``lab.Renderer`` and threads: its own number of them, and calls from several."""

from __future__ import annotations

import threading
import time
from itertools import pairwise
from typing import Any

import pytest

import lab
from lab import LabError, _core
from lab.engine import STAGES
from lab.params import Params
from lab.records import Frame

from .test_frame import differences
from .test_renderer import CAMERA, SCENE, SIZE, SMALL, fresh


def test_its_threads_are_its_own() -> None:
    before = _core.info()["threads"]
    seen: list[int] = []
    with lab.Renderer(SCENE, threads=before + 1) as renderer:
        assert _core.info()["threads"] == before
        one = renderer.render(CAMERA, SIZE, SMALL, progress=lambda _: seen.append(_core.info()["threads"]))
    assert set(seen) == {before + 1} and _core.info()["threads"] == before
    assert differences(one, lab.render(SCENE, SMALL, camera=CAMERA, size=SIZE, counts=False)) == []


def test_a_worker_renders_with_the_threads_of_the_renderer() -> None:
    before = int(_core.info()["threads"])
    _core.set_threads(before + 2)
    try:
        renderer = lab.Renderer(SCENE)
    finally:
        _core.set_threads(before)
    seen: list[Any] = []

    def work() -> None:
        at_first = _core.info()["threads"]
        frame = renderer.render(CAMERA, SIZE, SMALL, progress=lambda _: seen.append(_core.info()["threads"]))
        with renderer.on_threads():
            seen.append(_core.info()["threads"])
        seen.append(_core.info()["threads"] == at_first)
        seen.append(differences(frame, fresh()))

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()
    renderer.close()
    assert seen[:8] == [before + 2] * 8 and seen[8:] == [True, []]
    assert _core.info()["threads"] == before


def test_threads_take_turns() -> None:
    """Frames asked for at once by several threads come out as if one had come after the other."""
    settings = [SMALL.replace(seed=seed, alpha=0.5 + seed) for seed in range(4)]
    found: dict[int, Frame] = {}
    with lab.Renderer(SCENE) as renderer:

        def work(i: int) -> None:
            for _ in range(3):
                found[i] = renderer.render(CAMERA, SIZE, settings[i])

        workers = [threading.Thread(target=work, args=(i,)) for i in range(4)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
    assert [differences(found[i], fresh(settings[i])) for i in range(4)] == [[]] * 4


def test_other_threads_go_on_while_a_stage_is_at_work() -> None:
    """The core lets go of the interpreter: the inspector answers while a frame is rendered."""
    params = Params(vpls=30_000, filter="bilateral", shadow_samples=8)
    begun: list[tuple[str, float]] = []

    def begin(name: str) -> None:
        begun.append((name, time.perf_counter()))

    def work() -> None:
        renderer.render(CAMERA, (400, 300), params, regenerate=True, progress=begin)
        begin("end")

    awake: dict[str, bool] = dict.fromkeys(STAGES, False)
    with lab.Renderer(SCENE) as renderer:
        for _ in range(5):  # a loaded machine may leave a thread asleep for long
            begun.clear()
            worker = threading.Thread(target=work)
            worker.start()
            ticks = []
            while worker.is_alive():
                ticks.append(time.perf_counter())
                time.sleep(0.0002)
            worker.join()
            for (name, start), (_, end) in pairwise(begun):
                third = (end - start) / 3
                awake[name] |= any(start + third < tick < end - third for tick in ticks)
            if all(awake.values()):
                break
    assert all(awake.values()), awake


@pytest.mark.parametrize("threads", [0, -1, 1.5])
def test_threads_are_checked(threads: Any) -> None:
    with pytest.raises(LabError, match="threads"):
        lab.Renderer(SCENE, threads=threads)

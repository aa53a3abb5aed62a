"""Large arrays: kept between frames while somebody asks for it, and given back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import lab
from lab import _core
from lab.engine.cpu import CpuEngine
from lab.records import GBuffer

SIZE = (640, 480)


@pytest.fixture(scope="module")
def engine() -> CpuEngine:
    return CpuEngine(lab.load_scene("scenes/cornell/scene.toml"))


@pytest.fixture
def kept() -> Iterator[None]:
    _core.keep_buffers()
    yield
    _core.release_buffers()


def gbuffer(engine: CpuEngine) -> GBuffer:
    return engine.render_gbuffer(engine.scene.camera(), SIZE)


def test_nothing_is_kept_unless_asked(engine: CpuEngine) -> None:
    before = _core.buffer_bytes()
    picture = gbuffer(engine)
    large = picture.position.nbytes
    assert large > 1 << 20
    assert _core.buffer_bytes()["in_use"] >= before["in_use"] + large
    del picture
    assert _core.buffer_bytes() | {"most_in_use": 0} == before | {"most_in_use": 0}
    assert before["kept"] == 0


@pytest.mark.usefixtures("kept")
def test_a_kept_block_is_used_again(engine: CpuEngine) -> None:
    first = gbuffer(engine)
    values = first.position.copy()
    blocks = {array.ctypes.data for array in (first.position, first.normal, first.geometric_normal, first.albedo)}
    del first
    assert _core.buffer_bytes()["kept"] >= values.nbytes
    second = gbuffer(engine)
    assert second.position.ctypes.data in blocks
    np.testing.assert_array_equal(second.position, values)


@pytest.mark.usefixtures("kept")
def test_no_more_is_kept_than_was_in_use(engine: CpuEngine) -> None:
    for width in (1200, 1100, 1000, 900, 800):
        del_me = engine.render_gbuffer(engine.scene.camera(), (width, 400))
        del del_me
        usage = _core.buffer_bytes()
        assert usage["kept"] + usage["in_use"] <= 1.25 * usage["most_in_use"]


def test_all_is_given_back_at_the_end(engine: CpuEngine) -> None:
    _core.keep_buffers()
    _core.keep_buffers()
    gbuffer(engine)
    _core.release_buffers()
    assert _core.buffer_bytes()["kept"] > 0
    _core.release_buffers()
    assert _core.buffer_bytes()["kept"] == 0


def test_releasing_too_often_changes_nothing() -> None:
    _core.release_buffers()
    _core.keep_buffers()
    _core.release_buffers()
    assert _core.buffer_bytes()["kept"] == 0

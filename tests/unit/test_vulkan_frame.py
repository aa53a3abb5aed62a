"""A whole frame on the device: once it is known how many lights paths leave, nothing comes to the host."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.engine.vulkan.buffers import BufferPool
from lab.engine.vulkan.engine import VulkanEngine
from lab.frame import render_frame
from lab.params import Params
from lab.records import Frame

from .vulkan_scenes import engines

SIZE = (48, 27)


def refuse(*_: object) -> Any:
    raise AssertionError("something is read back")


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"interleave": 4},
        {"compensation": "path", "picker": "race"},
        {"shadow_points": "jitter", "filter": "bilateral"},
        {"lighting": "raster"},
        {"construction": "scatter", "gather_range": "half_open", "filter": "none"},
    ],
    ids=str,
)
@pytest.mark.parametrize("counts", [False, True])
def test_nothing_is_read_back_in_a_frame(
    gpu: Any, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], counts: bool
) -> None:
    engine: VulkanEngine = engines(gpu, "gallery")[0]
    params = Params(vpls=300, **change)

    def frame(number: int) -> Frame:
        camera = engine.scene.cameras[0]
        return render_frame(engine, camera, SIZE, params.replace(frame=number), counts=counts)

    first = frame(0)
    with monkeypatch.context() as patched:
        patched.setattr(BufferPool, "download", refuse)
        second = frame(1)
        with pytest.raises(AssertionError, match="something is read back"):
            _ = second.image.colour
    assert not np.array_equal(first.image.colour, second.image.colour)
    np.testing.assert_allclose(second.image.colour.mean(), first.image.colour.mean(), rtol=0.2)
    if counts:
        assert second.lighting.overdraw is not None
        assert second.lighting.overdraw.shape == (second.hierarchy.top + 1, SIZE[1], SIZE[0])
    else:
        assert second.lighting.overdraw is None

"""Records on the device: they read back to what they were made from, and not before somebody looks."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import lab
from lab.engine.vulkan.hierarchy import device_hierarchy, hierarchy_parts
from lab.engine.vulkan.lights import device_lights, lights_parts
from lab.engine.vulkan.records import device_record, parts
from lab.records import Hierarchy, Lights

ARRAYS = [field.name for field in dataclasses.fields(Hierarchy) if field.name != "members"]


def some_lights(count: int = 300) -> Lights:
    rng = np.random.default_rng(1)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[::7] = 0
    return Lights(rng.random((count, 3)), rng.random((count, 3)), normal.astype(np.float32), paths_launched=9)


def test_nothing_is_read_back_before_it_is_looked_at() -> None:
    read: list[str] = []

    def field(name: str) -> Any:
        return lambda: read.append(name) or np.zeros((2, 3), np.float32)

    names = [f.name for f in dataclasses.fields(Lights)]
    record = device_record(Lights, "the buffers", {name: field(name) for name in names})
    assert isinstance(record, Lights) and parts(record) == "the buffers" and not read
    assert record.position is record.position and len(record) == 2
    assert read == ["position"]
    assert parts(some_lights()) is None


def test_a_record_needs_all_its_fields() -> None:
    with pytest.raises(ValueError, match="Lights has the fields position, flux, normal"):
        device_record(Lights, None, {"position": lambda: None})


def test_replacing_a_field_makes_a_plain_record(gpu: Any) -> None:
    lights = some_lights()
    record = device_lights(lights_parts(gpu, lights), 5)
    dimmed = dataclasses.replace(record, flux=lights.flux / 2)
    assert type(dimmed) is Lights and parts(dimmed) is None
    np.testing.assert_array_equal(dimmed.position, lights.position)
    np.testing.assert_array_equal(dimmed.flux, lights.flux / 2)


def test_lights_come_back_as_they_were(gpu: Any) -> None:
    lights = some_lights()
    made = lights_parts(gpu, lights)
    record = device_lights(made, lights.paths_launched)
    assert lights_parts(gpu, record) is made
    for name in ("position", "flux", "normal", "paths_launched"):
        np.testing.assert_array_equal(getattr(record, name), getattr(lights, name))


def test_a_hierarchy_comes_back_as_it_was(gpu: Any) -> None:
    hierarchy = lab.build_hierarchy(some_lights(), lab.Params())
    made = hierarchy_parts(gpu, hierarchy)
    record = device_hierarchy(made)
    assert hierarchy_parts(gpu, record) is made
    for name in ARRAYS:
        want = getattr(hierarchy, name)
        np.testing.assert_array_equal(getattr(record, name), want, err_msg=name)
        assert getattr(record, name).dtype == want.dtype, name
    assert record.top == hierarchy.top and len(record.levels) == len(hierarchy.levels)

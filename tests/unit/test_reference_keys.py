"""What a stored reference is found by: everything that its light depends on, and nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lab.params import SETTINGS, Params
from lab.reference import SETTINGS_THAT_COUNT, stored
from lab.scene.scene import Camera, Mesh, Scene

from .referred import SIZE, listed, refer, scene


def key(
    given: Scene,
    method: str = "path_tracer",
    params: Params | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = SIZE,
    pixel: str = "centre",
) -> str:
    return stored._key(given, method, params or Params(), (camera or given.cameras[0], size, pixel))


def other(value: Any) -> Any:
    """Something else of the same type, as little different as can be."""
    if isinstance(value, np.ndarray):
        changed = value.copy()
        flat = changed.reshape(-1)
        flat[-1] = np.nextafter(flat[-1], 2) if flat.dtype.kind == "f" else flat[-1] ^ 1
        return changed
    if isinstance(value, bool):
        return not value
    if isinstance(value, tuple):
        return (*value[:-1], value[-1] + 1e-9)
    return value + 1 if isinstance(value, int) else value + 1e-9


def changes() -> dict[str, Callable[[], Scene]]:
    """Each way in which one field of one part of the scene can differ."""
    base = scene()
    found: dict[str, Callable[[], Scene]] = {}

    def within(name: str, row: int, field: str, value: Any) -> Callable[[], Scene]:
        def make() -> Scene:
            parts = list(getattr(base, name))
            parts[row] = dataclasses.replace(parts[row], **{field: value})
            return dataclasses.replace(base, **{name: parts})

        return make

    for name in ("meshes", "materials", "suns", "points", "spots"):
        for row, part in enumerate(getattr(base, name)):
            for field in dataclasses.fields(part):
                value = getattr(part, field.name)
                if field.name == "name":
                    continue
                changed = np.zeros((4, 3), np.float32) if value is None else other(value)
                found[f"{name}[{row}].{field.name}"] = within(name, row, field.name, changed)
    found["texture"] = lambda: dataclasses.replace(base, textures=[other(base.textures[0])])
    found["shape of a texture"] = lambda: dataclasses.replace(base, textures=[base.textures[0].reshape(1, 4, 4)])
    for name in ("meshes", "suns", "points", "spots"):
        found[f"one of {name} less"] = lambda name=name: dataclasses.replace(base, **{name: getattr(base, name)[1:]})
    found["no normals"] = within("meshes", 0, "normal", None)
    found["order of meshes"] = lambda: dataclasses.replace(base, meshes=base.meshes[::-1])
    found["a light list"] = listed
    for field in ("position", "flux", "normal"):
        lights = listed().light_list
        assert lights is not None
        changed = getattr(lights, field).copy()
        changed[1] = (0, 0, 1)
        rows = dataclasses.replace(lights, **{field: changed})
        found[f"light_list.{field}"] = lambda rows=rows: listed(rows)
    return found


CHANGES = changes()


def test_every_part_of_a_scene_counts() -> None:
    keys = {name: key(make()) for name, make in CHANGES.items()} | {"itself": key(scene())}
    assert len(keys) > 35
    by_key: dict[str, list[str]] = {}
    for name, value in keys.items():
        by_key.setdefault(value, []).append(name)
    assert [names for names in by_key.values() if len(names) > 1] == []


def test_each_part_of_a_view_counts() -> None:
    base = scene()
    camera = base.cameras[0]
    keys = [
        key(base),
        key(base, "brute_force"),
        key(base, size=(10, 7)),
        key(base, size=(6, 10)),
        key(base, pixel="area"),
        *(
            key(base, camera=dataclasses.replace(camera, **{field: other(getattr(camera, field))}))
            for field in ("eye", "target", "up", "fov_y_deg")
        ),
    ]
    assert len(set(keys)) == len(keys)


def another(name: str) -> Any:
    """Another value of a setting than the default."""
    setting, value = SETTINGS[name], Params().to_dict()[name]
    if setting.choices:
        return next(choice for choice in setting.choices if choice != value)
    if setting.kind is bool:
        return not value
    return 1 if value in setting.words else min(value + 1, setting.high) if value < setting.high else setting.low


@pytest.mark.parametrize("method", SETTINGS_THAT_COUNT)
def test_the_settings_that_count_and_no_others(method: str) -> None:
    usual = key(scene(), method)
    counting = {name for name in SETTINGS if key(scene(), method, Params(**{name: another(name)})) != usual}
    assert counting == set(SETTINGS_THAT_COUNT[method])


def test_settings_that_do_not_count_change_nothing() -> None:
    """The other half of the truth: what is left out of the key has no say in the picture."""
    for method, names in SETTINGS_THAT_COUNT.items():
        small = {"vpls": 50}
        plain = refer(method=method, params=Params(**small), cache=False, spp=4)
        for name in SETTINGS:
            if name in names or name in ("vpls", "filter_backend"):
                continue
            same = refer(method=method, params=Params(**small | {name: another(name)}), cache=False, spp=4)
            assert np.array_equal(plain.colour, same.colour), (method, name)
        for name in names:
            if name == "vpls":
                continue
            settings = {"clamp_distance": 0.5} if name in ("falloff", "compensation") else {}
            base = refer(method=method, params=Params(**small | settings), cache=False, spp=4)
            changed = settings | {name: 1 if name == "max_bounces" else another(name)}
            differs = refer(method=method, params=Params(**small | changed), cache=False, spp=4)
            assert not np.array_equal(base.colour, differs.colour), (method, name)


def test_names_do_not_count() -> None:
    base = scene()
    renamed = dataclasses.replace(
        base,
        name="other",
        path="elsewhere",
        exposure=3.0,
        notes=["a note"],
        materials=[dataclasses.replace(m, name=f"{m.name}!") for m in base.materials],
    )
    camera = dataclasses.replace(base.cameras[0], name="rear")
    assert key(base) == key(renamed, camera=camera)


def test_other_code_makes_other_references(monkeypatch: pytest.MonkeyPatch) -> None:
    before = key(scene())
    monkeypatch.setattr(stored, "_code_digest", lambda: "other code")
    assert key(scene()) != before


def test_a_mesh_can_be_hashed_from_any_memory_layout() -> None:
    """What counts is the content."""
    base = scene()
    mesh: Mesh = base.meshes[0]
    fortran = dataclasses.replace(mesh, position=np.asfortranarray(mesh.position))
    assert key(dataclasses.replace(base, meshes=[fortran, *base.meshes[1:]])) == key(base)

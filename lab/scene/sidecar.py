"""The JSON beside a geometry file: cameras, sun, emitters and lights that the geometry file cannot hold.

``room.json`` is read with ``room.glb``; keys it may hold (others say where the model comes from and are left alone)::

    {"cameras": [{"name": "main", "eye": [0, 1, 5], "target": [0, 1, 0], "up": [0, 1, 0], "fov_y_deg": 45}],
     "sun_direction_to_sun": [0.15, 0.95, 0.27],       or null; its irradiance is lab.scene.sky.SUN_IRRADIANCE
     "emitters": [{"material": "lamp", "radiance": [17, 12, 4]}],
     "suggested_lights": [{"type": "point", "position": [0, 2, 0], "intensity": [5, 5, 5]}],   keys as in scene.toml
     "exposure": 1.0, "background": [0, 0, 0], "name": "room"}
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lab.errors import LabError
from lab.scene.parts import Parts
from lab.scene.scene import SunLight
from lab.scene.sky import SUN_IRRADIANCE
from lab.scene.tables import add_camera, add_light, change_material, table, tables
from lab.scene.values import direction, number, shown, vector, word

KEYS = ("cameras", "sun_direction_to_sun", "emitters", "suggested_lights", "exposure", "background")


def read_sidecar(path: Path, parts: Parts) -> None:
    """Adds what the JSON file at `path` says to `parts`; a JSON with none of our keys is left alone, with a note.

    Its cameras stand before those of the geometry file. Errors: :class:`LabError` naming file and key.
    """
    given = _parse(path)
    if "stages_ms" in given and "params" in given:
        return  # the record of an earlier run, written beside the scene
    if not any(key in given for key in KEYS):
        parts.note(f"{path.name} beside the file says nothing about the scene and was left alone")
        return
    parts.files.append(path)
    if "name" in given:
        parts.name = word(f"{path}: name", given["name"])
    if given.get("exposure") is not None:
        parts.exposure = number(f"{path}: exposure", given["exposure"], 0, open_low=True)
    if given.get("background") is not None:
        parts.background = vector(f"{path}: background", given["background"], 0)
    own, parts.cameras = parts.cameras, []
    for where, camera in tables(f"{path}: cameras", given.get("cameras") or []):
        add_camera(parts, where, camera, ("fov_x_deg", "aspect"))
    taken = {camera.name for camera in parts.cameras}
    parts.cameras += [camera for camera in own if camera.name not in taken]
    if given.get("sun_direction_to_sun") is not None:
        to_sun = direction(f"{path}: sun_direction_to_sun", given["sun_direction_to_sun"])
        parts.suns.append(SunLight(to_sun, SUN_IRRADIANCE))
    for where, emitter in tables(f"{path}: emitters", given.get("emitters") or []):
        fields = table(where, emitter, ("bbox",), ("material", "radiance"))
        radiance = vector(f"{where}: radiance", fields["radiance"], 0, 1e30)
        change_material(parts, where, word(f"{where}: material", fields["material"]), {"emission": radiance})
    for where, light in tables(f"{path}: suggested_lights", given.get("suggested_lights") or []):
        if not isinstance(light, dict) or "type" not in light:
            raise LabError(f"{where} is {shown(light)}: it must be a table with a type: sun, point or spot")
        rest = {key: value for key, value in light.items() if key != "type"}
        add_light(parts, where, word(f"{where}: type", light["type"]), rest)


def _parse(path: Path) -> dict[str, Any]:
    try:
        given = json.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as problem:
        raise LabError(f"{path} cannot be read: {problem.strerror or problem}") from problem
    except RecursionError as problem:
        raise LabError(f"{path} is nested too deeply: mend or remove it") from problem
    except ValueError as problem:
        raise LabError(
            f"{path} is not valid JSON: {problem}; mend it, or remove it to load the geometry alone"
        ) from problem
    if not isinstance(given, dict):
        raise LabError(f"{path} holds a {type(given).__name__}: a JSON object was expected; mend or remove it")
    return given

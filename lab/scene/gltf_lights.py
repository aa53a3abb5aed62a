"""The cameras and KHR_lights_punctual lights of a glTF document, read by pygltflib, placed by their nodes.

Lux and candela are taken 1:1 as irradiance and radiant intensity. Lights and cameras look along their node's -Z.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.gltf_container import GltfFile, is_whole
from lab.scene.parts import Parts
from lab.scene.scene import Camera, PointLight, SpotLight, SunLight, Vec3
from lab.scene.values import direction, number, shown, vector

Matrix = NDArray[np.float64]
_LIGHTS = "KHR_lights_punctual"


def read_lights_and_cameras(file: GltfFile, model: Any, places: list[Matrix], parts: Parts) -> None:
    """Adds to `parts` what the nodes of the pygltflib document `model` carry; `places` (4, 4) are their transforms."""
    extensions = model.extensions if isinstance(model.extensions, dict) else {}
    table = extensions.get(_LIGHTS)
    lights = table.get("lights", []) if isinstance(table, dict) else []
    cameras = model.cameras or []
    for node, matrix in zip(model.nodes, places, strict=True):
        reference = node.extensions.get(_LIGHTS) if isinstance(node.extensions, dict) else None
        if reference is not None:
            index = reference.get("light") if isinstance(reference, dict) else None
            _light(f"{file.path}: {_LIGHTS}[{index}]", _at(file, "lights", lights, index), matrix, parts)
        if node.camera is not None:
            camera = _at(file, "cameras", cameras, node.camera)
            if camera is None:
                raise LabError(f"{file.path}: cameras[{shown(node.camera)}] is null, not an object; it is broken")
            names = [text for text in (camera.name, node.name) if isinstance(text, str) and text]
            name = [*names, f"camera{node.camera}"][0]
            _camera(f"{file.path}: cameras[{node.camera}]", camera, name, matrix, parts)


def _at(file: GltfFile, kind: str, items: Any, index: object) -> Any:
    if not isinstance(items, list) or not is_whole(index) or index >= len(items):
        count = len(items) if isinstance(items, list) else 0
        raise LabError(f"{file.path}: a node refers to {kind}[{shown(index)}], but there are {count}: it is broken")
    return items[index]


def _axis(where: str, matrix: Matrix, column: int) -> Vec3:
    return direction(f"{where}: its axis", [float(v) for v in matrix[:3, column]])


def _light(where: str, light: object, matrix: Matrix, parts: Parts) -> None:
    if not isinstance(light, dict):
        raise LabError(f"{where} is {shown(light)}, it must be an object; the file is broken")
    colour = vector(f"{where}.color", light.get("color", [1.0, 1.0, 1.0]), 0, 1e30)
    strength = number(f"{where}.intensity", light.get("intensity", 1.0), 0, 1e30)
    power = vector(f"{where}: color times intensity", [c * strength for c in colour], 0, 1e30)
    position = vector(f"{where}: its place", [float(v) for v in matrix[:3, 3]])
    kind = light.get("type")
    if kind == "directional":
        parts.suns.append(SunLight(_axis(where, matrix, 2), power))
    elif kind == "point":
        parts.points.append(PointLight(position, power))
    elif kind == "spot":
        spot = light.get("spot", {})
        if not isinstance(spot, dict):
            raise LabError(f"{where}.spot is {shown(spot)}, it must be an object; the file is broken")
        wide, narrow = spot.get("outerConeAngle", math.pi / 4), spot.get("innerConeAngle", 0.0)
        outer = number(f"{where}.outerConeAngle", wide, 0, math.pi / 2 + 1e-5, open_low=True)
        inner = number(f"{where}.innerConeAngle", narrow, 0, math.pi / 2 + 1e-5)
        x, y, z = _axis(where, matrix, 2)
        # Exporters write inner = outer for a hard edge; a sliver between them keeps the falloff's division finite.
        parts.spots.append(SpotLight(position, (-x, -y, -z), power, min(inner, outer * (1 - 1e-4)), outer))
    else:
        raise LabError(f"{where}.type is {shown(kind)}: it must be directional, point or spot")


def _camera(where: str, camera: Any, name: str, matrix: Matrix, parts: Parts) -> None:
    if camera.perspective is None:
        parts.note(f"{where} is not a perspective camera and was left out")
        return
    fov = number(f"{where}.yfov", camera.perspective.yfov, 0, math.pi * 0.999, open_low=True)
    taken = {known.name for known in parts.cameras}
    if name in taken:
        name = next(f"{name}{k}" for k in range(2, len(taken) + 3) if f"{name}{k}" not in taken)
    eye = vector(f"{where}: its place", [float(v) for v in matrix[:3, 3]])
    back = _axis(where, matrix, 2)
    reach = max(1.0, 1e-3 * max(map(abs, eye)))  # far from the origin a unit step would drown in rounding
    target = (eye[0] - back[0] * reach, eye[1] - back[1] * reach, eye[2] - back[2] * reach)
    parts.cameras.append(Camera(name, eye, target, _axis(where, matrix, 1), math.degrees(fov)))

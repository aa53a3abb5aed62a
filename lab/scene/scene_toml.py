"""``scene.toml``: a scene put together from geometry files, lights and cameras.

Every key the format knows::

    name = "court"                      # default: the folder's name
    exposure = 1.5                      # factor on colour in the PNG, default: chosen from the picture
    background = [0.3, 0.4, 0.6]        # radiance seen where nothing is hit, default black; it lights nothing
    geometry = ["court.glb", "pots.obj"]  # needed; files beside the toml, with their materials, lights, cameras
    light_list = "lamps.npz"            # the user's own point lights, see lab/scene/lights.py; no VPLs are traced then

    [[camera]]                          # the first is the default; cameras of the geometry files come behind these
    name = "main"
    eye = [0, 1.7, 8]
    target = [0, 2, 0]
    up = [0, 1, 0]                      # default
    fov_y_deg = 50                      # full vertical angle, default 45

    [[sun]]
    to_sun = [0.3, 1, 0.2]              # any length
    irradiance = [6, 5.6, 5]            # linear RGB on a plane that faces the sun

    [[point]]
    position = [0, 3, 0]
    intensity = [10, 8, 5]              # radiant intensity, linear RGB

    [[spot]]
    position = [0, 3, 0]
    direction = [0, -1, 0]
    intensity = [10, 8, 5]
    inner_angle_deg = 10                # half angles; defaults 0 and 45
    outer_angle_deg = 30

    [[material]]                        # changes a material of the geometry files by its name
    name = "lamp"
    base_colour = [0.5, 0.5, 0.5]
    emission = [20, 18, 15]             # radiance
    two_sided = true
    alpha_cutoff = 0.5                  # 0: no holes

A scene needs a light: a sun, point or spot light, a light list, or triangles that emit. JSON files beside the geometry
files are not read: what lights the scene stands here.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from lab.errors import LabError
from lab.scene.files import read_geometry_file
from lab.scene.lights import load_light_list
from lab.scene.parts import Parts
from lab.scene.tables import add_camera, add_light, override_material, table, tables
from lab.scene.values import number, shown, vector, word

KEYS = ("name", "exposure", "background", "geometry", "light_list", "camera", "sun", "point", "spot", "material")


def read_scene_toml(path: Path) -> Parts:
    """The scene described by the file at `path`.

    Errors: :class:`LabError` naming file and key for whatever does not fit the format, for missing files, and for a
    scene without any light.
    """
    given = table(str(path), _parse(path), KEYS, ("geometry",))
    parts = Parts(name=word(f"{path}: name", given["name"]) if "name" in given else path.absolute().parent.name)
    if "exposure" in given:
        parts.exposure = number(f"{path}: exposure", given["exposure"], 0, open_low=True)
    if "background" in given:
        parts.background = vector(f"{path}: background", given["background"], 0)
    for where, camera in tables(f"{path}: camera", given.get("camera", [])):
        add_camera(parts, where, camera)
    for kind in ("sun", "point", "spot"):
        for where, light in tables(f"{path}: {kind}", given.get(kind, [])):
            add_light(parts, where, kind, light)
    for file in _geometry(path, given["geometry"]):
        parts.append(read_geometry_file(file))
        parts.files.append(file)
    for where, material in tables(f"{path}: material", given.get("material", [])):
        override_material(parts, where, material)
    if "light_list" in given:
        file = path.parent / word(f"{path}: light_list", given["light_list"])
        parts.light_list = load_light_list(file)
        parts.files.append(file)
    if not parts.has_light():
        raise LabError(
            f"{path}: the scene has no light, its picture would be black: add a [[sun]], [[point]] or [[spot]], "
            "a light_list, or an emission to a [[material]]"
        )
    return parts


def _geometry(path: Path, value: object) -> list[Path]:
    if not isinstance(value, list) or not value or not all(isinstance(name, str) and name for name in value):
        raise LabError(f'{path}: geometry is {shown(value)}: it must be a list of files, as ["court.glb"]')
    return [path.parent / name for name in value]


def _parse(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise LabError(
            f"{path}, line {line}: byte {problem.start} is not UTF-8 text; save the file as UTF-8"
        ) from problem
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise LabError(f"{path} is not valid TOML: {problem}{_quoted(text, str(problem))}") from problem
    except (RecursionError, ValueError) as problem:
        raise LabError(f"{path} is not valid TOML: {problem}") from problem


def _quoted(text: str, message: str) -> str:
    """The line that `message` ("... (at line 3, column 7)") speaks of."""
    lines = text.splitlines()
    _, _, rest = message.rpartition("at line ")
    number_of_line = rest.split(",")[0]
    if number_of_line.isdigit() and 0 < int(number_of_line) <= len(lines):
        return f": {lines[int(number_of_line) - 1].strip()[:80]!r}"
    return ""

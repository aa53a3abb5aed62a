"""The node tree of a glTF document: where everything stands (glTF 2.0, section 3.5)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.gltf_container import GltfFile, is_whole
from lab.scene.values import is_number

Matrix = NDArray[np.float64]


def world_transforms(file: GltfFile) -> dict[int, Matrix]:
    """(4, 4) transform to world space of every node of the default scene, by number, in the document's order.

    Errors: :class:`LabError` for references that lead nowhere or round in circles, and for numbers that are none.
    """
    order, parents = _scene_nodes(file)
    world: dict[int, Matrix] = {}
    with np.errstate(all="ignore"):  # what overflows is found where it is used
        for number in order:
            own = _local(file, number, file.items("nodes")[number])
            world[number] = world[parents[number]] @ own if number in parents else own
    return world


def _scene_nodes(file: GltfFile) -> tuple[list[int], dict[int, int]]:
    """Nodes of the default scene, parents first, in the document's order; and each node's parent."""
    scenes, nodes = file.items("scenes"), file.items("nodes")
    if scenes:
        number = file.document.get("scene", 0)
        roots = file.item("scenes", number, "scene").get("nodes", [])
    else:  # a document without scenes is a library of parts: show all of them
        children = {child for node in nodes for child in _children(file, node)}
        roots = [k for k in range(len(nodes)) if k not in children]
    if not isinstance(roots, list):
        raise LabError(f"{file.path}: the scene's nodes must be a list of numbers; the file is broken")
    order: list[int] = []
    parents: dict[int, int] = {}
    seen: set[int] = set()
    stack: list[tuple[int | None, object]] = [(None, root) for root in reversed(roots)]
    while stack:
        parent, number = stack.pop()
        node = file.item("nodes", number, f"nodes[{parent}]" if parent is not None else "the scene")
        assert isinstance(number, int)  # item() has checked it
        if number in seen:
            raise LabError(f"{file.path}: nodes[{number}] has two parents or is its own ancestor; the file is broken")
        seen.add(number)
        order.append(number)
        if parent is not None:
            parents[number] = parent
        stack += [(number, child) for child in reversed(_children(file, node))]
    return order, parents


def _children(file: GltfFile, node: dict[str, Any]) -> list[Any]:
    children = node.get("children", [])
    if not isinstance(children, list) or not all(is_whole(child) for child in children):
        raise LabError(f"{file.path}: a node's children must be a list of numbers; the file is broken")
    return children


def _local(file: GltfFile, number: int, node: dict[str, Any]) -> Matrix:
    given: dict[str, list[float]] = {}
    for key, length in (("matrix", 16), ("translation", 3), ("rotation", 4), ("scale", 3)):
        value = node.get(key)
        if value is None:
            continue
        if not isinstance(value, list) or len(value) != length or not all(is_number(v) for v in value):
            raise LabError(f"{file.path}: nodes[{number}].{key} must be {length} finite numbers; the file is broken")
        given[key] = [float(v) for v in value]
    if "matrix" in given:
        return np.array(given["matrix"]).reshape(4, 4).T  # columns first in the file
    matrix = np.eye(4)
    length_of_rotation = math.hypot(*given.get("rotation", [1.0]))
    if not 0.5 < length_of_rotation < 2:
        raise LabError(f"{file.path}: nodes[{number}].rotation {given['rotation']} is no unit quaternion; it is broken")
    x, y, z, w = (v / length_of_rotation for v in given.get("rotation", [0.0, 0.0, 0.0, 1.0]))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    matrix[:3, :3] = turn * given.get("scale", [1.0, 1.0, 1.0])
    matrix[:3, 3] = given.get("translation", [0.0, 0.0, 0.0])
    return matrix

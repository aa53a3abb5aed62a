"""PLY meshes, read by open3d once :mod:`lab.scene.ply` has found them whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lab.errors import LabError
from lab.scene.parts import Parts, add_mesh
from lab.scene.ply import check_ply
from lab.scene.quiet import native_quiet
from lab.scene.scene import Material
from lab.scene.textures import srgb_to_linear


def read_ply(path: Path) -> Parts:
    """The triangles of the PLY file at `path`; polygons become triangles, colours are taken as sRGB.

    Errors: :class:`LabError` for a file that is broken or has no faces.
    """
    header, triangles = check_ply(path)
    vertices, faces = header.counts.get("vertex", 0), header.counts.get("face", 0)
    if not vertices:
        raise LabError(f"{path} holds no vertices")
    if not faces:
        raise LabError(
            f"{path} holds {vertices} points and no faces: a mesh is needed; "
            "points can be lights: name the file as light_list in a scene.toml"
        )
    columns = header.columns["vertex"]
    for name in "xyz":
        if name not in columns or columns[name].length:
            raise LabError(f"{path}: its vertices have no column {name!r}")
    corners = [name for name in ("vertex_index", "vertex_indices") if name in header.columns["face"]]
    if len(corners) != 1 or not header.columns["face"][corners[0]].length:
        raise LabError(f"{path}: its faces need one list column named 'vertex_indices'")
    import open3d

    with native_quiet(), open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        try:
            mesh = open3d.io.read_triangle_mesh(path)
        except Exception as problem:  # whatever the library stumbles on, the file is at fault
            raise LabError(f"{path} cannot be read as PLY: {problem}") from problem
    index = np.asarray(mesh.triangles)
    if len(mesh.vertices) != vertices or len(index) != triangles:  # it gives up on a polygon without area
        raise LabError(
            f"{path}: only {len(index)} of its {triangles} triangles could be made: a polygon of 4 or more corners has "
            "no area or crosses itself; save the mesh as triangles"
        )
    parts = Parts(materials=[Material()])
    colour = None
    kinds = {columns[name].value for name in ("red", "green", "blue") if name in columns}
    if mesh.has_vertex_colors() and len(kinds) == 1 and {"red", "green", "blue"} <= columns.keys():
        encoded = np.asarray(mesh.vertex_colors)
        kind = kinds.pop()  # open3d divides by 255 whatever the type
        encoded = encoded * (255.0 if kind[0] == "f" else 255.0 / np.iinfo(kind).max)
        colour = srgb_to_linear(encoded)
    has_normals = mesh.has_vertex_normals() and {"nx", "ny", "nz"} <= columns.keys()
    normal = np.asarray(mesh.vertex_normals) if has_normals else None
    add_mesh(parts, str(path), np.asarray(mesh.vertices), index, material=0, normal=normal, colour=colour)
    if {"s", "t"} <= columns.keys() or {"u", "v"} <= columns.keys() or "texcoord" in header.columns["face"]:
        parts.note(f"{path.name}: texture coordinates in PLY files are not read")
    return parts

"""The scene's triangles: textured, in plain albedo or grey; as they are, or plainer while the view moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista
from numpy.typing import NDArray
from PIL import Image
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from gui.scene_view.actors import Part, faces_of
from gui.scene_view.colours import Bytes
from lab import LabError
from lab.colour import srgb_encode
from lab.errors import nearest
from lab.scene.scene import Material, Mesh, Scene
from lab.scene.textures import mean_colour

STYLES = ("textured", "grey", "albedo", "none")

_SHARPEST = 256  # texels; finer ones flicker without mipmaps, which cost three times the rest of the drawing
_GREY = 0.55  # display value of the grey mesh

# A texel under the cutoff is a hole. Textures come with 0 or 255 as alpha; `opacity` is the actor's.
_HOLES = "//VTK::TCoord::Impl\n  if (gl_FragData[0].a < 0.5 * opacity) discard;\n"


@dataclass
class _Surface:
    """All triangles of one material: its data with colours a vertex, its texture, and whether that has holes."""

    data: pyvista.PolyData
    texture: pyvista.Texture | None
    cut_out: pyvista.Texture | None


class MeshPart(Part):
    """The mesh in one of :data:`STYLES`.

    Nothing is lit as it is drawn: a soft light from above, baked into the vertices, shows form for a tenth of the
    cost, and both sides of a surface alike. Alpha masks are honoured.
    """

    def __init__(self, renderer: Any, scene: Scene) -> None:
        super().__init__(renderer)
        self._scene = scene
        self._surfaces: list[_Surface] | None = None
        self._still: list[vtkActor] = []
        self._plain: list[vtkActor] = []
        self._moving = False
        self.opaque = False

    def show(self, style: str, opacity: float = 1.0) -> None:
        """Shows the mesh in `style`, from opaque, 1, down to 0."""
        if style not in STYLES:
            raise LabError(f"mesh style {style!r}: there are {', '.join(STYLES)}{nearest(style, STYLES)}")
        if not 0 <= opacity <= 1:
            raise LabError(f"mesh opacity {opacity}: allowed is 0 to 1")
        self.clear()
        self._still, self._plain = [], []
        self.opaque = style != "none" and opacity == 1
        if style == "none" or opacity == 0:
            return
        if self._surfaces is None:
            self._surfaces = _surfaces(self._scene)
        for surface in self._surfaces:
            for plain, actors in ((False, self._still), (True, self._plain)):
                if plain and (style == "grey" or surface.texture is None):
                    actors.append(self._still[-1])  # it is plain already
                    continue
                actor = _actor(surface, style, plain)
                actor.GetProperty().SetOpacity(opacity)
                actors.append(self.add(actor))
        self.set_moving(self._moving)

    def set_moving(self, moving: bool) -> None:
        """While the view moves, textures without holes give way to their mean colours."""
        self._moving = moving
        for actor in self._still if moving else self._plain:
            actor.VisibilityOff()
        for actor in self._plain if moving else self._still:
            actor.VisibilityOn()


def _actor(surface: _Surface, style: str, plain: bool) -> vtkActor:
    colours = "grey" if style == "grey" else style
    texture = surface.cut_out if style == "grey" else surface.texture
    if plain and surface.cut_out is None:
        colours, texture = f"{style}_mean", None
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(surface.data)
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray(colours)
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    actor.GetProperty().SetLighting(False)
    if texture is not None:
        actor.SetTexture(texture)
        if surface.cut_out is not None:
            actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::TCoord::Impl", True, _HOLES, False)
            actor.ForceOpaqueOn()
    return actor


def _surfaces(scene: Scene) -> list[_Surface]:
    """One a material that is seen."""
    found = []
    for row, material in enumerate(scene.materials):
        meshes = [mesh for mesh in scene.meshes if mesh.material == row and len(mesh.index)]
        if not meshes or (material.texture < 0 and material.alpha < material.alpha_cutoff):
            continue
        found.append(_surface(scene, material, meshes))
    return found


def _surface(scene: Scene, material: Material, meshes: list[Mesh]) -> _Surface:
    parts = [_with_normals(mesh) for mesh in meshes]
    starts = np.cumsum([0, *(len(part.position) for part in parts)])
    triangles = np.concatenate([part.index.astype(np.int64) + s for part, s in zip(parts, starts, strict=False)])
    data = pyvista.PolyData(np.concatenate([part.position for part in parts]), faces=faces_of(triangles))
    normal = np.concatenate([np.asarray(part.normal) for part in parts])
    own = np.concatenate([np.ones_like(p.position) if p.colour is None else p.colour for p in parts])
    texels = scene.textures[material.texture] if material.texture >= 0 and parts[0].uv is not None else None

    light = _light(normal)[:, None]
    base = srgb_encode(own * np.asarray(material.base_colour, np.float32))
    mean = 1.0 if texels is None else srgb_encode(mean_colour(texels))
    glow = max(material.emission)
    if glow > 0:
        base, light = srgb_encode(np.broadcast_to(np.asarray(material.emission) / glow, own.shape)), np.ones_like(light)
    for name, colours in (
        ("grey", np.repeat(_GREY * light, 3, axis=1)),
        ("textured", base * light),
        ("albedo", base),
        ("textured_mean", base * light * mean),
        ("albedo_mean", base * mean),
    ):
        data.point_data[name] = np.rint(255 * np.clip(colours, 0, 1)).astype(np.uint8)
    if texels is None:
        return _Surface(data, None, None)
    uv = np.concatenate([np.zeros((len(p.position), 2), np.float32) if p.uv is None else p.uv for p in parts])
    data.active_texture_coordinates = np.column_stack([uv[:, 0], 1 - uv[:, 1]])  # VTK's v goes up
    return _Surface(data, *_textures(texels, material))


def _light(normal: NDArray[np.floating]) -> NDArray[np.floating]:
    """(n,) brightness of surfaces of (n, 3) `normal`: most from above, and walls that meet at a corner told apart."""
    x, y, z = normal.T
    return np.asarray(0.56 + 0.13 * np.abs(x) + 0.28 * y + 0.03 * z)


def _textures(texels: Bytes, material: Material) -> tuple[pyvista.Texture, pyvista.Texture | None]:
    """The texture, and where it has holes another, white but for them."""
    picture = Image.fromarray(texels)
    shrink = max(texels.shape[:2]) // _SHARPEST
    small = np.asarray(picture.reduce(shrink) if shrink > 1 else picture)
    solid = material.alpha * (small[..., 3] / 255) >= material.alpha_cutoff
    if solid.all():
        return _texture(small[..., :3]), None
    alpha = np.where(solid, 255, 0).astype(np.uint8)[..., None]
    return _texture(np.dstack([small[..., :3], alpha])), _texture(np.dstack([np.full_like(small[..., :3], 255), alpha]))


def _texture(pixels: Bytes) -> pyvista.Texture:
    texture: Any = pyvista.Texture(np.ascontiguousarray(pixels))  # type: ignore[no-untyped-call]
    texture.repeat = True
    texture.interpolate = True
    made: pyvista.Texture = texture
    return made


def _with_normals(mesh: Mesh) -> Mesh:
    """A mesh without vertex normals is flat: each triangle gets vertices of its own."""
    if mesh.normal is not None:
        return mesh
    corners = mesh.index.ravel()
    position = mesh.position[corners]
    a, b, c = position[::3], position[1::3], position[2::3]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0, length, 1)
    return Mesh(
        position=position,
        index=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        material=mesh.material,
        normal=np.repeat(normal, 3, axis=0),
        uv=None if mesh.uv is None else mesh.uv[corners],
        colour=None if mesh.colour is None else mesh.colour[corners],
    )

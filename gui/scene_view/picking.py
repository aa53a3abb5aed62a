"""What lies under a place in the view, and what hides what: rays through the mesh by embreex."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.scene.scene import Scene

Array = NDArray[np.float64]


class MeshRays:
    """Rays against the scene's triangles, whose tree is built when first asked. Holes of alpha masks are solid here."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._tree: Any = None

    def distances(self, origins: Array, directions: Array) -> Array:
        """(n,) how far rays from (n, 3) origins along (n, 3) unit directions come; inf where they hit nothing."""
        if self._tree is None:
            self._tree = _tree(self._scene)
        rays = (
            np.ascontiguousarray(np.broadcast_to(rows, directions.shape), np.float32) for rows in (origins, directions)
        )
        found = self._tree.run(*rays, query="INTERSECT", output=True)
        return np.where(found["primID"] >= 0, found["tfar"], np.inf).astype(np.float64)


def _tree(scene: Scene) -> Any:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    tree = EmbreeScene()
    corners = [mesh.position[mesh.index] for mesh in scene.meshes if len(mesh.index)]
    if corners:
        TriangleMesh(tree, np.ascontiguousarray(np.concatenate(corners), np.float32))
    return tree


def nearest_light(
    place: tuple[float, float], pixels: Array, depth: Array, radius_px: NDArray[np.floating], within_px: float
) -> NDArray[np.intp]:
    """Rows of the points under `place`, best first.

    A point counts where `place` is on its disc of `radius_px` or within `within_px` of its centre. Those nearest to
    the place, by half pixels, come first; of equals the nearer to the eye.
    """
    away = np.linalg.norm(pixels - np.asarray(place), axis=1)
    under = np.flatnonzero((depth > 0) & (away <= np.maximum(radius_px, within_px)))
    return under[np.lexsort((depth[under], np.floor(2 * away[under])))]

"""The scene in 3D, with what the hierarchy makes of its lights: pyvista alone, in a page or in a window."""

from gui.scene_view.scene_view import SceneView

__all__ = ["SceneView"]

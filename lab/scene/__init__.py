"""Scenes: what is rendered, and how it is read from files."""

from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SpotLight, SunLight

__all__ = ["Camera", "Material", "Mesh", "PointLight", "Scene", "SpotLight", "SunLight"]

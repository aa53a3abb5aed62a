"""The many-lights laboratory: real-time rendering with lighting grid hierarchies (Lin & Yuksel, I3D 2019).

    import lab
    scene = lab.load_scene("scenes/atrium/scene.toml")
    frame = lab.render(scene, lab.Params(alpha=2))
    frame.image.colour            # (720, 1280, 3) linear RGB

Names are loaded when first used, so that ``lab --help`` does not wait for numpy.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lab.engine.cpu import build_hierarchy as build_hierarchy
    from lab.errors import LabError as LabError
    from lab.library import irradiance as irradiance
    from lab.library import render as render
    from lab.params import Params as Params
    from lab.params import preset as preset
    from lab.pixel import Probe as Probe
    from lab.pixel import probe as probe
    from lab.records import Frame as Frame
    from lab.records import Hierarchy as Hierarchy
    from lab.records import Lights as Lights
    from lab.renderer import Renderer as Renderer
    from lab.scene.load import load_scene as load_scene

__version__ = "0.1.0"

# OpenMP threads that wait for work would spin, and take the cores from whatever else runs: a build of 300 lights then
# takes 200 ms in place of 1. libgomp reads this when the core is first loaded; a user's own setting stands.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

_HOME = {
    "Frame": "lab.records",
    "Hierarchy": "lab.records",
    "LabError": "lab.errors",
    "Lights": "lab.records",
    "Params": "lab.params",
    "Probe": "lab.pixel",
    "Renderer": "lab.renderer",
    "build_hierarchy": "lab.engine.cpu",
    "irradiance": "lab.library",
    "load_scene": "lab.scene.load",
    "preset": "lab.params",
    "probe": "lab.pixel",
    "render": "lab.library",
}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'lab' has no attribute {name!r}")

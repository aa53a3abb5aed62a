"""Imports only go down, and each big library has its one place (design of the project)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .project import imports, sources, text

# Lowest first. A module may import from its own layer and the ones under it.
LAYERS = [
    {"lab.caches", "lab.errors", "lab.interrupts"},
    {
        "lab.colour",
        "lab.controls",
        "lab.figure",
        "lab.layers",
        "lab.level_colours",
        "lab.metrics",
        "lab.outputs",
        "lab.params",
        "lab.records",
    },
    {"lab.scene"},
    {"lab.filters", "lab.filters_images", "lab.filters_variance"},
    {"lab.engine"},
    {"lab.frame"},
    {
        "lab.blend_curves",
        "lab.error_picture",
        "lab.export",
        "lab.grid_lights",
        "lab.heatmap",
        "lab.image_io",
        "lab.library",
        "lab.pixel_layers",
        "lab.pixel_stats",
        "lab.reference",
        "lab.report",
    },
    {"lab.renderer"},
    {"lab.attribute", "lab.bench", "lab.comparison", "lab.mitsuba_scene", "lab.pixel", "lab.survey", "lab.view"},
    {"lab.experiments"},
    {"lab.testing"},
    {"lab"},
    {"lab.commands"},
    {"lab.cli", "lab.examples", "lab.__main__"},
]

# Library -> the only places that may import it.
PLACES = {
    "open3d": ("lab/scene", "lab/export.py"),
    "trimesh": ("lab/scene",),
    "pygltflib": ("lab/scene",),
    "torch": ("lab/filters.py", "lab/filters_images.py", "lab/filters_variance.py"),
    "kornia": ("lab/filters.py",),
    "pyvista": ("gui", "lab/export.py"),
    "slangpy": ("lab/engine/vulkan",),
    "OpenEXR": ("lab/image_io.py",),
    "PIL": (
        "lab/image_io.py",
        "lab/figure.py",
        "lab/heatmap.py",
        "lab/error_picture.py",
        "lab/attribute/pictures.py",
        "lab/bench/picture.py",
        "lab/scene",
        "gui",
    ),
    "trame": ("gui",),
    "trame_pyvista": ("gui",),
    "matplotlib": ("gui",),
    "embreex": ("gui",),
    "scipy": ("lab/metrics",),
    "flip_evaluator": ("lab/metrics",),
    "pytest": ("lab/testing",),
    "mitsuba": ("lab/experiments/mitsuba_runner.py",),
}

# Slow to load (0.2 s to 4 s): only inside the functions that need them, never as a module is imported.
HEAVY = {
    "embreex",
    "matplotlib",
    "open3d",
    "trimesh",
    "pygltflib",
    "torch",
    "kornia",
    "pyvista",
    "slangpy",
    "OpenEXR",
    "scipy",
    "mitsuba",
    "trame",
}


def module_of(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def layer_of(module: str) -> int | None:
    """The layer of the longest entry that `module` is, or lies in."""
    for height in range(module.count(".") + 1, 0, -1):
        prefix = ".".join(module.split(".")[:height])
        for layer, names in enumerate(LAYERS):
            if prefix in names and (prefix != "lab" or module == "lab"):
                return layer
    return None


@pytest.mark.parametrize("path", sources(".py", under="lab"), ids=str)
def test_imports_go_down(path: Path) -> None:
    own = layer_of(module_of(path))
    assert own is not None, f"{path} has no layer yet: give it one in LAYERS"
    for name in imports(path):
        if name.startswith("lab.") and name != "lab._core":
            layer = layer_of(name)
            # `from lab import x` also yields lab.x where x is a function: it has no layer, its module does.
            assert layer is None or layer <= own, f"{path} imports {name} from a layer above it"


def test_engines_do_not_know_each_other() -> None:
    for path in sources(".py", under="lab/engine/vulkan"):
        assert not {name for name in imports(path) if name.startswith("lab.engine.cpu")}, path
    for path in sources(".py", under="lab/engine"):
        if path.name == "cpu.py":
            assert not {name for name in imports(path) if name.startswith("lab.engine.vulkan")}, path


@pytest.mark.parametrize("library", PLACES)
def test_each_library_has_its_place(library: str) -> None:
    for path in [*sources(".py", under="lab"), *sources(".py", under="gui")]:
        if any(path.is_relative_to(place) for place in PLACES[library]):
            continue
        users = {name for name in imports(path) if name.split(".")[0] == library}
        assert not users, f"{path} imports {library}, whose place is {PLACES[library] or 'in tests only'}"


@pytest.mark.parametrize("path", sources(".py", under="lab"), ids=str)
def test_heavy_libraries_are_imported_where_used(path: Path) -> None:
    lines = [line for line in text(path).splitlines() if re.match(r"(import|from)\s", line)]
    loaded = {line.split()[1].split(".")[0] for line in lines}
    assert not loaded & HEAVY, f"{path} imports {loaded & HEAVY} as it loads: move that into the function that needs it"


def test_the_core_keeps_its_libraries_apart() -> None:
    pybind, embree = set(), set()
    for path in sources(".cpp", ".h", under="core_cpp"):
        includes = re.findall(r'#\s*include\s*[<"]([^>"]+)[>"]', text(path))
        pybind |= {path for name in includes if name.startswith("pybind11/")}
        embree |= {path for name in includes if name.startswith("embree")}
    assert pybind and all(path.is_relative_to("core_cpp/bind") for path in pybind), pybind
    assert len(embree) == 1 and embree.pop().is_relative_to("core_cpp/src")
    module = Path("core_cpp/bind/module.cpp")
    assert len(text(module).splitlines()) <= 60, "module.cpp only registers"

"""Each kind of light and surface means the same in Mitsuba's picture of a small scene as in ours."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.experiments.mitsuba_judge import Layer, judge
from lab.experiments.mitsuba_runner import Mitsuba
from lab.mitsuba_scene import export_mitsuba
from lab.params import Params
from lab.records import Lights
from lab.reference import Budget, path_traced
from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SpotLight, SunLight

SIZE = (48, 32)
SAMPLES = 256


def quad(corners: list[tuple[float, float, float]], material: int, **more: np.ndarray) -> Mesh:
    """Two triangles, counter-clockwise seen from the front."""
    return Mesh(
        np.array(corners, np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
        material,
        uv=np.array([[0, 2], [2, 2], [2, 0], [0, 0]], np.float32),
        **more,
    )


FLOOR = [(-2.0, 0.0, 2.0), (2.0, 0.0, 2.0), (2.0, 0.0, -2.0), (-2.0, 0.0, -2.0)]
WALL = [(-2.0, 0.0, -2.0), (2.0, 0.0, -2.0), (2.0, 3.0, -2.0), (-2.0, 3.0, -2.0)]
PANEL = [(-0.7, 1.0, -0.5), (0.7, 1.0, -0.5), (0.7, 1.8, -0.9), (-0.7, 1.8, -0.9)]


def chequers() -> np.ndarray:
    """(16, 16, 4): coloured noise whose alpha is cut in holes."""
    rng = np.random.default_rng(4)
    texels = rng.integers(0, 256, (16, 16, 4), dtype=np.uint8)
    texels[..., 3] = np.kron(rng.integers(0, 2, (4, 4)) * 255, np.ones((4, 4))).astype(np.uint8)
    return texels


def scene(**changes: object) -> Scene:
    """A floor and a wall; `changes` bring the light and whatever is tried."""
    base = Scene(
        "small",
        [quad(FLOOR, 0), quad(WALL, 0)],
        [Material(base_colour=(0.7, 0.6, 0.5))],
        cameras=[Camera("front", (0.3, 1.6, 5.0), (0.0, 1.1, 0.0), fov_y_deg=40.0)],
    )
    return replace(base, **changes)  # type: ignore[arg-type]


def with_panel(material: Material, **mesh: np.ndarray) -> dict[str, object]:
    """A panel of its own material before the wall."""
    return {
        "meshes": [quad(FLOOR, 0), quad(WALL, 0), quad(PANEL, 1, **mesh)],
        "materials": [Material(base_colour=(0.7, 0.6, 0.5)), material],
        "textures": [chequers()],
    }


SUN = {"suns": [SunLight((0.36, 0.8, 0.48), (3.0, 2.5, 2.0))]}
COLOURS = np.array([[1, 0.1, 0.1], [0.2, 0.9, 0.1], [0.1, 0.3, 1.0], [0.9, 0.8, 0.1]], np.float32)
# By 10 degrees. Bent far more, a thin sheet lets light through in Mitsuba: its paths go where the bent normal allows,
# while ours end at the geometry.
BENT = np.array([[-5, 12, 31], [5, 12, 31], [5, 12, 31], [-5, 12, 31]], np.float32) / np.float32(33.615473)
LIGHTS = Lights(
    np.array([[-1, 2, 0.5], [1, 1, 0.5], [0.5, 2.2, -1]], np.float32),
    np.array([[20, 10, 5], [4, 8, 16], [9, 9, 9]], np.float32),
    np.array([[0, -1, 0], [0, 0, 0], [0.6, -0.8, 0]], np.float32),
)

SCENES = {
    "sun": SUN,
    "point": {"points": [PointLight((0.8, 2.0, 0.7), (5.0, 4.0, 3.0))]},
    "spot": {"spots": [SpotLight((0.8, 2.5, 1.5), (-0.3, -0.9, -0.6), (20.0, 18.0, 9.0), 0.15, 0.7)]},
    "spot without ramp": {"spots": [SpotLight((0.8, 2.5, 1.5), (-0.3, -0.9, -0.6), (20.0, 18.0, 9.0), 0.5, 0.5)]},
    "one-sided lamp": with_panel(Material(emission=(4.0, 3.0, 2.0))),
    "two-sided lamp": with_panel(Material(emission=(4.0, 3.0, 2.0), two_sided=True)),
    "texture": SUN | with_panel(Material(base_colour=(1.0, 1.0, 1.0), texture=0)),
    "tinted texture": SUN | with_panel(Material(base_colour=(0.9, 0.5, 0.2), texture=0)),
    "vertex colours": SUN | with_panel(Material(base_colour=(0.9, 1.0, 0.8)), colour=COLOURS),
    "one colour, texture": SUN | with_panel(Material(texture=0), colour=np.ones_like(COLOURS) * COLOURS[:1]),
    "bent normals": SUN | with_panel(Material(), normal=BENT),
    "holes": SUN | with_panel(Material(texture=0, alpha=0.9, alpha_cutoff=0.3)),
    "light list": {"light_list": LIGHTS},
}


@pytest.mark.parametrize("name", SCENES)
def test_light_and_surface_mean_the_same(name: str, tmp_path: Path) -> None:
    made = scene(**SCENES[name])
    written = export_mitsuba(tmp_path / "small.xml", made, made.camera(), SIZE, Params())
    theirs = Mitsuba(written.files[0]).layers(SAMPLES)
    found = path_traced(CpuEngine(made), made.camera(), SIZE, Params(), budget=Budget(spp=SAMPLES), pixel="area")
    for layer, mine, other in (
        ("direct", Layer(found.direct, found.direct_variance), theirs.direct),
        ("indirect", Layer(found.indirect, found.indirect_variance), theirs.indirect),
    ):
        verdict = judge(layer, mine, other)
        assert verdict.blocks.accepted, verdict
        assert abs(verdict.energy - 1) < 0.005 + 4 * verdict.energy_error, verdict
        assert verdict.energy_error < 0.03, verdict
    assert not written.notes or name == "light list"


def test_a_wide_spot_is_noted(tmp_path: Path) -> None:
    wide = SpotLight((0.8, 2.5, 1.5), (-0.3, -0.9, -0.6), (20.0, 18.0, 9.0), 0.2, math.radians(85))
    made = scene(spots=[wide])
    written = export_mitsuba(tmp_path / "small.xml", made, made.camera(), SIZE, Params())
    assert "85 degrees is too wide" in written.notes[0]
    assert Mitsuba(written.files[0]).render(4, 0).mean() > 0


def test_the_camera_sees_the_same_points() -> None:
    """Position and side of what each pixel's centre sees, on a scene that looks different from every side."""
    import mitsuba

    made = scene(**with_panel(Material(texture=0)))
    view = Camera("askew", (2.5, 2.2, 3.0), (-0.2, 0.8, -0.6), up=(0.2, 1.0, 0.1), fov_y_deg=35.0)
    ours = CpuEngine(made).render_gbuffer(view, SIZE)
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        xml = export_mitsuba(Path(folder) / "small.xml", made, view, SIZE, Params()).files[0]
        mitsuba.set_variant("scalar_rgb")
        loaded = mitsuba.load_file(str(xml))
        sensor = loaded.sensors()[0]
        for y in range(0, SIZE[1], 3):
            for x in range(0, SIZE[0], 3):
                place = mitsuba.Point2f((x + 0.5) / SIZE[0], (y + 0.5) / SIZE[1])
                ray, _ = sensor.sample_ray(0.0, 0.5, place, mitsuba.Point2f(0.5, 0.5))
                hit = loaded.ray_intersect(ray)
                assert hit.is_valid() == (ours.depth[y, x] > 0)
                if hit.is_valid():
                    np.testing.assert_allclose(np.array(hit.p), ours.position[y, x], atol=2e-4)

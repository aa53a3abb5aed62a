"""Shadow samples slot by slot against float64: where each ray ends, its weight, what it finds, what is made of it."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import GBuffer, Hierarchy, Lighting, Lights, ShadowSamples
from lab.scene.scene import Camera, Material, Mesh, Scene

from ..oracle_geometry.grids import contributions, geometry, member_shares, pick_weights
from ..oracle_geometry.rays import free, holes_of
from ..oracle_geometry.scenes import occluded_room, quad, scene_of, tilted, triangles_of, wall_lights

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (24, 14)


@dataclasses.dataclass(frozen=True)
class Shot:
    """The records of one frame up to its shadow samples, flattened to pixels."""

    scene: Scene
    params: Params
    radius: float
    hierarchy: Hierarchy
    gbuffer: GBuffer
    lighting: Lighting
    shadows: ShadowSamples

    @property
    def position(self) -> Any:
        return self.gbuffer.position.reshape(-1, 3).astype(np.float64)

    @property
    def normal(self) -> Any:
        return self.gbuffer.normal.reshape(-1, 3).astype(np.float64)

    @property
    def lifted(self) -> Any:
        """The receivers, just off their surfaces."""
        return self.position + 2e-5 * self.gbuffer.geometric_normal.reshape(-1, 3)

    def slots(self, plane: Any) -> Any:
        """(pixels, k, ...) of a (H, W, k, ...) plane."""
        return plane.reshape(-1, self.params.shadow_samples, *plane.shape[3:])

    @property
    def picks(self) -> Any:
        return self.slots(self.lighting.light)


def leaning(lights: Lights) -> Lights:
    """`lights` with normals off the axes: their second moments have mixed terms."""
    normal = lights.normal + np.random.default_rng(1).uniform(-0.3, 0.3, lights.normal.shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    isotropic = ~lights.normal.any(axis=1)
    return dataclasses.replace(lights, normal=np.where(isotropic[:, None], 0, normal).astype(np.float32))


def room_with_hole(lean: bool = False) -> Scene:
    """The room, with a laced screen that rays pass here and not there; its lights may lean."""
    lights = wall_lights(3, 60)
    scene = occluded_room(leaning(lights) if lean else lights)
    texture = np.full((6, 6, 4), 255, np.uint8)
    texture[::2, ::2, 3] = 0
    screen = quad((-1.5, 0, 0.8), (1.0, 0, 0.8), (1.0, 1.8, 0.8), (-1.5, 1.8, 0.8), len(scene.materials), uv=True)
    lace = Material("lace", texture=0, alpha_cutoff=0.5)
    return dataclasses.replace(
        scene, meshes=[*scene.meshes, screen], materials=[*scene.materials, lace], textures=[texture]
    )


@cache
def shot(lean: bool = False, **settings: Any) -> Shot:
    # One candidate: omega is the stored member's own.
    scene, params = room_with_hole(lean), Params(**{"member_candidates": 1} | settings)
    engine = CpuEngine(scene)
    assert scene.light_list is not None
    hierarchy = engine.build_hierarchy(scene.light_list, params)
    gbuffer = tilted(engine.render_gbuffer(CAMERA, SIZE))
    lighting = engine.light(hierarchy, gbuffer, params)
    shadows = engine.trace_shadow_rays(hierarchy, gbuffer, lighting, params)
    return Shot(scene, params, engine.scene_radius, hierarchy, gbuffer, lighting, shadows)


VARIANTS: dict[str, dict[str, Any]] = {
    "ours": {},
    "a low cap": {"omega_max": 2.0},
    "scatter": {"construction": "scatter", "shadow_samples": 3, "omega_max": 2.0},
    "coarse only": {"first_shadow_level": 2, "levels": 3},
    "first_level 1": {"first_level": 1, "alpha": 2.0},
    "mean_energy": {"lobe": "mean_energy", "omega_max": 0.7},
    "mean": {"lobe": "mean", "omega_max": "none", "first_shadow_level": 1},
    "corrected": {"shadow_estimator": "corrected", "omega_max": 8.0, "first_shadow_level": 1},
    "average": {"shadow_estimator": "average"},
    "ratio_rgb": {"shadow_estimator": "ratio_rgb", "first_shadow_level": 1},
    "ratio_rgb, even picks": {"shadow_estimator": "ratio_rgb", "importance": False, "falloff": "softened"},
    "race": {"picker": "race", "shadow_samples": 5},
    "jitter": {"shadow_points": "jitter"},
    "jitter, wide": {"shadow_points": "jitter", "deviation_scale": 2.0, "first_shadow_level": 1},
    "jitter, none": {"shadow_points": "jitter", "deviation_scale": 0.0, "first_shadow_level": 1},
    "jitter, average": {"shadow_points": "jitter", "shadow_estimator": "average", "first_shadow_level": 2},
    "jitter, rgb": {"shadow_points": "jitter", "shadow_estimator": "ratio_rgb"},
}
MEMBERS = [name for name, settings in VARIANTS.items() if settings.get("shadow_points") != "jitter"]
JITTER = [name for name in VARIANTS if name not in MEMBERS]


@pytest.mark.parametrize("name", VARIANTS)
def test_the_variant_picks_from_several_levels(name: str) -> None:
    """The tests below look at something: every pixel has its picks, and grid lights are among them."""
    s = shot(**VARIANTS[name])
    assert (s.picks >= 0).all()
    assert len(np.unique(s.picks)) > 10
    inputs = s.hierarchy.offset[1]
    assert ((s.picks >= inputs).mean() > 0.1) and s.hierarchy.top >= 2
    assert 0.05 < s.shadows.visible.mean() < 0.95


@pytest.mark.parametrize("name", MEMBERS)
def test_rays_end_on_a_member_of_the_picked_light(name: str) -> None:
    s = shot(**VARIANTS[name])
    member = s.slots(s.shadows.member)
    assert ((member >= 0) & (member < s.hierarchy.offset[1])).all()
    assert np.array_equal(s.slots(s.shadows.point), s.hierarchy.position[member])
    shares = member_shares(s.hierarchy, s.params.construction)
    assert (shares[s.picks, member] > 1e-7).all()
    own = s.picks < s.hierarchy.offset[1]
    assert (member[own] == s.picks[own]).all()


@pytest.mark.parametrize("name", JITTER)
def test_jittered_rays_end_near_the_centre(name: str) -> None:
    s = shot(**VARIANTS[name])
    assert (s.shadows.member == -1).all() and (s.shadows.omega == 1).all()
    gap = np.abs(s.slots(s.shadows.point).astype(np.float64) - s.hierarchy.position[s.picks])
    reach = s.params.deviation_scale * np.pi * s.hierarchy.deviation[s.picks].astype(np.float64)
    assert (gap <= reach * (1 + 1e-5) + 1e-6).all()
    if s.params.deviation_scale:
        used = (gap / np.maximum(reach, 1e-9))[reach > 0.01]
        assert used.max() > 0.7 and (used > 0.1).mean() > 0.5


@pytest.mark.parametrize("name", VARIANTS)
def test_visible_is_the_ray_to_the_stored_point(name: str) -> None:
    s = shot(**VARIANTS[name])
    k = s.params.shadow_samples
    origin = np.repeat(s.lifted, k, axis=0)
    target = s.slots(s.shadows.point).reshape(-1, 3)
    is_free, sure = free(triangles_of(s.scene), origin, target, holes_of(s.scene), edge=1e-4, ends=1e-3)
    traced = s.slots(s.shadows.omega).ravel() > 0
    if s.params.shadow_estimator == "average":
        traced[:] = True
    checked = sure & traced
    assert checked.mean() > 0.5
    found = s.slots(s.shadows.visible).ravel()
    assert np.array_equal(found[checked].astype(bool), is_free[checked])
    assert not found[~traced].any(), "a sample of no weight is not traced"
    assert 0.1 < is_free[checked].mean() < 0.95


@pytest.mark.parametrize("lean", [False, True])
@pytest.mark.parametrize("name", MEMBERS)
def test_omega_is_the_members_cosines_over_the_grid_lights(name: str, lean: bool) -> None:
    s = shot(lean=lean, **VARIANTS[name])
    h = s.hierarchy
    cosine, emitted, _ = geometry(h, np.arange(len(h.position)), s.position, s.normal, s.params.lobe)
    rows = np.arange(len(s.position))[:, None]
    received = cosine * emitted
    member, whole = s.slots(s.shadows.member), received[rows, s.picks]
    cap = np.inf if s.params.omega_max == "none" else float(s.params.omega_max)
    wanted = np.minimum(cap, received[rows, member] / np.maximum(whole, 1e-12))
    wanted[member == s.picks] = 1
    omega = s.slots(s.shadows.omega)
    # Near a grid light's horizon the quotient of two small float32 numbers says little.
    sure = (whole > 1e-3) | (member == s.picks)
    assert sure.mean() > 0.9
    np.testing.assert_allclose(omega[sure], wanted[sure], rtol=2e-3, atol=1e-5)
    assert (omega >= 0).all() and np.isfinite(omega).all()
    assert (omega[member != s.picks] <= np.float32(cap)).all()
    drawn = sure & (member != s.picks)
    assert (omega[drawn] == 0).any() and ((omega[drawn] > 0) & (omega[drawn] < 0.99 * cap)).any()
    if cap < 8:  # few members go beyond
        assert (omega[drawn] > 0.999 * cap).any(), "the cap is never reached: a test of nothing"


@pytest.mark.parametrize("name", VARIANTS)
def test_s_and_its_weight_are_means_over_the_samples(name: str) -> None:
    s = shot(**VARIANTS[name])
    estimator = s.params.shadow_estimator
    omega = s.slots(s.shadows.omega).astype(np.float64)
    visible = s.slots(s.shadows.visible).astype(np.float64)
    if estimator == "ratio_rgb":
        rows = np.arange(len(s.position))[:, None]
        c = contributions(s.hierarchy, s.position, s.normal, s.params, s.radius)
        f = pick_weights(s.hierarchy, c, s.params)
        share = (f.sum(axis=1)[:, None] / f[rows, s.picks])[..., None] * c[rows, s.picks] * omega[..., None]
        wanted_s, wanted_u = (share * visible[..., None]).mean(axis=1), share.mean(axis=1)
        tolerance = {"rtol": 5e-3, "atol": 2e-4 * wanted_u.max()}
    else:
        share = np.ones_like(omega) if estimator == "average" else omega
        wanted_s = (share * visible).mean(axis=1)[:, None]
        wanted_u = omega.mean(axis=1)[:, None] if estimator == "ratio" else np.ones((len(omega), 1))
        tolerance = {"rtol": 1e-6, "atol": 1e-6}
    channels = wanted_s.shape[1]
    assert s.shadows.shadowed.shape == s.shadows.weight.shape == (SIZE[1], SIZE[0], channels)
    np.testing.assert_allclose(s.shadows.shadowed.reshape(-1, channels), wanted_s, **tolerance)
    np.testing.assert_allclose(s.shadows.weight.reshape(-1, channels), wanted_u, **tolerance)
    if estimator != "corrected":
        assert (s.shadows.shadowed <= s.shadows.weight * (1 + 1e-5)).all()


# --- pixels without samples ---------------------------------------------------------------------------------------


def open_stage() -> Scene:
    """A floor seen from above its edge: most of the picture is background; one light, in front of the floor only."""
    lights = wall_lights(1, 1, oriented=0.0)
    floor = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    wall = quad((-1, 0, -1), (1, 0, -1), (1, 1, -1), (-1, 1, -1))
    behind = dataclasses.replace(lights, position=np.float32([[0.2, 0.8, -2.0]]), flux=np.float32([[3, 2, 1]]))
    return scene_of([floor, wall], light_list=behind)


@pytest.mark.parametrize("settings", [{}, {"shadow_estimator": "ratio_rgb"}, {"shadow_estimator": "average"},
                                      {"shadow_estimator": "corrected"}, {"shadow_points": "jitter"}])  # fmt: skip
def test_pixels_that_nothing_lights_have_no_weight(settings: dict[str, Any]) -> None:
    """The wall's front and the background pick nothing: pick -1, weight 0, no ray."""
    engine, params = CpuEngine(open_stage()), Params(**settings)
    assert engine.scene.light_list is not None
    h = engine.build_hierarchy(engine.scene.light_list, params)
    g = engine.render_gbuffer(Camera("c", (0.0, 1.2, 3.0), (0.0, 0.5, 0.0), fov_y_deg=60), (31, 19))
    lighting = engine.light(h, g, params)
    shadows = engine.trace_shadow_rays(h, g, lighting, params)
    background, wall = g.depth == 0, (g.depth > 0) & (g.normal[..., 2] > 0.9)
    floor = g.normal[..., 1] > 0.9
    assert background.sum() > 50 and wall.sum() > 20 and floor.sum() > 20
    for dark in (background, wall):
        assert (lighting.light[dark] == -1).all()
        assert not lighting.irradiance[dark].any()
        for name in ("point", "omega", "visible", "shadowed", "weight"):
            assert not getattr(shadows, name)[dark].any(), name
        assert (shadows.member[dark] == -1).all()
    assert (lighting.light[floor] >= 0).all() and (shadows.weight[floor] > 0).all()
    assert not shadows.visible[floor].any(), "the wall stands between"


@pytest.mark.parametrize("estimator", ["ratio", "ratio_rgb"])
def test_no_samples_trace_no_rays(estimator: str) -> None:
    scene, params = room_with_hole(), Params(shadow_samples=0, shadow_estimator=estimator)
    engine = CpuEngine(scene)
    assert scene.light_list is not None
    h = engine.build_hierarchy(scene.light_list, params)
    assert h.members is None
    g = engine.render_gbuffer(CAMERA, SIZE)
    shadows = engine.trace_shadow_rays(h, g, engine.light(h, g, params), params)
    assert shadows.point.shape == (SIZE[1], SIZE[0], 0, 3) and shadows.visible.shape == (SIZE[1], SIZE[0], 0)
    assert shadows.shadowed.shape[2] == (3 if estimator == "ratio_rgb" else 1)
    assert not shadows.weight.any()


def test_members_are_asked_for_before_they_are_drawn_from() -> None:
    """A hierarchy without member lists is refused, with its reason, where the samples need them."""
    scene, params = room_with_hole(), Params()
    engine = CpuEngine(scene)
    assert scene.light_list is not None
    h = engine.build_hierarchy(scene.light_list, Params(shadow_samples=0))
    g = engine.render_gbuffer(CAMERA, (4, 4))
    lighting = engine.light(h, g, params)
    with pytest.raises(ValueError, match="member"):
        engine.trace_shadow_rays(h, g, lighting, params)


def test_shadow_rays_start_on_the_viewers_side() -> None:
    """A sheet is lit from the side it is seen from, and only from that side."""
    sheet = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    for side in (1.0, -1.0):
        for eye in (2.0, -2.0):
            lights = dataclasses.replace(wall_lights(1, 1, oriented=0.0), position=np.float32([[0.1, side, 0.1]]))
            engine = CpuEngine(scene_of([Mesh(sheet.position, sheet.index)], light_list=lights))
            params = Params()
            h = engine.build_hierarchy(lights, params)
            g = engine.render_gbuffer(Camera("c", (0.0, eye, 0.01), (0.0, 0.0, 0.0), (0, 0, -1), 30.0), (6, 6))
            shadows = engine.trace_shadow_rays(h, g, engine.light(h, g, params), params)
            assert (shadows.visible == (1 if side * eye > 0 else 0)).all()

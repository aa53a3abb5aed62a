"""The sum over all lights as an estimator: every light at every pixel, with as many shadow rays as wanted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine, check_compensation
from lab.params import Params
from lab.records import Floats, Lights
from lab.reference.estimate import Reference
from lab.reference.path_tracer import mean_variance
from lab.scene.scene import Camera

# What one step may take: a fraction of a second of either.
_EVALUATIONS_A_BAND, _RAYS_A_BAND = 3e8, 1e6
_FIRST_PASS = 16
_PATHS_A_STEP = 400_000


class BruteForce:
    """All lights of `lights` (or the VPLs of `params`, or the scene's list); see ``core_cpp/src/brute_force.cpp``.

    A pixel with more lights than draws picks them in proportion to what they send unshadowed: an unbiased estimate of
    the sum of all. The direct layer is the scene's own lights, without a light list; with ``compensation=path`` the
    part of the light that the clamp leaves out comes from short paths.

    A pass draws so many lights at every pixel, one band of rows a step; then direct light and short paths catch up
    with as many samples, and the pass counts.
    """

    default_spp = 1024

    def __init__(
        self, engine: CpuEngine, camera: Camera, size: tuple[int, int], params: Params, lights: Lights | None = None
    ) -> None:
        check_compensation(engine.scene, params)
        self._engine, self._params = engine, params
        self._gbuffer = engine.render_gbuffer(camera, size)
        self._lights = in_morton_order(engine.trace_vpls(params) if lights is None else lights)
        self._compensated = params.compensation == "path"
        scene = engine.scene
        emitting = any(max(scene.materials[mesh.material].emission) > 0 for mesh in scene.meshes)
        self._direct_is_random = emitting or len(scene.points) + len(scene.spots) > 1
        height, width = self._gbuffer.depth.shape
        images = ("irradiance", "variance", "unshadowed", "band_irradiance", "band_variance")
        sums = ("direct", "direct_square", "left_out", "left_out_square")
        # Replaced as one, never changed in place where it counts: Ctrl-C at any moment leaves what belongs together.
        self._state: dict[str, Any] = {
            **{name: np.zeros((height, width, 3)) for name in (*images, *sums)},
            "exact_pixels": np.zeros(height, np.int64),
            **dict.fromkeys(("samples", "weight", "passes", "draws", "rows", "direct_samples", "short_paths"), 0),
            "all_lights": False,
        }
        self.seconds = 0.0

    @property
    def samples(self) -> int:
        """Lights drawn a pixel."""
        return int(self._state["samples"])

    @property
    def pending(self) -> float:
        """How much of a pass there is already, in draws."""
        s, height = self._state, self._gbuffer.depth.shape[0]
        behind = [s["rows"] / height]
        for counter, needed in (("direct_samples", self._direct_is_random), ("short_paths", self._compensated)):
            if needed:
                behind.append((s[counter] - s["samples"]) / max(1, s["draws"]))
        return float(s["draws"] * sum(behind) / len(behind))

    @property
    def exact(self) -> bool:
        """Every light has had its ray, and nothing else is random."""
        return bool(self._state["all_lights"]) and not self._compensated and not self._direct_is_random

    def step(self, most: int | None, guess: int | None) -> None:
        """The next band of rows, or the next samples of direct light or of short paths; a pass ends when all are in."""
        s = self._state
        wanted = guess or max(_FIRST_PASS, s["samples"])
        wanted = most if most is not None and (guess is None or guess > most) else wanted
        if s["draws"] == 0 or (most is not None and s["draws"] > most + 1):
            self._state = s = {**s, "draws": wanted + wanted % 2, "rows": 0}  # two a stratum
        target, chunk = s["samples"] + s["draws"], max(1, _PATHS_A_STEP // self._gbuffer.depth.size)
        if s["rows"] < self._gbuffer.depth.shape[0] and not s["all_lights"]:
            self._add_band()
        elif s["direct_samples"] < (target if self._direct_is_random else 1):
            count = min(chunk, target - s["direct_samples"]) if self._direct_is_random else 1
            found = self._engine.trace_direct(self._gbuffer, s["direct_samples"], count, self._params)
            sums = {name: s[name] + found[name] for name in ("direct", "direct_square")}
            self._state = {**s, **sums, "direct_samples": s["direct_samples"] + count}
        elif self._compensated and s["short_paths"] < target:
            count = min(chunk, target - s["short_paths"])
            found = self._engine.trace_compensation(self._gbuffer, s["short_paths"], count, self._params)
            pairs = (("left_out", "irradiance"), ("left_out_square", "irradiance_square"))
            sums = {name: s[name] + found[source] for name, source in pairs}
            self._state = {**s, **sums, "short_paths": s["short_paths"] + count}
        else:
            self._end_pass()

    def _add_band(self) -> None:
        s = self._state
        height, width = self._gbuffer.depth.shape
        a_row = width * max(len(self._lights) / _EVALUATIONS_A_BAND, min(s["draws"], len(self._lights)) / _RAYS_A_BAND)
        first = s["rows"]
        last = min(height, first + max(1, math.floor(1 / a_row)))
        band = self._engine.brute_force(
            self._lights, self._gbuffer, (first, last), self._params, draws=s["draws"], pass_number=s["passes"]
        )
        # Rows from s["rows"] on don't count yet.
        s["band_irradiance"][first:last], s["band_variance"][first:last] = band["irradiance"], band["variance"]
        s["unshadowed"][first:last] = band["unshadowed"]
        s["exact_pixels"][first:last] = 0
        s["exact_pixels"][first] = band["exact_pixels"]
        self._state = {**s, "rows": last}

    def _end_pass(self) -> None:
        s, draws = self._state, self._state["draws"]
        new: dict[str, Any] = {"samples": s["samples"] + draws, "passes": s["passes"] + 1, "draws": 0, "rows": 0}
        if not s["all_lights"]:
            if s["exact_pixels"].sum() == (self._gbuffer.depth > 0).sum():
                # Every light had its ray: what was estimated before says nothing more.
                exact = s["band_irradiance"].copy()
                new |= {"irradiance": exact, "variance": np.zeros_like(exact), "weight": 1, "all_lights": True}
            else:
                new["irradiance"] = s["irradiance"] + draws * s["band_irradiance"]
                new["variance"] = s["variance"] + float(draws) ** 2 * s["band_variance"]
                new["weight"] = s["weight"] + draws
        self._state = {**s, **new}

    def reference(self) -> Reference:
        """The sum over all passes, weighted by their draws."""
        s = self._state
        weight = max(1, s["weight"])
        irradiance, variance = s["irradiance"] / weight, s["variance"] / float(weight) ** 2
        if s["short_paths"]:
            irradiance = irradiance + s["left_out"] / s["short_paths"]
            variance = variance + mean_variance(s["left_out"], s["left_out_square"], s["short_paths"])
        reflectance = self._gbuffer.albedo.astype(np.float64) / np.pi
        direct = s["direct"] / max(1, s["direct_samples"])
        direct_variance = np.zeros_like(direct)
        if self._direct_is_random:
            direct_variance = mean_variance(s["direct"], s["direct_square"], s["direct_samples"])
        indirect_variance = variance * reflectance**2
        return Reference(
            "brute_force",
            direct,
            irradiance * reflectance,
            direct_variance,
            indirect_variance,
            direct_variance + indirect_variance,
            self.samples,
            self.exact,
            self.seconds,
            unshadowed=s["unshadowed"].copy(),
        )

    def state(self) -> dict[str, Any]:
        """Sums and counters."""
        return self._state | {"seconds": self.seconds}

    def restore(self, state: dict[str, Any]) -> None:
        """Sums and counters."""
        self._state = {
            name: np.array(state[name]) if isinstance(value, np.ndarray) else type(value)(state[name])
            for name, value in self._state.items()
        }
        self.seconds = float(state["seconds"])


def in_morton_order(lights: Lights) -> Lights:
    """`lights` along a Z-order curve: neighbours in the list are neighbours in space, which makes strata of it."""
    order = np.argsort(_morton_codes(lights.position), kind="stable")
    normal = np.zeros_like(lights.position) if lights.normal is None else lights.normal
    return Lights(lights.position[order], lights.flux[order], normal[order], lights.paths_launched)


def _morton_codes(position: Floats) -> NDArray[np.uint64]:
    low = position.min(axis=0).astype(np.float64)
    extent = max(float((position.max(axis=0) - low).max()), np.finfo(np.float64).tiny)
    cell = np.minimum((position - low) / extent * 2**20, 2**20 - 1).astype(np.uint64)
    code = np.zeros(len(position), np.uint64)
    for axis in range(3):
        bits = cell[:, axis]
        # 20 bits, spread to every third place.
        for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F)):
            bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
        for shift, mask in ((4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):
            bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
        code |= bits << np.uint64(axis)
    return code

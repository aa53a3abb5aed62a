"""Where shadow samples go: on which levels and lights the picks of a frame fall, and how many rays are blocked.

A pick comes with its own probability p = f / F. So the picks alone estimate how the probabilities are spread: the mean
of -log p is the entropy of the pixel's distribution without bias, the mean of p is the sum of p^2 (Simpson's index),
whose inverse is the effective number of lights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.engine.dependencies import draws_members
from lab.engine.engine import Engine
from lab.errors import LabError
from lab.params import SETTINGS, Params
from lab.records import Frame, Hierarchy, Lighting, ShadowSamples
from lab.reference.estimate import Progress

Doubles = NDArray[np.float64]
Counts = NDArray[np.int64]

MOST_PICKS = 4096
_PICKS_A_PASS = 16
"""So many at a time: all 64 at once would need half a gigabyte at 640x360."""


@dataclass(frozen=True)
class PickedLight:
    """A grid light and the shadow samples that went to it.

    Attributes:
        light: merged index.    level: its level.    picks: samples over the whole image.    share: of all picks.
        blocked: share of its rays that were blocked; NaN where none was traced.
    """

    light: int
    level: int
    picks: int
    share: float
    blocked: float


@dataclass(frozen=True)
class ShadowDistribution:
    """Where the picks of a frame went. Maps are NaN where nothing was picked, `blocked` where nothing was traced.

    Attributes:
        picks: shadow samples a pixel.
        offset: (L + 1,) of the hierarchy: level l is rows ``offset[l]:offset[l + 1]`` of the lights.
        level_picks, level_rays, level_blocked: (L,) picks, rays traced and rays blocked over the whole image.
        light_picks, light_rays, light_blocked: (m,) the same of each grid light.
        level_share: (L, H, W) share of each pixel's picks that fell on each level.
        entropy: (H, W) bits, of each pixel's distribution over lights; 0: always the same one.
        effective_lights: (H, W) 1 over the mean of p: so many lights, picked evenly, would vary as much. From a few
            picks it is too high: never more than the number of lights, but by a quarter or so from four picks.
        blocked: (H, W) share of rays that were blocked.
    """

    picks: int
    offset: Counts
    level_picks: Counts
    level_rays: Counts
    level_blocked: Counts
    light_picks: Counts
    light_rays: Counts
    light_blocked: Counts
    level_share: NDArray[np.float32]
    entropy: Doubles
    effective_lights: Doubles
    blocked: Doubles

    @property
    def level_shares(self) -> Doubles:
        """(L,) share of all picks that fell on each level."""
        shares: Doubles = self.level_picks / max(1, int(self.level_picks.sum()))
        return shares

    @property
    def level_blocked_shares(self) -> Doubles:
        """(L,) share of each level's rays that were blocked; NaN where none was traced."""
        return _ratio(self.level_blocked, self.level_rays)

    @property
    def mean_level(self) -> Doubles:
        """(H, W) mean level of the picks."""
        levels = np.arange(len(self.level_share), dtype=np.float64)
        mean: Doubles = np.tensordot(levels, self.level_share.astype(np.float64), axes=1)
        return mean

    def summary(self) -> dict[str, float]:
        """Means over the image: of the maps over pixels with picks, of shares over all picks or rays; NaN of none.

        That of the effective number of lights is the harmonic one, which few picks don't make higher.
        """
        picks, rays = int(self.level_picks.sum()), int(self.level_rays.sum())
        picked = np.isfinite(self.entropy)
        return {
            "entropy": float(self.entropy[picked].mean()) if picked.any() else np.nan,
            "effective_lights": float(1 / (1 / self.effective_lights[picked]).mean()) if picked.any() else np.nan,
            "mean_level": float(self.level_shares @ np.arange(len(self.level_picks))) if picks else np.nan,
            "blocked": int(self.level_blocked.sum()) / rays if rays else np.nan,
            "without_ray": 1 - rays / picks if picks else np.nan,
            "lights_picked": int((self.light_picks > 0).sum()),
        }

    def top_lights(self, count: int = 20) -> list[PickedLight]:
        """The lights that were picked most often, most first; of equals the finer one first."""
        order = np.argsort(-self.light_picks, kind="stable")[:count]
        level = np.searchsorted(self.offset, order, side="right") - 1
        share = self.light_picks / max(1, int(self.level_picks.sum()))
        blocked = _ratio(self.light_blocked, self.light_rays)
        return [
            PickedLight(int(i), int(at), int(self.light_picks[i]), float(share[i]), float(blocked[i]))
            for i, at in zip(order, level, strict=True)
            if self.light_picks[i] > 0
        ]

    def picks_histogram(self) -> tuple[Counts, Counts]:
        """How many lights were picked how often: edges (b + 1,) 0, 1, 2, 4, 8 .. and (b,) lights in each bin."""
        most = int(self.light_picks.max(initial=0))
        edges = np.array([0, *(1 << i for i in range(most.bit_length() + 1))], np.int64)
        place = np.searchsorted(edges, self.light_picks, side="right") - 1
        return edges, np.bincount(place, minlength=len(edges) - 1)


def shadow_distribution(frame: Frame) -> ShadowDistribution:
    """Where the frame's own picks went.

    Errors: :class:`LabError` where it has none (``shadow_samples=0``).
    """
    if frame.params.shadow_samples == 0:
        raise LabError("shadow_samples=0: the frame has no picks; sampled_distribution draws some for it")
    sums = _Sums(frame.hierarchy, frame.gbuffer.depth.shape)
    sums.add(frame.lighting, frame.shadows, frame.params)
    return sums.distribution()


def sampled_distribution(
    engine: Engine, frame: Frame, picks: int = 64, progress: Progress | None = None
) -> ShadowDistribution:
    """Where picks of the frame's settings go, from as many picks a pixel as wanted, drawn and traced for this.

    Args:
        engine: of the frame's scene.
        frame: its hierarchy, G-buffer and settings are used, its own picks are not.
        picks: a pixel, 1 to :data:`MOST_PICKS`.
        progress: called with the share that is done and a line; may raise to end it.

    Errors: :class:`LabError` for another number of picks.
    """
    if not (isinstance(picks, int) and 1 <= picks <= MOST_PICKS):
        raise LabError(f"picks={picks}: expected a whole number from 1 to {MOST_PICKS} a pixel")
    # What has no part in it takes no time.
    params: Params = frame.params.replace(shadow_samples=1, direct_samples=0, compensation="none")
    hierarchy = frame.hierarchy
    if draws_members(params) and hierarchy.members is None:
        hierarchy = engine.build_hierarchy(frame.lights, params)
    sums = _Sums(hierarchy, frame.gbuffer.depth.shape)
    done, pass_number = 0, 0
    while done < picks:
        if progress:
            progress(done / picks, f"{done} of {picks} shadow samples a pixel")
        count = min(_PICKS_A_PASS, picks - done)
        number = (frame.params.frame + pass_number) % (int(SETTINGS["frame"].high) + 1)
        settings = params.replace(shadow_samples=count, frame=number)
        lighting = engine.light(hierarchy, frame.gbuffer, settings, False)
        sums.add(lighting, engine.trace_shadow_rays(hierarchy, frame.gbuffer, lighting, settings), settings)
        done, pass_number = done + count, pass_number + 1
    if progress:
        progress(1.0, f"{picks} shadow samples a pixel")
    return sums.distribution()


class _Sums:
    """Sums over picks, pass by pass."""

    def __init__(self, hierarchy: Hierarchy, shape: tuple[int, ...]) -> None:
        self._offset = hierarchy.offset
        sizes = np.diff(hierarchy.offset)
        self._level_of = np.repeat(np.arange(len(sizes), dtype=np.uint8), sizes)
        self._samples = 0
        self._by_level = np.zeros((len(sizes), *shape), np.int64)
        self._lights = np.zeros((3, len(self._level_of)), np.int64)  # picks, rays, blocked rays
        self._bits, self._p = np.zeros(shape), np.zeros(shape)
        self._rays, self._blocked = np.zeros(shape, np.int64), np.zeros(shape, np.int64)

    def add(self, lighting: Lighting, shadows: ShadowSamples, params: Params) -> None:
        light, picked = lighting.light, lighting.light >= 0
        level = np.where(picked, self._level_of[light], len(self._by_level))
        for i in range(len(self._by_level)):
            self._by_level[i] += (level == i).sum(axis=-1)
        p = np.divide(
            lighting.target_weight,
            lighting.weight_sum[..., None],
            out=np.ones(light.shape),  # of no pick: adds nothing to the entropy
            where=picked,
            dtype=np.float64,
        )
        self._bits -= np.log2(p).sum(axis=-1)
        self._p += (p * picked).sum(axis=-1)
        # A sample whose member faces away counts nothing, and no ray is sent to it, but for the plain average.
        traced = picked if params.shadow_estimator == "average" else picked & (shadows.omega > 0)
        blocked = traced & (shadows.visible == 0)
        self._rays += traced.sum(axis=-1)
        self._blocked += blocked.sum(axis=-1)
        for row, which in enumerate((picked, traced, blocked)):
            self._lights[row] += np.bincount(light[which], minlength=len(self._level_of))
        self._samples += light.shape[-1]

    def distribution(self) -> ShadowDistribution:
        picks = self._by_level.sum(axis=0)
        running = np.concatenate([np.zeros((3, 1), np.int64), np.cumsum(self._lights, axis=1)], axis=1)
        level_picks, level_rays, level_blocked = running[:, self._offset[1:]] - running[:, self._offset[:-1]]
        light_picks, light_rays, light_blocked = self._lights
        return ShadowDistribution(
            picks=self._samples,
            offset=self._offset,
            level_picks=level_picks,
            level_rays=level_rays,
            level_blocked=level_blocked,
            light_picks=light_picks,
            light_rays=light_rays,
            light_blocked=light_blocked,
            level_share=_ratio(self._by_level, picks).astype(np.float32),
            entropy=_ratio(self._bits, picks),
            effective_lights=1 / _ratio(self._p, picks),
            blocked=_ratio(self._blocked, self._rays),
        )


def _ratio(part: NDArray[np.number], whole: NDArray[np.number]) -> Doubles:
    """`part` / `whole`, NaN where there is no whole."""
    out = np.full(np.broadcast_shapes(part.shape, whole.shape), np.nan)
    np.divide(part, whole, out=out, where=whole > 0)
    return out

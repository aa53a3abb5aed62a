"""What every input light itself sends to a pixel, and whether it is seen from there: the truth of an account."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine
from lab.pixel.records import Doubles
from lab.records import Frame


class InputLights:
    """The n input lights as pixel (x, y) of a frame sees them, in float64; each is traced to once, when first asked.

    Attributes:
        facing: (n,) receiver's cosine times emission: what omega compares.
        sent: (n, 3) unshadowed irradiance, flux / pi * facing * G.
        rays: rays traced so far.
    """

    def __init__(self, engine: CpuEngine, frame: Frame, x: int, y: int) -> None:
        self._engine, self._gbuffer, self._x, self._y = engine, frame.gbuffer, x, y
        h, params = frame.hierarchy, frame.params
        n = len(h.input_index)
        self._position = h.position[:n]
        to = self._position.astype(np.float64) - frame.gbuffer.position[y, x]
        square = np.maximum((to**2).sum(axis=1), np.finfo(np.float32).tiny)
        direction = to / np.sqrt(square)[:, None]
        cosine = np.maximum(0, direction @ frame.gbuffer.normal[y, x].astype(np.float64))
        lambertian = np.maximum(0, -(direction * h.normal[:n]).sum(axis=1))
        self.facing: Doubles = cosine * np.where(h.oriented[:n] > 0, lambertian, 0.25)
        clamp = (params.clamp_distance * engine.scene_radius) ** 2
        falloff = 1 / (np.maximum(square, clamp) if params.falloff == "clamped" else square + clamp)
        self.sent: Doubles = (self.facing * falloff / np.pi)[:, None] * h.flux[:n]
        self._visible = np.full(n, -1, np.int8)
        self.rays = 0

    def visible(self, light: NDArray[np.integer]) -> Doubles:
        """1 or 0 for each of `light`: whether its ray is free."""
        unknown = light[self._visible[light] < 0]
        if len(unknown):
            targets = np.ascontiguousarray(self._position[unknown])
            self._visible[unknown] = self._engine.visible(self._gbuffer, self._y, self._x, targets)
            self.rays += len(unknown)
        free: Doubles = self._visible[light].astype(np.float64)
        return free

    def received(self) -> Doubles:
        """(n, 3) irradiance from each light with its own shadow ray; lights that send nothing are not traced to."""
        sending = np.flatnonzero(self.sent.any(axis=1))
        result = np.zeros_like(self.sent)
        result[sending] = self.sent[sending] * self.visible(sending)[:, None]
        return result

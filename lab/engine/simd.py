"""Which instruction set the core's hot loops use: the best that the processor has, unless LAB_SIMD names another."""

from __future__ import annotations

import os

from lab import _core
from lab.errors import LabError

VARIABLE = "LAB_SIMD"


def set_simd(name: str) -> None:
    """Uses the instruction set `name`, of ``_core.info()["simd_choices"]``, from now on.

    Pictures agree within rounding between sets, and to the bit within one. Errors: :class:`LabError`.
    """
    try:
        _core.set_simd(name)
    except ValueError as error:
        raise LabError(str(error)) from None


def use_simd_of_environment() -> None:
    """Obeys the variable LAB_SIMD where it is set and not empty."""
    name = os.environ.get(VARIABLE, "")
    if name:
        try:
            set_simd(name)
        except LabError as error:
            raise LabError(f"{VARIABLE}: {error}; unset it to use the best") from None

"""Settings as a shader's ``Params`` takes them."""

from __future__ import annotations

from lab.params import SETTINGS, Params


def params_uniform(params: Params) -> dict[str, int | float | bool]:
    """Every setting by name, words as their numbers: the value of a parameter ``ConstantBuffer<Params>``."""
    values: dict[str, int | float | bool] = {}
    for name, value in params.to_core().items():
        values[name] = SETTINGS[name].choices.index(value) if isinstance(value, str) else value
    return values

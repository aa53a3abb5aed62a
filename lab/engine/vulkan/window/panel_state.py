"""What the panel shows, and what it may ask for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from lab.params import Params, Value


@dataclass(frozen=True)
class PanelState:
    """What the panel shows.

    Attributes:
        params: the settings.    usual: those that a reset goes back to.    preset: the one chosen last.
        layers: names of all that can be shown.    layer: which is.    exposure: factor on light.
        scale: what the ends of its colours stand for.
        camera, cameras: the name of the scene's camera that was gone to last, and of all.
        speed: scene radii a second.
        options: switches of the view by name.
        times, lights, keys: lines about time, grid lights and keys; none: that part is hidden.
        message: what went wrong last.

    """

    params: Params
    usual: Params
    preset: str
    layers: tuple[str, ...]
    layer: str
    exposure: float
    scale: str
    camera: str
    cameras: tuple[str, ...]
    speed: float
    options: dict[str, bool] = field(default_factory=dict)
    times: tuple[str, ...] = ()
    lights: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()
    message: str = ""


class PanelActions(Protocol):
    """What the panel asks for. Nothing is done at once: the next frame has it."""

    def set(self, name: str, value: Value) -> None:
        """Changes a setting."""

    def choose_preset(self, name: str) -> None:
        """Starts from a preset."""

    def reset(self, names: tuple[str, ...]) -> None:
        """These settings as the preset has them."""

    def choose_layer(self, name: str) -> None:
        """Shows another layer."""

    def choose_camera(self, name: str) -> None:
        """Goes to a camera of the scene."""

    def set_exposure(self, exposure: float) -> None:
        """Makes light brighter or darker."""

    def set_speed(self, radii: float) -> None:
        """Flies faster or slower."""

    def set_option(self, name: str, on: bool) -> None:
        """Turns a switch of the view."""

    def press(self, key: str) -> None:
        """As the key would."""

"""Which Vulkan devices there are, what each lacks, and what mends it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lab.errors import LabError, nearest

if TYPE_CHECKING:
    import slangpy as spy

REQUIRED = {
    "ray_tracing": "ray tracing pipelines, for every ray",
    "acceleration_structure": "acceleration structures, for every ray",
    "int64": "64-bit integers, for the fixed-point sums of S1",
    "atomic_int64": "64-bit atomics, for the fixed-point sums of S1",
    "double": "64-bit floats, for the moments of grid lights",
    "timestamp_query": "timestamps, for the time of each stage",
}
"""Features that a device must have, and what needs them."""

SOFTWARE = "make software-vulkan  installs a driver that needs no graphics card"


DRIVERS = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
"""What tells the Vulkan loader which drivers to look for."""


@dataclass(frozen=True)
class Adapter:
    """A Vulkan device as the driver names it.

    Attributes:
        index: its place in the list, as ``--device`` takes it.    luid: how the driver tells it from others.
        lacks: names of :data:`REQUIRED` that it has not; ``None`` where nobody has looked yet.
        problem: why it can't be used at all, or "".

    """

    index: int
    name: str
    luid: tuple[int, ...]
    lacks: tuple[str, ...] | None = None
    problem: str = ""


def import_slangpy() -> Any:
    """The module slangpy, or a :class:`LabError` that says what to install."""
    try:
        with _without_torch():
            import slangpy
    except ModuleNotFoundError as error:
        if error.name != "slangpy":
            raise
        raise LabError("the Vulkan engine needs slangpy, which is not installed: make setup EXTRA=vulkan") from None
    except ImportError as error:
        # It links to libX11 and libatomic, with or without a display.
        raise LabError(
            f"slangpy can't be loaded ({' '.join(str(error).split())}). Debian, Ubuntu: apt-get install libx11-6 "
            "libatomic1; Fedora: dnf install libX11 libatomic"
        ) from None
    return slangpy


@contextmanager
def _without_torch() -> Iterator[None]:
    """Slangpy imports torch where it is installed, for functions that nothing here calls: three seconds."""
    hidden = "slangpy" not in sys.modules and "torch" not in sys.modules
    if hidden:
        sys.modules["torch"] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        if hidden:
            sys.modules.pop("torch", None)


def list_adapters() -> list[Adapter]:
    """Every Vulkan device of this machine; empty where no driver is installed."""
    spy = import_slangpy()
    found = spy.Device.enumerate_adapters(spy.DeviceType.vulkan)
    return [Adapter(index, info.name, tuple(info.luid)) for index, info in enumerate(found)]


def choose_adapter(adapters: list[Adapter], wanted: str) -> Adapter:
    """The one that `wanted` names: an index, a name, or a part of just one name; "" is the first.

    Errors: :class:`LabError` where there is no device at all, or none or several of that name.
    """
    if not adapters:
        named = next((name for name in DRIVERS if os.environ.get(name)), "")
        where = f" ({named}={os.environ[named]}: only that driver is looked for)" if named else ""
        raise LabError(f"no Vulkan device was found{where}: install the driver of your graphics card; or: {SOFTWARE}")
    if not wanted:
        return adapters[0]
    low = wanted.lower()
    fits = [adapter for adapter in adapters if low in (str(adapter.index), adapter.name.lower())]
    fits = fits or [adapter for adapter in adapters if low in adapter.name.lower()]
    if len(fits) == 1:
        return fits[0]
    there = ", ".join(f"{adapter.index} = {adapter.name}" for adapter in adapters)
    if fits:
        raise LabError(f"--device {wanted}: fits {len(fits)} devices; name one by its number: {there}")
    hint = nearest(wanted, [adapter.name for adapter in adapters])
    raise LabError(f"--device {wanted}: there is no such Vulkan device{hint}; there are: {there}")


def lacking(device: spy.Device) -> tuple[str, ...]:
    """Names of :data:`REQUIRED` that an open device has not."""
    spy = import_slangpy()
    return tuple(name for name in REQUIRED if not device.has_feature(getattr(spy.Feature, name)))


def open_device(adapter: Adapter, **options: Any) -> spy.Device:
    """A slangpy device on `adapter`, or a :class:`LabError`: its driver is too old, or it lacks a feature."""
    spy = import_slangpy()
    try:
        device = spy.Device(type=spy.DeviceType.vulkan, adapter_luid=list(adapter.luid), **options)
    except RuntimeError as error:
        raise LabError(
            f"{adapter.name}: its Vulkan driver can't be used ({_first_line(error)}), most likely because it is too "
            f"old (Mesa needs 24.1 or newer): update it; or: {SOFTWARE}"
        ) from None
    missing = lacking(device)
    if missing:
        device.close()
        wants = "; ".join(f"{name} ({REQUIRED[name]})" for name in missing)
        raise LabError(
            f"{adapter.name}: its driver lacks {wants}. Update the driver, name another device (lab info lists them); "
            f"or: {SOFTWARE}"
        )
    return device


def survey_adapters() -> list[Adapter]:
    """:func:`list_adapters` with what each lacks; opens each device, which takes a moment."""
    spy = import_slangpy()
    seen = []
    for adapter in list_adapters():
        try:
            device = spy.Device(type=spy.DeviceType.vulkan, adapter_luid=list(adapter.luid))
        except RuntimeError as error:
            seen.append(Adapter(adapter.index, adapter.name, adapter.luid, problem=_first_line(error)))
            continue
        seen.append(Adapter(adapter.index, adapter.name, adapter.luid, lacking(device)))
        device.close()
    return seen


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0].rstrip("!")

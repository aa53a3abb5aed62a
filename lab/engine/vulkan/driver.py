"""What slangpy does not tell of a device: its driver's name and version, and whether it is one at all.

Asked of the Vulkan loader itself (Vulkan 1.2 specification: VkPhysicalDeviceDriverProperties, VkPhysicalDeviceType).
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache

KINDS = ("other", "integrated", "discrete", "virtual", "software")
"""Names of VkPhysicalDeviceType: what other programs call CPU is a driver that computes on the processor."""

_LOADER = "libvulkan.so.1"
_API_1_2 = 1 << 22 | 2 << 12
_NAME, _UUID, _LUID = 256, 16, 8
_APPLICATION, _INSTANCE, _PROPERTIES, _IDS, _DRIVER = 0, 1, 1000059001, 1000071004, 1000196000


@dataclass(frozen=True)
class Driver:
    """Of one device.

    Attributes:
        device: its name.    kind: one of :data:`KINDS`.    driver: name and version.
        ids: how the driver tells the device from others.

    """

    device: str
    kind: str
    driver: str
    ids: tuple[bytes, ...]


def driver_of(name: str, luid: tuple[int, ...]) -> Driver | None:
    """The driver of the device that slangpy calls so; None where the loader knows none."""
    named = [driver for driver in _drivers() if driver.device == name]
    number = bytes(luid)
    own = [driver for driver in named if any(number.startswith(key) for key in driver.ids)]
    return next(iter(own or named), None)


class _Application(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("name", ctypes.c_char_p),
        ("version", ctypes.c_uint32),
        ("engine", ctypes.c_char_p),
        ("engine_version", ctypes.c_uint32),
        ("api", ctypes.c_uint32),
    ]


class _Instance(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("application", ctypes.POINTER(_Application)),
        ("layers", ctypes.c_uint32),
        ("layer_names", ctypes.c_void_p),
        ("extensions", ctypes.c_uint32),
        ("extension_names", ctypes.c_void_p),
    ]


class _DriverProperties(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("id", ctypes.c_int32),
        ("name", ctypes.c_char * _NAME),
        ("info", ctypes.c_char * _NAME),
        ("conformance", ctypes.c_uint8 * 4),
    ]


class _Ids(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("device", ctypes.c_uint8 * _UUID),
        ("driver", ctypes.c_uint8 * _UUID),
        ("luid", ctypes.c_uint8 * _LUID),
        ("node_mask", ctypes.c_uint32),
        ("luid_valid", ctypes.c_uint32),
    ]


class _Properties(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("api", ctypes.c_uint32),
        ("driver_version", ctypes.c_uint32),
        ("vendor", ctypes.c_uint32),
        ("device", ctypes.c_uint32),
        ("kind", ctypes.c_int32),
        ("name", ctypes.c_char * _NAME),
        ("cache", ctypes.c_uint8 * _UUID),
        ("limits", ctypes.c_uint64 * 128),  # more than there are
    ]


@cache
def _drivers() -> list[Driver]:
    try:
        loader = ctypes.CDLL(_LOADER)
    except OSError:
        return []
    application = _Application(type=_APPLICATION, api=_API_1_2)
    wanted = _Instance(type=_INSTANCE, application=ctypes.pointer(application))
    instance = ctypes.c_void_p()
    if loader.vkCreateInstance(ctypes.byref(wanted), None, ctypes.byref(instance)) != 0:
        return []
    try:
        count = ctypes.c_uint32()
        loader.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
        devices = (ctypes.c_void_p * count.value)()
        loader.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), devices)
        return [_describe(loader, ctypes.c_void_p(device)) for device in devices[: count.value]]
    finally:
        loader.vkDestroyInstance(instance, None)


def _describe(loader: ctypes.CDLL, device: ctypes.c_void_p) -> Driver:
    driver = _DriverProperties(type=_DRIVER)
    ids = _Ids(type=_IDS, next=ctypes.addressof(driver))
    about = _Properties(type=_PROPERTIES, next=ctypes.addressof(ids))
    loader.vkGetPhysicalDeviceProperties2(device, ctypes.byref(about))
    kind = KINDS[about.kind] if 0 <= about.kind < len(KINDS) else KINDS[0]
    keys = (bytes(ids.device),) + ((bytes(ids.luid),) if ids.luid_valid else ())
    words = f"{driver.name.decode(errors='replace')} {driver.info.decode(errors='replace')}"
    return Driver(about.name.decode(errors="replace"), kind, words.strip(), keys)

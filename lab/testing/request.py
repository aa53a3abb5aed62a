"""Which scene, camera and size a test asks for: by its markers, or by the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.errors import LabError, nearest

DEFAULT_SIZE = (160, 90)

MARKER = (
    "lab_scene(path, *, size=(width, height), camera=NAME): the scene that a test renders, looked for beside the "
    "test's file, then in rootdir; camera: one of the scene's by name, or eye:target as x,y,z:x,y,z"
)

Marker = tuple[tuple[Any, ...], Mapping[str, Any]]
"""What a marker was given: arguments, and named arguments."""


@dataclass(frozen=True)
class Wish:
    """What is asked for; None where it is left open.

    Attributes:
        scene: path of the scene's file.    size: (width, height) in pixels.
        camera: as :func:`lab.testing.workbench.camera_of` takes it.

    """

    scene: Path | None = None
    size: tuple[int, int] | None = None
    camera: str | None = None


def read_wish(markers: Iterable[Marker], folders: Sequence[Path], given: Wish) -> Wish:
    """What a test asks for.

    Args:
        markers: those of the test, its class and its module, closest first; each adds what the ones before left open.
        folders: where a relative path is looked for, in this order.
        given: from the command line; it comes before every marker. Another scene has other cameras, so with a scene
            given, the markers' cameras do not count.
    """
    scene, size, camera = given.scene, given.size, given.camera
    for args, named in markers:
        found = _arguments(args, named)
        if size is None and found["size"] is not None:
            size = check_size(found["size"])
        # Before the path: the camera of an outer marker is not one of an inner marker's scene.
        if camera is None and scene is None and found["camera"] is not None:
            camera = str(found["camera"])
        if scene is None and found["path"] is not None:
            scene = find_scene(found["path"], folders)
    return Wish(scene, size, camera)


def find_scene(path: str | Path, folders: Sequence[Path]) -> Path:
    """The scene's file; a relative `path` is looked for in `folders`, and the message lists where."""
    places = list(dict.fromkeys(folder / path for folder in folders))
    for place in places:
        if place.exists():
            return place
    raise LabError(f"there is no scene {str(path)!r}; looked for " + " and ".join(map(str, places)))


def check_size(size: object) -> tuple[int, int]:
    """`size` as (width, height), or a :class:`LabError`."""
    if isinstance(size, (tuple, list)) and len(size) == 2 and all(type(n) is int and n > 0 for n in size):
        return size[0], size[1]
    raise LabError(f"size={size!r}: expected (width, height) in pixels, for example (160, 90)")


def read_size(text: str) -> tuple[int, int]:
    """``160x90`` as (160, 90)."""
    sides = text.lower().split("x")
    if len(sides) == 2 and all(side.isascii() and side.isdecimal() and len(side) < 6 for side in sides):
        width, height = (int(side) for side in sides)
        if width and height:
            return width, height
    raise LabError(f"{text!r}: expected WIDTHxHEIGHT in pixels, for example 160x90")


def _arguments(args: tuple[Any, ...], named: Mapping[str, Any]) -> dict[str, Any]:
    names = ("path", "size", "camera")
    unknown = [name for name in named if name not in names]
    if unknown or len(args) > 1 or (args and "path" in named):
        wrong = f"{unknown[0]!r}{nearest(unknown[0], names)}" if unknown else "more than one path"
        raise LabError(f"marker lab_scene: was given {wrong}; its form is {MARKER}")
    return dict.fromkeys(names) | dict(zip(names, args, strict=False)) | dict(named)

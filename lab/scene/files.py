"""One geometry file, by its ending."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lab.errors import LabError
from lab.scene.parts import Parts

GEOMETRY_ENDINGS = (".glb", ".gltf", ".obj", ".ply")


def read_geometry_file(path: Path) -> Parts:
    """What the glTF, OBJ or PLY file at `path` brings.

    Errors: :class:`LabError` for a file that is missing, no regular file, unreadable, of another kind or broken.
    """
    ending = path.suffix.lower()
    if ending not in GEOMETRY_ENDINGS:
        known = ", ".join(GEOMETRY_ENDINGS)
        raise LabError(f"{path} ends in {path.suffix or 'nothing'!r}: geometry is read from {known}")
    check_file(path)
    # The readers stand on different libraries, slow to import: only the one that is needed.
    if ending == ".obj":
        from lab.scene.obj import read_obj as read
    elif ending == ".ply":
        from lab.scene.ply_mesh import read_ply as read
    else:
        from lab.scene.gltf import read_gltf as read
    return guarded(path, read)


def check_file(path: Path) -> None:
    """Passes for a regular file that is not empty; else :class:`LabError`."""
    if path.is_dir():
        raise LabError(f"{path} is a folder, a file was expected")
    if not path.exists():
        raise LabError(f"{path}: there is no such file; check the name and the folder")
    if not path.is_file():
        raise LabError(f"{path} is not a regular file")
    if path.stat().st_size == 0:
        raise LabError(f"{path} is empty")


def guarded(path: Path, read: Callable[[Path], Parts]) -> Parts:
    """``read(path)``, with a failing disk or a file too large for this machine said plainly."""
    try:
        return read(path)
    except OSError as problem:
        raise LabError(f"{path} cannot be read: {problem.strerror or problem}") from problem
    except MemoryError as problem:
        raise LabError(f"{path} is too large for this machine's memory") from problem

"""Files that are never half-written: checked before the work, written beside, then renamed together."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from lab.errors import LabError

Writer = Callable[[Path], None]


def base_path(text: str) -> Path:
    """The base of a run's files from what the user gave: ``out/a`` and ``out/a.png`` both mean ``out/a``.

    Only the three endings that are added again are cut, so that ``night.v2`` stays what it is.
    """
    path = Path(text)
    if not text or text.endswith(("/", os.sep)) or is_folder(path) or not path.name:
        raise LabError(f"-o {text}: is a folder; give a base name in it, for example -o {path / 'picture'}")
    if path.suffix.lower() in {".png", ".exr", ".json"}:
        path = path.with_suffix("")
    return path


def is_folder(path: Path) -> bool:
    """Whether `path` is a folder; a name that no file can have is none."""
    try:
        return path.is_dir()
    except OSError:
        return False


def beside(path: Path, ending: str) -> Path:
    """`path` with `ending` (``.png``) added; dots in its name stay."""
    return path.with_name(path.name + ending)


def check_writable(path: Path) -> None:
    """Raises :class:`LabError` unless `path` could be written now. Leaves no trace: no file, no folder."""
    folder = path.parent
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    try:
        if not folder.is_dir():
            raise NotADirectoryError(0, "is not a folder")
        longest = os.pathconf(folder, "PC_NAME_MAX") - len(".1234567.tmp")
        if any(len(os.fsencode(part)) > longest for part in path.parts):
            raise OSError(0, f"a name in it is longer than {longest} bytes")
        if path.is_dir():
            raise IsADirectoryError(0, "a folder has that name")
        # Asking the file system beats permission bits: root, read-only mounts and quotas are all answered right.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise LabError(f"{path}: can't be written ({folder}: {reason}); choose another place with -o") from error


def check_no_input(
    outputs: Iterable[Path],
    inputs: Iterable[Path],
    reason: str = "a file that the scene is read from; choose another name with -o",
) -> None:
    """Raises :class:`LabError` where writing one of `outputs` would overwrite one of `inputs`: it "is `reason`"."""
    for output in outputs:
        for source in inputs:
            if output.exists() and source.exists() and output.samefile(source):
                raise LabError(f"{output} is {reason}")


def write_all(writers: dict[Path, Writer]) -> None:
    """Calls each writer with a path beside its file, and renames all of them when all are complete.

    Missing folders are made. If any writer fails, nothing under the final names has changed, and the files beside
    are removed.
    """
    written: dict[Path, Path] = {}
    try:
        for path, writer in writers.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            written[path] = path.with_name(f"{path.name}.{os.getpid()}.tmp")
            writer(written[path])
        for path, temporary in written.items():
            temporary.replace(path)
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)

"""Compiled shaders are kept from one process to the next; a cache that can't be used, or is damaged, does no harm."""

from __future__ import annotations

import shutil
import struct
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

from lab.caches import cache_root
from lab.engine.vulkan.adapters import import_slangpy

_LMDB_MAGIC = 0xBEEFC0DE
_LMDB_PAGE = 4096


def cache_folder() -> Path:
    """Of this version, of the package and of slangpy: a new one starts afresh."""
    return cache_root() / "vulkan" / f"{metadata.version('many-lights-lab')}-{import_slangpy().__version__}"


def cache_options() -> dict[str, Any]:
    """A device's options for it; none where nothing can be written: slower to start, that's all."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        return {}
    shaders = folder / "shaders"
    if any(is_cut_short(file) for file in shaders.rglob("data.mdb")):
        shutil.rmtree(shaders, ignore_errors=True)
    return {"shader_cache_path": shaders, "module_cache_path": folder / "modules"}


def is_cut_short(file: Path) -> bool:
    """Whether a file of LMDB ends before the last page that it says it has.

    It is mapped into memory, so that reading beyond its end would end the process; any other damage is found by LMDB
    itself. Its first two pages say which page is the last (struct MDB_meta of LMDB's mdb.c).
    """
    with file.open("rb") as stream:
        head = stream.read(2 * _LMDB_PAGE)
    pages = 0
    for at in range(0, len(head) - 200, _LMDB_PAGE):
        (magic,) = struct.unpack_from("<I", head, at + 16)
        (last,) = struct.unpack_from("<Q", head, at + 136)
        pages = max(pages, last + 1 if magic == _LMDB_MAGIC else 0)
    return file.stat().st_size < pages * _LMDB_PAGE


def forget_modules() -> Path:
    """Deletes the compiled modules; returns where they were."""
    folder = cache_folder() / "modules"
    shutil.rmtree(folder, ignore_errors=True)
    return folder

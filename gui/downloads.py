"""Files made to be handed to the browser."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from lab.export import export_hierarchy
from lab.records import Hierarchy


def exported_bytes(hierarchy: Hierarchy, name: str, metadata: Mapping[str, str]) -> bytes:
    """The hierarchy in the format of `name`'s ending (see :mod:`lab.export`); several files come as one .zip."""
    with tempfile.TemporaryDirectory() as folder:
        written = export_hierarchy(Path(folder) / name, hierarchy, metadata)
        if len(written) == 1:
            return written[0].read_bytes()
        packed = BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(Path(folder).rglob("*")):
                if path.is_file():
                    archive.write(path, path.relative_to(folder))
        return packed.getvalue()

"""``lab inspect --screenshot``: every view under its fixed name, whole pictures that show something."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lab.cli import main

NAMED = {
    "layer-colour", "layer-overdraw", "layer-shadow_ratio", "wipe", "scene", "scene-levels", "scene-light",
    "scene-pixel", "pixel-blend", "pixel-picks", "overdraw", "overdraw-growth", "shadows-levels", "shadows-entropy",
    "importance-on-before", "importance-off-after", "leaks", "levels", "timings",
}  # fmt: skip


def test_every_view_is_written(quads: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "new" / "views"
    small = ["--size", "48x32", "--set", "vpls=300", "direct_samples=1"]
    assert main(["inspect", str(quads), *small, "--screenshot", str(folder), "--quiet"]) == 0
    written = {path.stem for path in folder.iterdir() if path.suffix == ".png"}
    assert written >= NAMED and len(written) == len(list(folder.iterdir())), "pictures, and nothing else"
    for name in written:
        with Image.open(folder / f"{name}.png") as picture:
            assert np.asarray(picture.convert("RGB")).std() > 0, f"{name} shows nothing"

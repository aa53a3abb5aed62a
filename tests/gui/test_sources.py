"""What the picture is compared with: made when asked, kept while it belongs to the settings, refused with reasons."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from gui.sources import KEPT, KORNIA, THIS, TITLES, VULKAN, Sources
from gui.view_state import ViewState
from gui.workbench import Workbench
from lab import LabError

SMALL = lab.Params(vpls=300, direct_samples=1)


def silent(stage: str) -> None:
    """Progress nobody watches."""


@pytest.fixture
def sources(quads: Path) -> Iterator[Sources]:
    bench = Workbench(ViewState(scene=str(quads), params=SMALL.to_dict(), size=(48, 32)))
    bench.frame = bench.render(bench.settings, silent)
    yield Sources(bench)
    bench.close()


def test_this_frame_needs_no_making(sources: Sources) -> None:
    own = sources.other(THIS)
    assert own is sources.layers() and own is not None and own.frame is sources.workbench.frame


def test_nothing_before_the_first_frame(sources: Sources) -> None:
    sources.workbench.frame = None
    assert sources.layers() is None and sources.other("preset:paper") is None


@pytest.mark.parametrize("source", ["preset:ours", "preset:paper", "preset:demo", KORNIA])
def test_a_frame_aside_is_what_the_library_renders_and_goes_with_the_settings(sources: Sources, source: str) -> None:
    bench = sources.workbench
    assert sources.other(source) is None
    sources.maker(source)(silent)()
    made = sources.other(source)
    assert made is not None
    params = SMALL.replace(filter_backend="kornia") if source == KORNIA else lab.preset(source[7:], vpls=300)
    expected = lab.render(bench.scene, params, size=(48, 32))
    assert np.array_equal(made.frame.image.colour, expected.image.colour)
    bench.change(vpls=301)
    assert sources.other(source) is None


@pytest.mark.parametrize("method", ["brute_force", "path_tracer"])
def test_a_reference_brings_errors_and_goes_with_what_it_depends_on(
    sources: Sources, method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path))
    said: list[str] = []
    assert sources.other(method) is None
    sources.maker(method)(said.append)()
    layers = sources.other(method)
    assert layers is not None and layers.reference is not None and layers.reference.method == method
    assert "error.indirect" in layers.names and "error.indirect" in sources.layers().names  # type: ignore[union-attr]
    assert any("%" in line for line in said)
    sources.workbench.change(filter="none")
    assert sources.reference(method) is not None
    sources.workbench.change(max_bounces=1)
    assert sources.reference(method) is None


def test_a_kept_frame_stays_and_must_fit(sources: Sources) -> None:
    bench = sources.workbench
    assert KEPT not in sources.names()
    with pytest.raises(LabError, match="no frame was kept"):
        sources.other(KEPT)
    sources.kept = bench.frame
    assert KEPT in sources.names()
    bench.frame = bench.render(bench.change(alpha=2), silent)
    kept = sources.other(KEPT)
    assert kept is not None and kept.frame.params.alpha == 1
    bench.frame = bench.render(bench.change(size=(24, 16)), silent)
    with pytest.raises(LabError, match="another size"):
        sources.other(KEPT)


def test_an_unknown_source_is_named(sources: Sources) -> None:
    with pytest.raises(LabError, match="preset:paper"):
        sources.other("preset:papers")
    assert set(sources.names()) <= set(TITLES)


def test_the_frame_of_the_other_engine(sources: Sources, gpu: Any) -> None:
    own = sources.workbench.frame
    sources.maker(VULKAN)(silent)()
    made = sources.other(VULKAN)
    assert own is not None and made is not None and type(made.frame.image) is lab.records.Image
    np.testing.assert_allclose(made.frame.image.direct, own.image.direct, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(
        made.frame.image.unshadowed.mean(axis=(0, 1)), own.image.unshadowed.mean(axis=(0, 1)), rtol=1e-2
    )

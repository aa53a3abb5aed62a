"""Large arrays: kept between frames while somebody asks for it, and given back."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from lab import _core


@pytest.fixture
def kept() -> Iterator[None]:
    _core.keep_buffers()
    yield
    _core.release_buffers()


def test_nothing_is_kept_unless_asked() -> None:
    assert _core.buffer_bytes()["kept"] == 0


def test_releasing_too_often_changes_nothing() -> None:
    _core.release_buffers()
    assert _core.buffer_bytes()["kept"] == 0
    _core.keep_buffers()
    _core.release_buffers()

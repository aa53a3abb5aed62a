"""Mitsuba 3, where it is installed; its absence is told, and is a failure where CI is set."""

from __future__ import annotations

import os

import pytest

from lab.experiments.mitsuba_runner import installed


@pytest.fixture(scope="session", autouse=True)
def outside_judge() -> None:
    """Every test here needs Mitsuba."""
    if not installed():
        if os.environ.get("CI") == "true":
            pytest.fail("CI=true but mitsuba is not installed: it is part of the extra 'test'")
        pytest.skip("mitsuba is not installed: make setup EXTRA=test brings it")

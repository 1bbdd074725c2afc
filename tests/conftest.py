"""Windows of the tests open without a screen; a cold cache of kernels adds no line to the error stream."""

from __future__ import annotations

import os

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"


@pytest.fixture(autouse=True)
def unannounced_compilation(monkeypatch):
    """Tests count lines on the error stream; whether kernels are compiled depends on what ran before."""
    monkeypatch.setattr("motion_cueing.envs.progress.watch_cache", lambda over: None)

"""Windows open without a screen, no property test has a deadline, a cold cache of kernels adds no line."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

os.environ["SDL_VIDEODRIVER"] = "dummy"

# A test never times: on a busy machine Hypothesis' own 200 ms would fail one at random.
settings.register_profile("motion-cueing", deadline=None)
settings.load_profile("motion-cueing")


@pytest.fixture(autouse=True)
def unannounced_compilation(monkeypatch):
    """Tests count lines on the error stream; whether kernels are compiled depends on what ran before."""
    monkeypatch.setattr("motion_cueing.envs.progress.watch_cache", lambda over: None)

"""Windows open without a screen, a process computes in one thread, no property test has a deadline.

A cold cache of kernels adds no line.
"""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

os.environ["SDL_VIDEODRIVER"] = "dummy"

# Workers run side by side, one a core. Read when numpy and torch are first imported, which is later.
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

# A test never times: on a busy machine Hypothesis' own 200 ms would fail one at random.
settings.register_profile("motion-cueing", deadline=None)
settings.load_profile("motion-cueing")


@pytest.fixture(autouse=True)
def unannounced_compilation(monkeypatch):
    """Tests count lines on the error stream; whether kernels are compiled depends on what ran before."""
    monkeypatch.setattr("motion_cueing.envs.progress.watch_cache", lambda over: None)

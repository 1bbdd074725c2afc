"""Plans of the tests are kept in a folder of their own, and made once for those that share them."""

from __future__ import annotations

import pytest

from motion_cueing.baselines.optimum import Optimum, OptimumOptions
from motion_cueing.evaluation import rollout

from .drives import hard_braking


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """No test sees what another kept."""
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path / "kept"))


@pytest.fixture(scope="session")
def braking():
    """A drive in which the machine needs its limits, its plan, and the record of it."""
    drive = hard_braking(2.5, 7.0)
    policy = Optimum(options=OptimumOptions(effort=1e-3), cached=False).for_drive(drive)
    return drive, policy.plan, rollout(policy, drive)

"""A washout over all maneuvers at once: every step of machine and policy in one launch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from motion_cueing.baselines.washout import load_washout
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers.registry import get_maneuver, maneuver_names
from motion_cueing.envs.platform import get_platform

from .test_step import describe

SETS = 32


@pytest.fixture(scope="module")
def drives() -> list[CueTrace]:
    return [get_maneuver(name).drive() for name in maneuver_names()]


def total(drives: list[CueTrace]) -> int:
    """Steps of all drives."""
    return sum(len(drive) - 1 for drive in drives)


@pytest.mark.parametrize("threads", [1, 2])
def test_washout_over_all_maneuvers(benchmark: Any, drives: list[CueTrace], threads: int):
    batch = WashoutBatch([load_washout("classical")], drives, get_platform("paper"))
    describe(benchmark, f"washout, {len(drives)} maneuvers, {threads} thread(s)", "kernel", 1, total(drives))
    scores = benchmark(batch.scores, threads=threads)
    assert np.isfinite(scores.cue_error).all()


@pytest.mark.parametrize("threads", [1, 2])
def test_many_washouts_over_all_maneuvers(benchmark: Any, drives: list[CueTrace], threads: int):
    sets = [load_washout("classical")] * SETS
    batch = WashoutBatch(sets, drives, get_platform("paper"))
    case = f"{SETS} washouts, {len(drives)} maneuvers, {threads} thread(s)"
    describe(benchmark, case, "kernel", SETS, total(drives))
    scores = benchmark.pedantic(batch.scores, kwargs={"threads": threads}, rounds=5, warmup_rounds=1)
    assert np.isfinite(scores.cue_error).all()

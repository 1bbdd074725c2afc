"""Statements notice wrong machines: some mutants of `python -m benchmarks.mutants`, and all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.mutants import LARGEST, change, judge, mutants
from motion_cueing.evaluation.paper.cases import drive_cases
from motion_cueing.evaluation.paper.statements import CASES
from motion_cueing.evaluation.trajectory import Trajectory

NOTICED = (
    "EST1 cue w_z x 0.1",
    "EST1 cue f_z reversed",
    "EST1 output of hpr_roll reversed",
    "EST2 rate_scale yaw x 0.8",
    "EST3 rate_scale pitch reversed",
    "EST3 rate_scale yaw reversed",
    "EST3 tilt limits off",
    "EST1 tilt low-pass opened",
    "BRK tilt low-pass opened",
    "BRK cue w_y absent",
    "BRK force_scale x 0.9",
    "BRK output of hps_z reversed",
    "LC1 force_scale x 0.9",
    "LC1 cue w_z x 0.1",
    "LC2 cue force absent",
    "LC2 cue force reversed",
    "LC2 force_scale absent",
    "LC2 force_scale reversed",
    "LC2 rate_scale yaw x 0.1",
    "LC2 tilt off",
)
"""Mutants of each case and kind; the first faults that earlier statements passed are among them."""


@pytest.fixture(scope="module")
def drives() -> dict[str, Trajectory]:
    return drive_cases()


@pytest.mark.parametrize("name", NOTICED)
def test_a_mutant_is_noticed(drives, name):
    mutant = next(m for case in CASES for m in mutants(case) if m.name == name)
    assert judge(mutant, drives).noticed


@pytest.mark.parametrize("case", CASES)
def test_an_unchanged_washout_is_no_mutant(drives, case):
    """The kernels of the mutants, with factors of 1, drive as the washout does."""
    mutant = replace(mutants(case)[0], parameters=_parameters(case), factors={"tilt": 1.0})
    verdict = judge(mutant, drives)
    assert verdict.noticed == ()
    assert verdict.change < 1e-9


def _parameters(case):
    return next(m.parameters for m in mutants(case) if m.block.startswith("output"))


def test_the_change_of_a_cue_is_relative(drives):
    original = drives["LC1"]
    scaled = original.f_simulator * np.array([1.0, 1.3, 1.0])
    size, axis = change(original, replace(original, f_simulator=scaled))
    assert axis == "f_y"
    assert size == pytest.approx(0.3, rel=1e-2)
    assert change(original, original) == (0.0, "f_x")


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_no_mutant_of_a_case_survives_that_changes_a_cue(drives, case):
    survivors = [v for m in mutants(case) if not (v := judge(m, drives)).noticed]
    assert [f"{v.mutant.name}: {v.axis} by {v.change:.0%}" for v in survivors if v.change > LARGEST] == []

"""The paper's statements hold, each of them, and the command says so."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.evaluation.paper.cases import CASES, drive_cases
from motion_cueing.evaluation.paper.statements import Check, all_checks, within_limits
from motion_cueing.evaluation.trajectory import Trajectory


@pytest.fixture(scope="module")
def drives() -> dict[str, Trajectory]:
    return drive_cases()


def test_every_statement_passes(drives):
    checks = all_checks(drives)
    assert len(checks) >= 30
    assert {check.case for check in checks} == set(CASES)
    assert [f"{c.case} {c.quantity}: {c.measured:.3g}" for c in checks if not c.passed] == []


def standing(drive: Trajectory) -> Trajectory:
    """The same drive on a machine that does not move."""
    rest = np.tile([0.0, 0.0, -9.81], (len(drive.time), 1))
    return replace(drive, f_simulator=rest, carriage=np.zeros_like(drive.carriage))


def test_a_wrong_machine_would_fail(drives):
    """The checks can fail: one case's trajectory in another's place."""
    swapped = {
        "EST1": drives["EST2"], "EST2": drives["EST1"], "EST3": drives["EST2"],
        "BRK": standing(drives["BRK"]), "LC1": drives["LC2"], "LC2": drives["LC1"],
    }  # fmt: skip
    failed = {check.case for check in all_checks(swapped) if not check.passed}
    assert failed == set(CASES)


def test_a_met_limit_would_fail(drives):
    flags = drives["BRK"].limits_active.copy()
    flags[100, 0] = 1
    check = within_limits("BRK", replace(drives["BRK"], limits_active=flags))
    assert not check.passed


def test_bounds_are_inclusive_and_two_sided():
    values = {"case": "X", "quantity": "q", "reported": "r", "unit": "", "low": 1.0, "high": 2.0}
    assert Check(measured=1.0, **values).passed
    assert not Check(measured=0.999, **values).passed
    assert not Check(measured=2.001, **values).passed


def test_the_command_writes_table_figures_and_page(tmp_path, capsys):
    assert main(["paper", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "FAIL" not in said
    record = json.loads((tmp_path / "paper.json").read_text())
    assert all(check["passed"] for check in record["checks"])
    for number in range(5, 10):
        assert (tmp_path / f"figure-{number}.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "paper.html").read_text()
    assert page.count("data:image/png;base64,") == 5
    assert 'src="http' not in page
    assert "<link" not in page
    assert sorted(path.stem for path in (tmp_path / "trajectories").iterdir()) == sorted(
        c.lower() for c in CASES
    )

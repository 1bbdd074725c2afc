"""The paper's statements hold, each of them, and the command says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motion_cueing.envs.settings import to_dict
from motion_cueing.evaluation.paper.cases import PaperResults, drive_cases, paper_figures, run
from motion_cueing.evaluation.paper.statements import CASES, Check, all_checks, within_limits
from motion_cueing.evaluation.trajectory import Trajectory


@pytest.fixture(scope="module")
def drives() -> dict[str, Trajectory]:
    return drive_cases()


def test_every_statement_passes(drives):
    checks = all_checks(drives)
    counted = [check for check in checks if not check.set_up]
    assert len(counted) >= 80
    assert len({(check.case, check.quantity) for check in checks}) == len(checks)
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
    failed = {check.case for check in all_checks(swapped) if not check.passed and not check.set_up}
    assert failed == set(CASES)


@pytest.mark.parametrize("case", CASES)
def test_a_machine_that_stands_still_fails(drives, case):
    wrong = {**drives, case: standing(drives[case])}
    assert [c for c in all_checks(wrong) if c.case == case and not c.passed and not c.set_up]


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


def test_the_figures_show_the_drives(drives):
    figures = {caption.split(":")[0]: figure for caption, figure in paper_figures(drives).items()}
    assert sorted(figures) == [f"Figure {number}" for number in range(5, 10)]
    shown = {
        "Figure 5": (1, "EST1", "EST2", "EST3"),
        "Figure 8": (0, "BRK"),
        "Figure 9": (1, "LC1", "LC2"),
    }
    for name, (axis, *cases) in shown.items():
        curves = {line.get_label(): line.get_ydata() for line in figures[name].axes[0].lines}
        assert set(curves) == {"car", *cases}
        np.testing.assert_array_equal(curves["car"], drives[cases[0]].f_reference[:, axis])
        for case in cases:
            np.testing.assert_array_equal(curves[case], drives[case].f_simulator[:, axis])
    for axes, case in zip(figures["Figure 6"].axes, ("EST1", "EST2", "EST3"), strict=True):
        np.testing.assert_array_equal(axes.lines[0].get_xydata(), drives[case].carriage[:, ::-1])
    upper, lower = figures["Figure 7"].axes
    curves = {line.get_label(): line.get_ydata() for line in [*upper.lines, *lower.lines]}
    for case in ("EST1", "EST2", "EST3"):
        np.testing.assert_allclose(curves[case], np.degrees(drives[case].w_simulator[:, 2]))
    second = drives["EST2"]
    false = np.degrees(second.w_simulator[:, 2] - second.w_reference[:, 2])
    np.testing.assert_allclose(curves["EST2 less car"], false)


def test_the_file_of_the_version_before_is_read():
    path = Path(__file__).parents[1] / "before" / "paper-1.json"
    old, results = json.loads(path.read_text()), PaperResults.load_json(path)
    # No statement of that version was marked as set-up.
    assert [to_dict(check) for check in results.checks] == [c | {"set_up": False} for c in old["checks"]]
    assert results.versions == old["versions"]


@pytest.mark.slow
def test_a_run_writes_table_figures_and_page(tmp_path, capsys):
    assert run(tmp_path) == 0
    said = capsys.readouterr().out
    assert "FAIL" not in said
    record = json.loads((tmp_path / "paper.json").read_text())
    assert all(check["passed"] for check in record["checks"])
    assert PaperResults.load_json(tmp_path / "paper.json").checks == tuple(
        Check(**{k: v for k, v in check.items() if k != "passed"}) for check in record["checks"]
    )
    for number in range(5, 10):
        picture = np.asarray(Image.open(tmp_path / f"figure-{number}.png").convert("L"))
        assert picture.shape[1] > 800
        assert (picture < 128).mean() > 0.005
    page = (tmp_path / "paper.html").read_text()
    assert page.count("data:image/png;base64,") == 5
    assert 'src="http' not in page
    assert "<link" not in page
    assert sorted(path.stem for path in (tmp_path / "trajectories").iterdir()) == sorted(
        c.lower() for c in CASES
    )

"""Every example runs as its docstring says."""

from __future__ import annotations

import subprocess
import sys

import pytest

from .repository import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def lines_of(example, cwd, *arguments) -> list[str]:
    """What an example prints."""
    words = [sys.executable, str(example), *arguments]
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_it_runs_and_prints(example, tmp_path):
    assert lines_of(example, tmp_path)


def test_policies_are_compared_best_first(tmp_path):
    lines = lines_of(ROOT / "examples" / "compare_policies.py", tmp_path, "braking")
    table = {line.split()[0]: float(line.split()[-1]) for line in lines if " J = " in line}
    assert set(table) == {"no-motion", "classical", "carriage-on-springs"}
    assert list(table.values()) == sorted(table.values())
    assert table["classical"] < table["no-motion"]


def test_a_controller_of_ones_own_beats_standing_still(tmp_path):
    lines = lines_of(ROOT / "examples" / "own_controller.py", tmp_path, "braking")
    assert lines[0].split()[:3] == ["maneuver", "policy", "J"]
    rows = [line.split() for line in lines[1:]]
    found = {policy: (float(error), float(sensed)) for _, policy, error, sensed, *_ in rows}
    assert set(found) == {"no-motion", "classical", "tilt-and-shove"}
    assert found["tilt-and-shove"] < found["no-motion"]
    assert found["tilt-and-shove"][1] < found["no-motion"][1]
    assert found["no-motion"][0] == pytest.approx(7.41, abs=0.02)

"""Solves that went wrong are reported, one line a policy."""

from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from motion_cueing.evaluation.reporting.tables import print_results
from motion_cueing.evaluation.suite import trouble_lines

from .examples import GAINS, results_of


def mpc(solves=100, failures=0, relaxed=0):
    return {"mpc_solves": str(solves), "mpc_failures": str(failures), "mpc_relaxed": str(relaxed)}


def test_a_policy_without_trouble_is_not_told():
    optimum = {"optimum_windows": "3", "optimum_widened": "2", "optimum_unconverged": "0"}
    notes = [("mpc", "bend", mpc()), ("optimum", "bend", optimum), ("mine", "bend", {"cups": "3"})]
    assert trouble_lines(notes) == {}


def test_how_many_of_how_many_in_which_drives_most_first():
    notes = [("mpc", "bend", mpc(100, 2)), ("mpc", "hill", mpc(50, 5, 1)), ("mpc", "town", mpc(25))]
    assert trouble_lines(notes) == {
        "mpc": "7 of 175 solves without a plan (the machine braked) (hill 5 of 50, bend 2 of 100); "
        "1 of 175 solves with a limit relaxed (hill 1 of 50)"
    }
    windows = {"optimum_windows": "1", "optimum_braked": "1", "optimum_unconverged": "1"}
    assert trouble_lines([("optimum", "bend", windows)])["optimum"].startswith("1 of 1 window unconverged")


def test_of_many_drives_the_worst_are_named():
    notes = [("mpc", f"drive-{i}", mpc(100, i)) for i in range(1, 6)]
    line = trouble_lines(notes)["mpc"]
    assert line.endswith("(drive-5 5 of 100, drive-4 4 of 100, drive-3 3 of 100, and 2 more drives)")
    assert line.startswith("15 of 500 solves")


def test_a_policy_may_note_what_it_likes():
    assert trouble_lines([("mine", "bend", {"mpc_failures": "many", "mpc_solves": "-1"})]) == {}


def test_an_evaluation_tells_them_after_the_tables():
    results = replace(results_of(GAINS), notes={"weave": {"mpc": mpc(100, 3)}, "late": {"mpc": mpc(100)}})
    console = Console(width=500, file=io.StringIO())
    print_results(console, results)
    assert "\ncounted mpc: 3 of 200 solves without a plan" in console.file.getvalue()

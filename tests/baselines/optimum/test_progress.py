"""The bar of a solve: on a terminal, if it takes long, and nowhere else."""

from __future__ import annotations

import io
import sys

import pytest

from motion_cueing.baselines.optimum import Optimum, OptimumOptions
from motion_cueing.baselines.optimum import policy as module
from motion_cueing.baselines.optimum.policy import SolveProgress

from .drives import surge


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def on_terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Called in the test itself: between fixtures and test pytest puts its own stream there."""
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    return screen


def test_a_long_solve_shows_how_far_it_is(monkeypatch):
    terminal = on_terminal(monkeypatch)
    monkeypatch.setattr(module, "_PATIENCE", 0.0)
    Optimum(options=OptimumOptions(effort=1e-3), cached=False).plan(surge(0.5, 1.0))
    assert "optimum: surge" in terminal.getvalue()
    assert "iteration 3" in terminal.getvalue()


def test_a_short_one_shows_nothing(monkeypatch):
    terminal = on_terminal(monkeypatch)
    with SolveProgress("drive") as shown:
        shown.on_window(0.0, 1)
    assert terminal.getvalue() == ""


def test_where_it_is_not_wanted_nobody_is_told(monkeypatch):
    on_terminal(monkeypatch)
    assert SolveProgress("drive", enabled=False).on_window is None
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert SolveProgress("drive").on_window is None

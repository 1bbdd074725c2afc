"""The bar of a solve: on a terminal, if it takes long, and nowhere else."""

from __future__ import annotations

import io
import re
import sys

import pytest

from motion_cueing.baselines.optimum import Optimum, OptimumOptions
from motion_cueing.baselines.optimum import policy as module
from motion_cueing.baselines.optimum.policy import solve_progress

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
    assert re.search(r"iteration \d", terminal.getvalue())


def test_a_short_one_shows_nothing(monkeypatch):
    terminal = on_terminal(monkeypatch)
    with solve_progress("drive") as on_window:
        on_window(0.0, 1)
    assert terminal.getvalue() == ""


def test_nothing_is_shown_in_a_command_with_its_own_bar_or_without_a_terminal(monkeypatch):
    on_terminal(monkeypatch)
    with solve_progress("drive", enabled=False) as on_window:
        assert on_window is None
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with solve_progress("drive") as on_window:
        assert on_window is None

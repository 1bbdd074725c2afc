"""Bars, lines and the announcement of kernels."""

from __future__ import annotations

import io
import os
import threading

import pytest
import warp
from rich.console import Console

from motion_cueing.envs.progress import COMPILING, Bars, watch_cache


@pytest.mark.parametrize("terminal", [True, False])
def test_bars_are_for_terminals_and_lines_for_all(terminal):
    text = io.StringIO()
    with Bars(Console(file=text, force_terminal=terminal, width=100)) as bars:
        bar = bars.add("driving", 4, "drives")
        bar.move(advance=1)
        bar.move(3, "slalom", note="fast")
        bars.line("one is done")
    shown = text.getvalue()
    assert "one is done" in shown
    assert ("3/4 drives fast" in shown and "slalom" in shown) == terminal


def test_compilation_by_this_process_is_announced_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(warp.config, "kernel_cache_dir", str(tmp_path))
    (tmp_path / f"wp_step_1234_p{os.getpid()}_t1").mkdir()
    watch_cache(threading.Event())
    assert capsys.readouterr().err == f"{COMPILING}\n"


def test_compilation_by_another_process_is_not(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(warp.config, "kernel_cache_dir", str(tmp_path))
    (tmp_path / f"wp_step_1234_p{os.getpid()}9_t1").mkdir()
    over = threading.Event()
    watching = threading.Thread(target=watch_cache, args=(over,))
    watching.start()
    over.set()
    watching.join()
    assert capsys.readouterr().err == ""

"""The command ``motion-cueing export`` to C and FMU; ONNX is in ``tests/train/agents/test_export.py``."""

from __future__ import annotations

import re
import shutil

import pytest

from motion_cueing.cli.main import main

from ..realtime.export import needs_compiler

QUICK = ["--maneuver", "lane-change"]


@needs_compiler
def test_a_washout_as_c_is_checked_and_timed(tmp_path, capsys):
    words = [
        "export",
        "classical",
        "--set-points",
        "--c",
        str(tmp_path / "target"),
        "--name",
        "wash-out",
        *QUICK,
    ]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert {path.name for path in (tmp_path / "target").iterdir()} == {"wash_out.h", "wash_out.c"}
    found = re.search(r"largest difference from Python in lane-change: (\S+)", said)
    assert found is not None
    assert float(found.group(1)) < 1e-12
    assert re.search(r"one step, one thread: median [\d.]+ us, p99 [\d.]+ us", said)
    assert "a step every 10 ms" in said


@needs_compiler
def test_an_agent_as_an_fmu(tmp_path, capsys):
    file = tmp_path / "a.fmu"
    assert main(["export", "--policy", "linear-washout", "--fmu", str(file), "--fmi", "3", *QUICK]) == 0
    assert "FMI 3.0" in capsys.readouterr().out
    assert file.stat().st_size > 1000


def test_without_a_compiler_c_is_written_unchecked(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert main(["export", "classical", "--c", str(tmp_path)]) == 0
    assert "not checked: no C compiler found" in capsys.readouterr().out
    assert (tmp_path / "classical.c").exists()
    assert main(["export", "classical", "--fmu", str(tmp_path / "a.fmu")]) != 0
    assert "no C compiler found: install gcc or clang" in capsys.readouterr().err
    assert not (tmp_path / "a.fmu").exists()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["classical"], "nothing to write: name --out FILE.onnx, --c DIR or --fmu FILE.fmu"),
        (["classical", "--fmu", "a.zip"], "--fmu a.zip: name a file that ends in .fmu"),
        (["classical", "--fmu", "a.fmu", "--fmi", "1"], "--fmi must be 2 or 3, found 1"),
        (["mpc", "--c", "x"], "mpc has no form in C"),
        (["learned", "--c", "x", "--set-points", "--platform", "nads-1"], "made for the motion base 'paper'"),
        (["classical", "--out", "a.onnx"], "is no trained network"),
        (["classicl", "--c", "x"], "Did you mean classical"),
    ],
)
def test_wrong_arguments(words, why, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *words]) == 2
    assert why in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "x").exists()

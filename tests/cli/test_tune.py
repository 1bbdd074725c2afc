"""``motion-cueing tune``: from the command line to a policy's file and on with it."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from motion_cueing.baselines import make_policy
from motion_cueing.baselines.tuning.search import Search, Status, TuningOptions, load_record
from motion_cueing.baselines.washout import load_washout
from motion_cueing.baselines.washout.families import algorithm_of, load_parameters
from motion_cueing.cli.main import main
from motion_cueing.cli.tune import SearchProgress, _spared
from motion_cueing.envs.maneuvers import random_drives
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.progress import Bars
from motion_cueing.train.training import Interrupt

from ..baselines.drives import trace

pytestmark = pytest.mark.slow

HOUR = 3600.0


@pytest.fixture
def words(tmp_path, monkeypatch) -> list[str]:
    """A search on one drive of two seconds, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    trace(2.0, lambda t: np.column_stack([np.sin(3.0 * t), 0.0 * t])).to_csv("weave.csv")
    return ["tune", "--algorithm", "classical", "--maneuvers", "weave.csv", "--out", "mine.yaml"]


def test_what_it_writes_is_a_policy_and_says_how_it_was_made(words, tmp_path, capsys):
    assert main([*words, "--hours", str(14 * 6 * 2.0 / HOUR)]) == 0
    told = capsys.readouterr()
    assert "best" in told.err
    text = (tmp_path / "mine.yaml").read_text()
    assert "# Made by: " in text
    for line in told.out.splitlines()[1:]:
        assert f"# {line.strip()}\n" in text
    start, tuned = (float(found) for found in re.findall(r"J ([\d.]+), perceived", text))
    assert 0.0 < tuned < start
    found = load_record(tmp_path / "mine.search.json").results
    hours = sum(step.hours for step in found)
    assert f"# {hours:.3g} h simulated in {len(found)} steps (budget 0.0466667 h, and what was begun" in text
    policy = make_policy(tmp_path / "mine.yaml", get_platform("paper"))
    assert policy.name == "mine"
    assert load_washout(tmp_path / "mine.yaml").description == (
        f"classical tuned with {hours:.3g} h by CMA-ES for J on weave.csv"
    )


def test_random_drives_are_the_default_and_others_are_held_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert (
        main(
            [
                "tune",
                "--algorithm",
                "classical",
                "--drives",
                "1",
                "--hours",
                "0.001",
                "--objective",
                "perceived",
            ]
        )
        == 0
    )
    told = capsys.readouterr().out
    assert "on the 1 random drives of the search: classical J" in told
    assert "on 64 random drives held out: my-classical J" in told
    record = load_record(tmp_path / "my-classical.search.json")
    assert (record.options.maneuvers, record.options.objective) == (("train",), "perceived")


def test_random_drives_near_the_cars_limits_are_spared_unless_all_are_named():
    options = TuningOptions(start=load_washout("classical"), drives=48)
    drives = random_drives(options.drives, 1.0, options.drives_seed, drives=options.roads)
    kinds = [drive.source.split()[1] for drive in drives]
    fierce = {"track", "circuit", "limit"}
    assert fierce < set(kinds)
    assert _spared(options, drives) == [i for i, kind in enumerate(kinds) if kind in fierce]
    assert _spared(replace(options, limits="all"), drives) == []
    assert _spared(replace(options, limits="none"), drives) == list(range(len(drives)))


def test_ctrl_c_keeps_the_search_and_resume_ends_where_it_would_have(words, tmp_path, monkeypatch, capsys):
    words += ["--hours", str(14 * 5 * 2.0 / HOUR)]
    assert main(words) == 0
    whole = load_record(tmp_path / "mine.search.json")
    (tmp_path / "mine.search.json").unlink()

    with monkeypatch.context() as pressed:
        pressed.setattr("motion_cueing.envs.progress.Interrupt", PressedLater)
        assert main(words) == 130
    assert "go on with: motion-cueing tune --algorithm classical --out mine.yaml" in capsys.readouterr().err
    assert len(load_record(tmp_path / "mine.search.json").results) == 3
    assert main(["tune", "--algorithm", "classical", "--out", "mine.yaml"]) == 0
    assert load_record(tmp_path / "mine.search.json") == whole
    # A larger budget goes on from the end.
    longer = str(2.0 * whole.options.budget)
    assert main(["tune", "--algorithm", "classical", "--out", "mine.yaml", "--hours", longer]) == 0
    further = load_record(tmp_path / "mine.search.json")
    assert further.results[: len(whole.results)] == whole.results
    assert len(further.results) > len(whole.results)


def test_fresh_begins_a_search_anew(words, tmp_path):
    words += ["--hours", "0.001"]
    assert main(words) == 0
    begun = load_record(tmp_path / "mine.search.json")
    assert main([*words, "--seed", "4"]) == 2
    assert main([*words, "--seed", "4", "--fresh"]) == 0
    assert load_record(tmp_path / "mine.search.json").options == replace(begun.options, seed=4)


class PressedLater(Interrupt):
    """Ctrl-C during the third step."""

    def __init__(self) -> None:
        self._questions = 0

    @property
    def asked(self) -> bool:
        self._questions += 1
        return self._questions > 3


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--out", "mine.txt"], "a policy's file ends in .yaml"),
        (["--workers", "0"], "--workers must be at least 1, found 0"),
        (["--hours", "-1"], "--hours must be positive, found -1"),
        (["--drives", "0"], "field 'drives'"),
        (["--maneuvers", "brakin"], "unknown maneuver 'brakin'. Did you mean braking?"),
        (["--start", "clasical"], "Did you mean classical"),
        (["--platform", "paperr"], "Did you mean paper"),
        (["--method", "gradient", "--objective", "perceived"], "no gradient"),
        (["--resume"], "--resume is not needed now"),
        (["--budget", "3"], "--budget is called --hours now"),
        (["--objective", "K"], "K"),
        (["--maneuvers", "braking", "--drives", "4"], "--drives counts random drives; leave it out"),
    ],
)
def test_wrong_arguments_are_named(more, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["tune", "--algorithm", "classical", *more]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_unknown_algorithms_and_damaged_searches_are_refused(words, tmp_path, capsys):
    assert main(["tune", "--algorithm", "optimum"]) == 2
    assert "unknown algorithm 'optimum'. Did you mean optimal?" in capsys.readouterr().err
    (tmp_path / "mine.search.json").write_text("{}")
    assert main(words) == 2
    assert "no search of this version" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["hello", "name: mine\ndescription: by hand\n"])
def test_a_file_that_no_search_made_is_not_replaced(content, words, tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(content)
    assert main(words) == 2
    assert "mine.yaml was not written by this command; move it away" in capsys.readouterr().err
    assert (tmp_path / "mine.yaml").read_text() == content


@pytest.mark.parametrize(("algorithm", "start"), [("adaptive", "adaptive"), ("optimal", "optimal-washout")])
def test_every_family_is_tuned_the_same_way(algorithm, start, words, tmp_path, capsys):
    words = ["tune", "--algorithm", algorithm, *words[3:5], "--hours", str(15 * 6 * 2.0 / HOUR)]
    assert main(words) == 0
    found = load_parameters(tmp_path / f"my-{start}.yaml")
    assert (algorithm_of(found), found.name) == (algorithm, f"my-{start}")
    before, after = (float(cost) for cost in re.findall(r"J ([\d.]+), perceived", capsys.readouterr().out))
    assert 0.0 < after < before
    kept = load_record(tmp_path / f"my-{start}.search.json")
    assert kept.options.start == load_parameters(start)
    # It goes on as the search of that algorithm alone.
    assert main(["tune", "--algorithm", algorithm]) == 0
    out = ["--out", f"my-{start}.yaml"]
    assert main(["tune", "--algorithm", "classical", *out]) == 2
    assert (
        f"--algorithm classical: my-{start}.search.json was begun with {algorithm}" in capsys.readouterr().err
    )
    assert main(["tune", "--algorithm", algorithm, "--seed", "3"]) == 2
    assert f"--seed 3: my-{start}.search.json was begun with 0; leave it out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--method", "gradient"], "the adaptive washout has no gradient; use method cma"),
        (
            ["--start", "classical"],
            "a set of the classical washout; give one of the adaptive washout",
        ),
    ],
)
def test_what_only_another_family_has_is_refused(more, told, words, capsys):
    assert main(["tune", "--algorithm", "adaptive", *words[3:5], *more]) == 2
    assert told in capsys.readouterr().err


def test_progress_is_a_bar_on_a_terminal_and_some_lines_elsewhere():
    shown = {}
    for terminal in (True, False):
        text = io.StringIO()
        with Bars(Console(file=text, force_terminal=terminal, width=100)) as bars:
            show = SearchProgress(bars, 10.0)
            for step in range(101):
                show(Status(0.1 * step, 3.0 - 0.01 * step if step else None, step))
        shown[terminal] = text.getvalue()
    assert "best" in shown[True]
    assert "10/10 h" in shown[True]
    lines = shown[False].splitlines()
    assert 10 < len(lines) <= 21
    assert lines[-1].split() == ["10", "h", "best", "2.0000", "(100", "steps)"]


@pytest.mark.parametrize("worse", [True, False])
def test_a_set_that_is_worse_on_the_drives_held_out_is_announced_last(worse, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    start = "classical-tuned" if worse else "est1"
    made = load_washout("classical" if worse else "classical-tuned")
    monkeypatch.setattr(
        Search, "result", lambda self, name, about: replace(made, name=name, description=about)
    )
    words = ["tune", "--algorithm", "classical", "--start", start, "--drives", "1", "--hours", "0.001"]
    assert main([*words, "--out", "mine.yaml"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.lstrip().startswith("WARNING") == worse
    if worse:
        assert "mine is WORSE than classical-tuned, where the search began" in last
        assert f"# {last.strip()}" in (tmp_path / "mine.yaml").read_text()

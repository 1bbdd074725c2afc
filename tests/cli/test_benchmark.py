"""``motion-cueing benchmark``: its arguments, its files, and how it goes on."""

from __future__ import annotations

import json

import pytest

from motion_cueing.cli.benchmark import SLOW, find_entrants
from motion_cueing.cli.errors import OLD_FLAGS
from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.benchmark import BENCHMARK_POLICIES, splits

from ..evaluation.benchmark.small import small_split

PAPER = get_platform("paper")


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(splits, "SPLITS", {"small": small_split})
    monkeypatch.setattr("motion_cueing.evaluation.benchmark.SPLITS", splits.SPLITS)


def test_without_policies_it_is_the_benchmark_but_what_takes_hours():
    entrants, may_skip = find_entrants((), PAPER)
    assert [one.label for one in entrants] == [name for name in BENCHMARK_POLICIES if name not in SLOW]
    assert "learned" in may_skip
    whole, _ = find_entrants(("benchmark",), PAPER)
    assert [one.label for one in whole] == list(BENCHMARK_POLICIES)
    assert find_entrants(("learned",), PAPER)[1] == []


def test_training_seeds_are_one_policy(tmp_path):
    entrants, _ = find_entrants(("no-motion", "mine=a.safetensors,b.safetensors"), PAPER)
    assert [(one.label, one.sources) for one in entrants] == [
        ("no-motion", ("no-motion",)),
        ("mine", ("a.safetensors", "b.safetensors")),
    ]
    for wrong, words in (("learned=a.safetensors", "the name must be new"), ("mine=", "name its files")):
        with pytest.raises(ConfigurationError, match=words):
            find_entrants((wrong,), PAPER)


@pytest.mark.usefixtures("small", "undrawn")
def test_it_writes_goes_on_and_compares(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["benchmark", "--policies", "no-motion", "classical-tuned"]
    assert main([*words, "--out", "a", "--markdown", "pages/page.md"]) == 0
    assert "4 drives driven now" in capsys.readouterr().out
    result = json.loads((tmp_path / "a" / "benchmark.json").read_text())
    assert result["splits"][0]["hash"] == small_split().hash
    page = (tmp_path / "pages" / "page.md").read_text()
    assert "motion-cueing benchmark --policies no-motion classical-tuned --markdown pages/page.md" in page
    assert (tmp_path / "pages" / "page-intervals-paper.png").exists()
    assert main([*words, "learned", "--out", "a"]) == 0
    assert "2 drives driven now" in capsys.readouterr().out
    assert main([*words, "--out", "a", "--fresh"]) == 0
    assert "4 drives driven now" in capsys.readouterr().out
    pair = ["benchmark", "--compare", "a/benchmark.json", "b/benchmark.json"]
    assert main([*words[:-1], "--out", "b"]) == 0
    capsys.readouterr()
    assert main(pair) == 0
    shown = capsys.readouterr().out
    (row,) = [line.strip("│ ").split("│") for line in shown.splitlines() if "│ no-motion" in line]
    first, second, change = (float(cell) for cell in row[-3:])
    assert first == second > 0.0
    assert change == 0.0
    assert "paper, classical-tuned: only in a" in shown
    result["splits"][0]["hash"] = "0" * 64
    (tmp_path / "b" / "benchmark.json").write_text(json.dumps(result))
    assert main(pair) == 2
    assert "not of the same drives" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--maneuvers", "hill"], OLD_FLAGS["benchmark"]["--maneuvers"]),
        (["--platform", "paper"], "--platform is called --platforms now"),
        (["--splits", "standart"], "standard"),
        (["--workers", "0", "--policies", "no-motion"], "--workers must be at least 1"),
        (["--policies", "lerned"], "learned"),
        (["--compare", "a.json"], "--compare takes"),
    ],
)
def test_wrong_arguments_are_explained(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["benchmark", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []

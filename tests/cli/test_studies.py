"""``motion-cueing compare`` and ``robustness``: what they write, and that they go on."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.platform import ablations, get_platform
from motion_cueing.envs.settings import save
from motion_cueing.evaluation.studies.results import StudyResults

from ..evaluation.studies.bends import PAPER, bend


@pytest.fixture
def cue_file(tmp_path):
    path = tmp_path / "bend.csv"
    bend().to_csv(path)
    return path


@pytest.mark.slow
def test_compare_writes_everything_and_goes_on(cue_file, tmp_path, capsys):
    out, machine = tmp_path / "out", tmp_path / "mine.yaml"
    save(replace(get_platform("dim-hexapod"), name="mine"), machine)
    argv = [
        "compare",
        "--platforms",
        "paper",
        str(machine),
        "--ablations",
        "--policies",
        "no-motion",
        "classical",
    ]
    argv += ["--maneuvers", str(cue_file), "--out", str(out)]
    assert main(argv) == 0
    shown = capsys.readouterr().out
    assert "10 of 10 drives driven now" in shown
    assert "paper-hexapod-only" in shown
    assert {file.name for file in out.iterdir()} == {
        "pairs",
        "study.json",
        "study.csv",
        "study.md",
        "study.png",
    }
    results = StudyResults.load_json(out / "study.json")
    assert list(results.conditions) == ["paper", *(one.name for one in ablations(PAPER)), "mine"]
    assert sorted(results.command.split()) == sorted(["motion-cueing", *argv])
    assert main(argv) == 0
    assert "0 of 10 drives driven now" in capsys.readouterr().out
    first, second = sorted((out / "pairs").iterdir())[:2]
    first.write_text("{")
    values = json.loads(second.read_text())
    values["drives"]["bend"]["metrics"] = dict.fromkeys(values["drives"]["bend"]["metrics"], "wrong")
    second.write_text(json.dumps(values))
    assert main(argv) == 2
    damaged = f"{first}, {second}: damaged, not the drives of a study; delete them, or add --fresh"
    assert capsys.readouterr().err == f"motion-cueing compare: {damaged}\n"
    mine = first.with_name("mine.txt")
    mine.write_text("not of this command")
    assert main([*argv, "--fresh"]) == 0
    assert mine.exists()
    assert "10 of 10 drives driven now" in capsys.readouterr().out


def test_robustness_writes_everything(cue_file, tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["robustness", "--policies", "no-motion", "classical", "learned-preview"]
    argv += ["--maneuvers", str(cue_file)]
    assert main([*argv, "--lag", "15", "--time-scaling", "1.5", "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "18 of 18 drives driven now" in shown
    values = json.loads((out / "study.json").read_text())
    assert values["conditions"]["lag"].startswith("actuators with a lag of 15 rad/s")
    ratio = {
        who: {name: found[who]["ratio"] for name, found in values["summaries"].items()}
        for who in values["policies"]
    }
    still = ratio["no-motion"]
    assert {ratio_ for name, ratio_ in still.items() if name != "time scaling"} == {1.0}
    assert still["time scaling"] > 1.5
    for who in ("classical", "learned-preview"):
        # The file's drive is the same in another car; all else changes what a controller gives.
        assert ratio[who]["nominal"] == ratio[who]["other car"] == 1.0
        for name in ("lag", "dead time", "noise", "time scaling"):
            assert ratio[who][name] != 1.0


def test_map_faults_change_nothing_for_a_policy_that_sees_no_road(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["map-faults", "--policies", "no-motion", "classical", "--maneuvers", "braking", "--out", str(out)]
    assert main(argv) == 0
    assert "16 of 16 drives driven now" in capsys.readouterr().out
    values = json.loads((out / "study.json").read_text())
    assert len(values["conditions"]) == 8
    for found in values["summaries"].values():
        assert found["classical"]["ratio"] == found["no-motion"]["ratio"] == 1.0
    assert "Worst second of J over the drives" in (out / "study.md").read_text()
    assert main(argv) == 0
    assert "0 of 16 drives driven now" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["compare", "--platforms", "papre"], "paper"),
        (["compare", "--policies", "classikal"], "classical"),
        (["compare", "--maneuvers", "none.csv"], "no such file"),
        (["robustness", "--time-scaling", "9"], "time_scaling"),
        (["robustness", "--lag", "0"], "lag"),
        (["map-faults", "--low", "0"], "low"),
        (["robustness", "--other-car", "tank"], "unknown car"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(words, told, capsys):
    assert main(words) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error


def test_machines_of_one_name_are_refused(tmp_path, capsys):
    machine = tmp_path / "mine.yaml"
    save(replace(PAPER, description="another"), machine)
    assert main(["compare", "--platforms", "paper", str(machine), "--policies", "no-motion"]) == 2
    assert "two motion bases" in capsys.readouterr().err

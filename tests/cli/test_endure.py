"""``motion-cueing endure``: what it writes, that it goes on, and what its status says."""

from __future__ import annotations

import csv
import json

import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import drive_seeds
from motion_cueing.evaluation import measure, rollout
from motion_cueing.evaluation.endurance import NOMINAL, SLOWER, Endurance
from motion_cueing.evaluation.endurance.results import EnduranceResults, Endured, EnduredDrive, summarized
from motion_cueing.evaluation.endurance.run import EnduranceRequest, EnduranceRun, Stopped
from motion_cueing.evaluation.policies import make_policy

from ..evaluation.studies.bends import PAPER

pytestmark = pytest.mark.slow

SECONDS = 5.0
ARGV = ["endure", "--policies", "no-motion", "classical", "--duration", str(SECONDS), "--envs", "2"]


def drive_hours(drives):
    return ["--hours", str(drives * SECONDS / 3600.0)]


def test_it_writes_everything_and_goes_on(tmp_path, capsys):
    out = tmp_path / "out"
    argv = [*ARGV, "--out", str(out)]
    assert main([*argv, *drive_hours(3)]) == 0
    shown = capsys.readouterr().out
    assert "6 drives driven now" in shown
    assert {file.name for file in out.iterdir()} == {
        "drives",
        "endurance.json",
        "endurance.csv",
        "endurance.md",
    }
    results = EnduranceResults.load_json(out / "endurance.json")
    assert results.finished
    assert [drive.seed for drive in results.policies["classical"].drives] == drive_seeds(3, 0)
    still = results.summaries["no-motion"]
    assert still.ratio == still.perceived_ratio == 1.0
    assert still.hours == pytest.approx(3.0 * SECONDS / 3600.0)
    assert still.cue_error > 0.01
    assert all(found.withstood for found in results.summaries.values())
    with (out / "endurance.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert {row["condition"] for row in rows} == {NOMINAL, SLOWER}
    assert {row["exceeded_position"] for row in rows} == {"0"}
    # More hours are the same drives and more; all in one batch are the same numbers.
    assert main([*argv, *drive_hours(4)]) == 0
    assert "2 drives driven now" in capsys.readouterr().out
    kept = EnduranceResults.load_json(out / "endurance.json").policies["classical"].drives
    whole = tmp_path / "whole"
    assert main([*argv[:-3], "9", "--out", str(whole), *drive_hours(4)]) == 0
    at_once = EnduranceResults.load_json(whole / "endurance.json").policies["classical"].drives
    for one, other in zip(kept, at_once, strict=True):
        assert (one.name, one.machine) == (other.name, other.machine)
        for condition, found in one.conditions.items():
            assert found.cue_error == pytest.approx(other.conditions[condition].cue_error, rel=1e-9)
    capsys.readouterr()
    assert main([*argv, *drive_hours(4), "--fresh"]) == 0
    assert "8 drives driven now" in capsys.readouterr().out


def test_a_single_drive_can_be_looked_into(tmp_path, capsys):
    seed = drive_seeds(2, 7)[1]
    argv = [
        "endure",
        "--policies",
        "classical",
        "--duration",
        "6",
        "--seeds",
        str(seed),
        "--out",
        str(tmp_path),
    ]
    assert main(argv) == 0
    (drive,) = EnduranceResults.load_json(tmp_path / "endurance.json").policies["classical"].drives
    cues = CueTrace.from_csv(tmp_path / f"{drive.name}.csv")
    metrics = measure(rollout(make_policy("classical", PAPER), cues, PAPER))
    assert drive.seed == seed
    assert drive.conditions[NOMINAL].cue_error == pytest.approx(metrics.cue_error, rel=1e-5)


def test_what_is_done_is_kept_when_it_is_stopped(tmp_path):
    asked = EnduranceRequest(
        Endurance(duration=2.0), PAPER, {"classical": "classical"}, drive_seeds(4, 0), 2, tmp_path
    )
    done = []

    def tell(what, seconds):
        done.append(seconds)
        if sum(done) > 4 * 2.0:
            raise Stopped

    found = EnduranceRun(asked).drive(tell)
    assert not found.finished
    assert found.driven == len(found.policies["classical"].drives) == 2
    again = EnduranceRun(asked)
    assert again.seconds == 2 * 2 * 2.0
    found = again.drive(lambda what, seconds: None)
    assert found.finished
    assert (found.driven, len(found.policies["classical"].drives)) == (2, 4)
    # Another way of driving is another key: nothing of this is taken.
    other = EnduranceRequest(Endurance(duration=3.0), PAPER, asked.policies, asked.seeds, 2, tmp_path)
    assert EnduranceRun(other).seconds == 4 * 2 * 3.0


def test_ctrl_c_ends_it_with_what_was_driven(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("motion_cueing.train.training.Interrupt.asked", True, raising=False)
    monkeypatch.setattr("motion_cueing.train.training.Interrupt.__init__", lambda self: None)
    assert main([*ARGV, "--out", str(tmp_path), *drive_hours(2)]) == 130
    assert "interrupted, the same command goes on; 0 drives driven now" in capsys.readouterr().out
    assert not EnduranceResults.load_json(tmp_path / "endurance.json").finished


def endured(error=1.0, beyond=0, not_finite=0):
    return Endured(101, error, 2.0, 0.25, beyond, {"position": beyond}, not_finite)


def drive(seed, nominal, slower):
    return EnduredDrive(f"urban-{seed}", seed, "sedan", 1.0, 0, {NOMINAL: nominal, SLOWER: slower})


def test_drives_in_one():
    drives = [drive(1, endured(1.0), endured(4.0)), drive(2, endured(3.0), endured(2.0, 5))]
    found = summarized(drives, 0.01)
    assert (found.cue_error, found.slower_cue_error, found.ratio) == (2.0, 3.0, 1.5)
    assert (found.worst, found.worst_cue_error) == ("urban-1", 4.0)
    assert found.hours == pytest.approx(2.0 / 3600.0)
    assert (found.beyond, found.exceeded, found.withstood) == (5, {"position": 5}, False)
    assert not summarized([drive(1, endured(), endured(not_finite=1))], 0.01).withstood
    lost = summarized([drive(1, endured(), endured(2.0)), drive(3, endured(), endured(None, 1))], 0.01)
    assert (lost.worst, lost.slower_cue_error, lost.ratio) == ("urban-3", None, None)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--policies", "classikal"], "classical"),
        (["--hours", "0"], "hours must be positive"),
        (["--hours", "inf"], "hours must be positive and finite"),
        (["--envs", "-1"], "envs must be positive"),
        (["--lag", "60", "30"], "from low to high"),
        (["--dead-time", "0.1"], "--dead-time"),
        (["--seeds", "-5"], "seed is -5"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(words, told, tmp_path, capsys):
    assert main(["endure", "--out", str(tmp_path), *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error


def test_damaged_drives_and_foreign_results_are_refused(tmp_path, capsys):
    argv = ["endure", "--policies", "no-motion", "--duration", "2", *drive_hours(1), "--out", str(tmp_path)]
    assert main(argv) == 0
    (kept,) = (tmp_path / "drives").iterdir()
    kept.write_text("{")
    assert main(argv) == 2
    assert f"{kept}: damaged" in capsys.readouterr().err
    # A wrong policy forgets nothing, and only what these policies drove is driven again.
    assert main([*argv, "--fresh", "--policies", "no-motion", "nobody.safetensors"]) == 2
    assert kept.read_text() == "{"
    (tmp_path / "drives" / "mine.txt").write_text("not of this command")
    assert main([*argv, "--fresh"]) == 0
    assert (tmp_path / "drives" / "mine.txt").exists()
    (tmp_path / "endurance.json").write_text(json.dumps({"mine": 1}))
    assert main(argv) == 2
    assert "was not written by this command" in capsys.readouterr().err


def test_compensated_drives_are_conditions_of_their_own(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["endure", "--policies", "no-motion", "learned", "--duration", str(SECONDS), "--out", str(out)]
    argv += drive_hours(2)
    compensated = [*argv, "--compensate", "--lateness-error", "0.2"]
    assert main(compensated) == 0
    shown = capsys.readouterr().out
    assert "Slower machines whose lateness is known" in shown
    assert "known ×0.8" in shown
    results = EnduranceResults.load_json(out / "endurance.json")
    names = {"compensated", "compensated, known ×0.8", "compensated, known ×1.2"}
    assert set(results.summaries["learned"].compensated) == names
    still = results.policies["no-motion"].drives[0].conditions
    assert len({one.cue_error for one in still.values()}) == 1
    errors = [one.cue_error for one in results.policies["learned"].drives[0].conditions.values()]
    assert len(set(errors)) == 5
    # Without compensation it is another study; its drives are as they always were.
    assert main(argv) == 0
    assert "4 drives driven now" in capsys.readouterr().out
    again = EnduranceResults.load_json(out / "endurance.json").policies["learned"].drives[0].conditions
    assert [again[name].cue_error for name in (NOMINAL, SLOWER)] == errors[:2]


def test_an_error_of_the_lateness_beyond_all_of_it_is_refused(capsys):
    assert main([*ARGV, "--compensate", "--lateness-error", "1.5"]) == 2
    assert "--lateness-error must be at least 0 and below 1, found 1.5" in capsys.readouterr().err

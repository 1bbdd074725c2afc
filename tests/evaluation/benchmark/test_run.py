"""The run of the benchmark: what is driven, what is kept, and what it comes to."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motion_cueing.baselines import NoMotion
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import measure, rollout
from motion_cueing.evaluation.benchmark import BenchmarkRequest, BenchmarkResults, Entrant, SplitResult
from motion_cueing.evaluation.benchmark.run import BenchmarkRun, run_benchmark
from motion_cueing.evaluation.metrics import METRICS, References
from motion_cueing.evaluation.policies import make_policy

from .small import Push, Tired, small_split, values_of

PAPER = get_platform("paper")


def request(folder, *entrants, splits=None, **more):
    made = [one if isinstance(one, Entrant) else Entrant(one, (one,)) for one in entrants]
    return BenchmarkRequest(splits or [small_split()], [PAPER], made, folder, **more)


def results(outcome, splits=None, **more):
    records = [SplitResult.of(split) for split in splits or [small_split()]]
    return BenchmarkResults.of(["test"], records, outcome.platforms, outcome.skipped, **more)


def test_every_drive_has_the_metrics_of_a_rollout_of_it(tmp_path):
    found = run_benchmark(request(tmp_path, "optimal-washout-tuned", "learned"))
    assert found.driven == 4
    for name in ("optimal-washout-tuned", "learned"):
        drives = found.platforms["paper"][name].runs[0].drives["small"]
        for cues in small_split().cues.values():
            alone = measure(rollout(make_policy(name, PAPER), cues, PAPER))
            values = drives[cues.name]
            assert set(values) == set(METRICS)
            for metric in METRICS:
                if not metric.startswith("step_time"):
                    assert values[metric] == getattr(alone, metric), metric
            assert values["step_time_mean"] > 0.0


def test_what_is_done_is_not_driven_again(tmp_path):
    first = run_benchmark(request(tmp_path, "no-motion", "classical"))
    again = run_benchmark(request(tmp_path, "no-motion", "classical"))
    assert (first.driven, again.driven) == (4, 0)
    assert first.platforms == again.platforms
    more = run_benchmark(
        request(tmp_path, "no-motion", "optimal-washout-tuned", splits=[small_split(drives=3)])
    )
    # One more drive of the first policy, three of the new one.
    assert more.driven == 4
    changed = run_benchmark(request(tmp_path, "no-motion", splits=[small_split(strength=1.1)]))
    assert changed.driven == 2


def test_a_policy_of_other_parameters_is_driven_anew(tmp_path):
    entrants = [Entrant("push", (policy,)) for policy in (Push(), Push(), make_policy("classical", PAPER))]
    driven = [run_benchmark(request(tmp_path, one)).driven for one in entrants]
    assert driven == [2, 0, 2]


def test_an_interrupted_run_keeps_what_is_done_and_goes_on(tmp_path):
    whole = BenchmarkRun(request(tmp_path, "no-motion", "classical", "mpc-preview"))
    assert whole.missing == 6
    done = []
    outcome = whole.drive(lambda what, drives: done.append(drives), lambda: len(done) == 2)
    assert not outcome.finished
    assert outcome.driven == sum(done) == 4
    rest = BenchmarkRun(request(tmp_path, "no-motion", "classical", "mpc-preview"))
    assert rest.missing == 2
    outcome = rest.drive()
    assert outcome.finished
    assert outcome.driven == 2


def test_a_drive_that_fails_costs_no_other(tmp_path):
    outcome = run_benchmark(request(tmp_path, Entrant("tired", (Tired(),)), "no-motion"))
    run = outcome.platforms["paper"]["tired"].runs[0]
    assert list(run.drives["small"]) == ["weave-0"]
    assert "tired raised RuntimeError: tired" in run.failures["small"]["weave-1"]
    found = results(outcome, references=References(baseline="no-motion"))
    summary = found.of_split("paper", "small")["tired"]
    assert (summary.drives, summary.requested) == (1, 2)
    # In the drive that both finished they are equal.
    assert summary.difference.value == 0.0
    assert summary.improvement.value == 0.5


@pytest.mark.slow
def test_processes_drive_what_one_process_drives(tmp_path):
    names = ("optimal-washout-tuned", "mpc-preview")
    here = run_benchmark(request(tmp_path / "here", *names))
    there = run_benchmark(request(tmp_path / "there", *names, workers=2))
    assert there.finished
    assert there.driven == here.driven == 4
    for name in names:
        assert values_of(there, name) == values_of(here, name)


def test_a_registered_policy_and_seeds_of_an_agent_take_part(tmp_path, monkeypatch):
    from motion_cueing.baselines.registry import POLICIES, register

    monkeypatch.setattr(POLICIES, "_entries", dict(POLICIES._entries))
    register("my-push", lambda platform: Push(), "of another package")
    seeds = Entrant("pushes", (Push(0.1), Push(0.2), Push(0.6)))
    outcome = run_benchmark(request(tmp_path, "my-push", "no-motion", seeds))
    found = results(outcome, references=References(baseline="no-motion"))
    summaries = found.of_split("paper", "small")
    assert summaries["my-push"].mean.value == pytest.approx(
        np.mean(list(values_of(outcome, "my-push").values()))
    )
    spread = summaries["pushes"]
    assert len(spread.run_means) == len(set(spread.run_means)) == 3
    assert spread.mean.value == pytest.approx(np.mean(spread.run_means))
    assert spread.difference.value == pytest.approx(spread.mean.value - summaries["no-motion"].mean.value)


def test_a_policy_that_fits_no_machine_is_refused_and_one_of_the_benchmark_skipped(tmp_path):
    small = get_platform("24-inch")
    entrants = [Entrant("learned", ("learned",)), Entrant("no-motion", ("no-motion",))]
    both = BenchmarkRequest([small_split()], [PAPER, small], entrants, tmp_path)
    outcome = run_benchmark(both)
    assert list(outcome.platforms["24-inch"]) == ["no-motion"]
    assert "made for the motion base 'paper'" in outcome.skipped["24-inch"]["learned"]
    with pytest.raises(ConfigurationError, match="made for the motion base 'paper'"):
        BenchmarkRun(BenchmarkRequest([small_split()], [small], entrants, tmp_path))
    skipped = run_benchmark(
        BenchmarkRequest([small_split()], [small], entrants, tmp_path, may_skip=frozenset({"learned"}))
    )
    assert list(skipped.platforms["24-inch"]) == ["no-motion"]


def test_damaged_drives_are_refused(tmp_path):
    run_benchmark(request(tmp_path, "no-motion"))
    (path,) = (tmp_path / "drives").glob("*.json")
    path.write_text("{")
    with pytest.raises(DataError, match="damaged, not the drives of a benchmark"):
        BenchmarkRun(request(tmp_path, "no-motion"))


def test_a_policy_states_what_it_knows(tmp_path):
    class Knowing(NoMotion):
        information = make_policy("mpc-preview", PAPER).information

    outcome = run_benchmark(request(tmp_path, Entrant("knowing", (Knowing(),)), "learned"))
    assert outcome.platforms["paper"]["knowing"].information == "2 s true"
    assert outcome.platforms["paper"]["learned"].information == "now"


def test_results_are_written_and_read(tmp_path):
    outcome = run_benchmark(request(tmp_path, "no-motion", "optimal-washout-tuned"))
    found = results(outcome)
    found.save_json(tmp_path / "benchmark.json")
    read = BenchmarkResults.load_json(tmp_path / "benchmark.json")
    assert read == found
    raw = json.loads((tmp_path / "benchmark.json").read_text())
    assert raw["splits"][0]["hash"] == small_split().hash
    assert {"motion-cueing-gym", "python", "numpy", "warp-lang"} <= set(raw["versions"])
    found.save_csv(tmp_path / "benchmark.csv")
    found.save_summaries(tmp_path / "summaries.csv")
    assert len((tmp_path / "benchmark.csv").read_text().splitlines()) == 1 + 2 * 2
    assert len((tmp_path / "summaries.csv").read_text().splitlines()) == 1 + 2 * 2

"""Studies: what is driven, kept and driven again; machines with locked subsystems; disturbances."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.baselines.washout import load_washout
from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.observation import OBSERVATION_SIZE, read
from motion_cueing.envs.platform import ablation_names, ablations, get_platform, platform_names
from motion_cueing.envs.settings import save
from motion_cueing.envs.task import TaskOptions
from motion_cueing.evaluation import study as study_module
from motion_cueing.evaluation.command_line import main
from motion_cueing.evaluation.disturbances import Disturbances, Study, fiercer
from motion_cueing.evaluation.fitting import moved_to, policy_on
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import rollout
from motion_cueing.evaluation.sensor_noise import SensorNoise, with_noise
from motion_cueing.evaluation.study import Condition, run_study
from motion_cueing.evaluation.study_command import results_of
from motion_cueing.evaluation.study_figures import heat_figure, lines_figure
from motion_cueing.evaluation.study_results import StudyResults
from motion_cueing.evaluation.study_tables import condition_table, matrix_table

from .synthetic import drive

PAPER = get_platform("paper")
SEDAN = get_car("sedan")
GAINS = {"no-motion": 0.0, "classical-tuned": 0.6, "mine": 0.8, "optimum": 0.95}


def bend(name="bend", seconds=1.5, force=1.0):
    """A car that is pushed to the right a little while it turns."""
    time = 0.01 * np.arange(round(100 * seconds))
    wave = np.sin(4.0 * time)
    specific = np.stack([0.3 * force * wave, force * wave, np.full_like(time, -9.81)], axis=1)
    return CueTrace(name, time, specific, np.stack([0.02 * wave, 0.01 * wave, 0.1 * force * wave], axis=1))


class Gain:
    """A made-up policy, by its gain."""

    def __init__(self, gain, parameters=None):
        self.gain, self.parameters = gain, parameters


@pytest.fixture
def roll(monkeypatch):
    """A simulator that answers at once, and counts: the condition's machine takes part of the gain away."""
    driven = []

    def rolled(policy, cues, platform, car):
        driven.append((policy.gain, cues.name, platform.name))
        if cues.name == "cliff" and policy.gain == 0.8:
            raise RuntimeError("fell")
        made = drive(policy.gain * (1.0 if platform.turntable else 0.5))
        return replace(made, metadata={**made.metadata, "solves": "7"} if policy.gain == 0.95 else {})

    monkeypatch.setattr(study_module, "rollout", rolled)
    return driven


def condition(platform=PAPER, maneuvers=("bend", "ridge"), make=None, **more):
    sources = {name: (lambda name=name: bend(name)) for name in maneuvers}
    chosen = make or (lambda name: Gain(GAINS[name]))
    return Condition(platform.name, platform.description, platform, SEDAN, sources, chosen, **more)


CONDITIONS = [condition(), condition(get_platform("paper-no-turntable"))]
POLICIES = {name: name for name in GAINS}


def study_of(conditions, folder, policies=POLICIES):
    outcome = run_study(conditions, policies, folder)
    return results_of(conditions, list(policies), outcome, ["motion-cueing", "compare"]), outcome


def test_what_is_done_is_not_driven_again(roll, tmp_path):
    first, outcome = study_of(CONDITIONS, tmp_path)
    assert outcome.driven == len(roll) == 2 * 2 * 4
    again, outcome = study_of(CONDITIONS, tmp_path)
    assert outcome.driven == 0
    assert again.metrics == first.metrics
    assert (
        again.notes
        == first.notes
        == {name.name: {"optimum": {m: {"solves": "7"} for m in ("bend", "ridge")}} for name in CONDITIONS}
    )
    assert len(roll) == 16


def test_an_extended_study_drives_what_is_new(roll, tmp_path):
    study_of(CONDITIONS[:1], tmp_path, {"mine": "mine"})
    longer = [condition(maneuvers=("bend", "ridge", "hill")), CONDITIONS[1]]
    assert study_of(longer, tmp_path)[1].driven == 5 * 4 - 2


def test_an_interrupted_study_goes_on(roll, tmp_path, monkeypatch):
    rolled, calls = study_module.rollout, []

    def interrupted(*arguments):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return rolled(*arguments)

    monkeypatch.setattr(study_module, "rollout", interrupted)
    with pytest.raises(KeyboardInterrupt):
        study_of(CONDITIONS, tmp_path)
    monkeypatch.setattr(study_module, "rollout", rolled)
    assert study_of(CONDITIONS, tmp_path)[1].driven == 16 - 3


def heavier(platform):
    return replace(platform, hexapod=replace(platform.hexapod, velocity=0.5))


@pytest.mark.parametrize(
    "other",
    [
        condition(heavier(PAPER)),
        replace(condition(), car=get_car("volvo-v40")),
        condition(about={"noise": 1}),
        condition(make=lambda name: Gain(GAINS[name], load_washout("classical"))),
        replace(condition(), maneuvers={"bend": lambda: bend(force=2.0)}),
    ],
)
def test_a_drive_that_differs_is_driven_again(other, roll, tmp_path):
    study_of([condition(maneuvers=("bend",))], tmp_path, {"mine": "mine"})
    one = replace(other, maneuvers={"bend": other.maneuvers["bend"]})
    assert study_of([one], tmp_path, {"mine": "mine"})[1].driven == 1


def test_a_file_that_changes_is_another_policy(roll, tmp_path):
    made = condition(maneuvers=("bend",), make=lambda name: Gain(0.5))
    file = tmp_path / "mine.yaml"
    for text, driven in (("a", 1), ("a", 0), ("b", 1)):
        file.write_text(text)
        assert study_of([made], tmp_path, {"mine": str(file)})[1].driven == driven


def test_a_broken_file_of_drives_is_told(roll, tmp_path):
    study_of(CONDITIONS, tmp_path)
    broken = next((tmp_path / "pairs").iterdir())
    broken.write_text("{")
    with pytest.raises(DataError, match="--fresh"):
        study_of(CONDITIONS, tmp_path)


def test_left_out_and_failed_are_told_and_the_others_stay(roll, tmp_path):
    def make(name):
        if name == "optimum":
            raise ConfigurationError("needs a solver")
        return Gain(GAINS[name])

    def fails():
        raise DataError("no road")

    one = condition(maneuvers=("bend", "cliff"), make=make)
    one = replace(one, maneuvers={**one.maneuvers, "gap": fails})
    results, _ = study_of([one], tmp_path)
    assert results.left_out == {"paper": {"optimum": "needs a solver"}}
    told = {(failure.policy, failure.maneuver): failure.message for failure in results.failures}
    assert told == {(None, "gap"): "no road", ("mine", "cliff"): "RuntimeError: fell"}
    # Means are over what every policy finished.
    assert results.maneuvers == ("bend",)
    assert set(results.summaries["paper"]) == {"no-motion", "classical-tuned", "mine"}
    assert matrix_table(results, "t", False).rows[-1] == ("optimum", "left out")


def test_summaries_are_means_with_ratio_and_share(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    whole, locked = results.summaries.values()
    metrics = results.metrics["paper"]["mine"]
    assert whole["mine"].cue_error == pytest.approx(np.mean([m.cue_error for m in metrics.values()]))
    assert (whole["classical-tuned"].share, whole["optimum"].share) == (0.0, 1.0)
    assert whole["mine"].perceived_share is None
    assert locked["mine"].ratio == pytest.approx(locked["mine"].cue_error / whole["mine"].cue_error)
    assert locked["no-motion"].ratio == 1.0
    table = condition_table(results, "paper")
    assert table.rows[0][0] == "optimum"
    assert table.rows[0][table.header.index("share of the gap")] == "1.00"
    cell = matrix_table(results, "t", True).rows[2][2]
    assert cell.endswith(f"(×{locked['mine'].ratio:.2f})")


def test_results_are_written_read_and_drawn(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    results.save_json(tmp_path / "study.json")
    assert StudyResults.load_json(tmp_path / "study.json") == results
    results.save_csv(tmp_path / "study.csv")
    rows = list(csv.DictReader((tmp_path / "study.csv").open()))
    assert [(row["condition"], row["policy"]) for row in rows[:2]] == [
        ("paper", "no-motion"),
        ("paper", "classical-tuned"),
    ]
    assert float(rows[2]["cue_error"]) == results.summaries["paper"]["mine"].cue_error
    nothing = replace(results, summaries={})
    for draw in (lines_figure, heat_figure):
        image = draw(results)
        assert image is not None
        assert image.startswith(b"\x89PNG")
        assert draw(nothing) is None
    (tmp_path / "study.json").write_text('{"schema": 9}')
    with pytest.raises(DataError, match="version 9"):
        StudyResults.load_json(tmp_path / "study.json")


def test_ablations_lock_what_a_machine_has():
    assert [one.name for one in ablations(PAPER)] == [
        "paper-no-turntable",
        "paper-no-carriage",
        "paper-hexapod-only",
    ]
    assert [one.name for one in ablations(get_platform("24-inch"))] == ["24-inch-no-turntable"]
    assert ablations(get_platform("dim-hexapod")) == []
    for name in ablation_names():
        one = get_platform(name)
        assert one.name == name
        assert name not in platform_names()
        assert TaskOptions(platform=name).platform == name
    alone = get_platform("nads-1-hexapod-only")
    assert (alone.carriage, alone.turntable) == (None, None)
    assert alone.hexapod == get_platform("nads-1").hexapod
    with pytest.raises(UnknownNameError, match="paper-no-carriage"):
        get_platform("paper-no-carrage")


def test_a_washout_without_turntable_yaws_with_its_hexapod():
    for name in ("classical", "adaptive", "optimal-washout"):
        assert policy_on(name, get_platform("paper-no-turntable")).parameters.turntable_share == 0.0
        assert policy_on(name, PAPER).parameters.turntable_share > 0.0
    yaw = []
    for fit in (policy_on, make_policy):
        machine = get_platform("paper-no-turntable")
        felt = rollout(fit("classical", machine), bend(), machine).w_felt
        yaw.append(np.abs(felt[:, 2]).max())
    assert yaw[0] > 0.05
    assert yaw[1] < 1e-3


def test_an_agent_is_forced_onto_another_machine():
    machine = get_platform("paper-hexapod-only")
    drive_ = rollout(policy_on("learned-preview", machine), bend(), machine)
    assert not drive_.carriage.any()
    assert not drive_.turntable.any()
    assert np.abs(drive_.hexapod).max() > 1e-4
    with pytest.raises(ConfigurationError):
        make_policy("learned-preview", machine)
    assert moved_to(make_policy("learned-preview", PAPER), machine).platform == machine
    still = NoMotion()
    assert moved_to(still, machine) is still


def test_the_same_way_twice_as_fiercely():
    """A bend keeps its radius a / w^2 and its total angle; roll and pitch, as gravity in f, double."""
    cues = bend(seconds=6.0)
    fierce = fiercer(cues, 2.0)
    speed = np.sqrt(2.0)
    assert fierce.dt == pytest.approx(cues.dt)
    assert fierce.duration == pytest.approx(cues.duration / speed, abs=0.011)
    inside = fierce.time * speed <= cues.duration
    at = fierce.time[inside] * speed

    def before(values):
        return np.stack([np.interp(at, cues.time, column) for column in values.T], axis=1)

    rest = [0.0, 0.0, -9.81]
    np.testing.assert_allclose(
        fierce.specific_force[inside] - rest, 2.0 * (before(cues.specific_force) - rest), atol=1e-3
    )
    yaw = fierce.angular_velocity[inside, 2]
    np.testing.assert_allclose(yaw, speed * before(cues.angular_velocity)[:, 2], atol=1e-4)
    turned = [c.angular_velocity.sum(axis=0) * c.dt for c in (cues, fierce)]
    np.testing.assert_allclose(turned[1], turned[0] * [2.0, 2.0, 1.0], atol=3e-3)
    change = np.gradient(fierce.angular_velocity, fierce.dt, axis=0)
    np.testing.assert_allclose(change[2:-2], fierce.angular_acceleration[2:-2], atol=2e-3)


def test_no_fiercer_is_the_same():
    cues = bend()
    same = fiercer(cues, 1.0)
    np.testing.assert_array_equal(same.specific_force, cues.specific_force)
    np.testing.assert_array_equal(same.time, cues.time)


class Seer:
    """Keeps what it sees."""

    def __init__(self):
        self.seen = []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.seen.append(np.array(observation))
        return np.zeros((len(observation), 9)), len(self.seen)


def looked(policy, rows, steps=1):
    state = None
    for _ in range(steps):
        _, state = policy.predict(rows, state, None)


def test_noise_has_its_size_is_on_cues_alone_and_is_the_same_in_every_drive():
    noise = SensorNoise(force=0.2, rate=0.03, seed=4)
    seers = [Seer(), Seer()]
    for seer in seers:
        looked(with_noise(seer, noise), np.zeros((2000, OBSERVATION_SIZE)))
    np.testing.assert_array_equal(seers[0].seen[0], seers[1].seen[0])
    seen = seers[0].seen[0]
    for name, size in (
        ("wanted_force", 0.2),
        ("felt_force", 0.2),
        ("wanted_rate", 0.03),
        ("felt_rate", 0.03),
    ):
        assert np.std(read(seen, name)) == pytest.approx(size, rel=0.05)
    for name in ("carriage", "beta", "legs", "acceleration"):
        assert not read(seen, name).any()
    seer = Seer()
    behind = with_noise(seer, noise)
    looked(behind, np.zeros((1, OBSERVATION_SIZE)), steps=3)
    looked(behind, np.zeros((1, OBSERVATION_SIZE)), steps=1)
    assert (seer.seen[0] != seer.seen[1]).any()
    np.testing.assert_array_equal(seer.seen[0], seer.seen[3])


def test_no_noise_is_no_change():
    quiet = SensorNoise(force=0.0, rate=0.0)
    for policy in (ClassicalWashout(), make_policy("learned-preview", PAPER)):
        plain, behind = rollout(policy, bend(), PAPER), rollout(with_noise(policy, quiet), bend(), PAPER)
        np.testing.assert_array_equal(plain.action, behind.action)
        assert behind.policy == plain.policy


def test_an_agents_differences_are_as_noisy_as_its_cues():
    agent = make_policy("learned-preview", PAPER)
    behind = with_noise(agent, SensorNoise())
    rows = behind._noisy(np.zeros((50, agent.layout.size)))
    slices = agent.layout.slices
    for kind in ("force", "rate"):
        wanted, felt, error = (
            rows[:, slices[n]] for n in (f"wanted_{kind}", f"felt_{kind}", f"{kind}_error")
        )
        np.testing.assert_allclose(wanted - felt, error, atol=1e-7)


class Told:
    """Is told the drive."""

    name = "told"

    def for_drive(self, cues):
        return Seer()


def test_a_policy_that_is_told_the_drive_has_noisy_sensors_too():
    seer = with_noise(Told(), SensorNoise(force=1.0)).for_drive(bend())
    looked(seer, np.zeros((1, OBSERVATION_SIZE)))
    assert seer._policy.seen[0].any()


def robust(causal=()):
    def maneuvers(car):
        return {"bend": lambda: bend(force=1.0 if car.name == "sedan" else 1.5)}

    return Study(PAPER, SEDAN, get_car("volvo-v40"), maneuvers, Disturbances(), frozenset(causal))


def test_each_condition_of_robustness_disturbs_one_thing():
    found = {one.name: one for one in robust().conditions()}
    assert list(found) == ["nominal", "lag", "dead time", "noise", "other car", "fierce"]
    assert found["lag"].platform.hexapod.dynamics.natural_frequency == 30.0
    assert found["dead time"].platform.carriage.dynamics.dead_time == 0.05
    for name in ("nominal", "noise", "other car", "fierce"):
        assert found[name].platform == PAPER
    peaks = {name: np.abs(one.maneuvers["bend"]().specific_force[:, 1]).max() for name, one in found.items()}
    assert peaks["other car"] == pytest.approx(1.5 * peaks["nominal"])
    assert peaks["fierce"] == pytest.approx(2.0 * peaks["nominal"], rel=1e-3)
    assert peaks["noise"] == peaks["lag"] == peaks["nominal"]


def test_dead_time_delays_what_is_felt_and_the_controller_does_not_know():
    found = {one.name: one for one in robust().conditions()}
    felt = {}
    for name in ("nominal", "dead time"):
        one = found[name]
        felt[name] = rollout(one.make("classical"), one.maneuvers["bend"](), one.platform).w_felt[:, 2]
    np.testing.assert_allclose(felt["dead time"][5:], felt["nominal"][:-5], atol=1e-9)


def test_an_agent_meets_a_machine_it_does_not_know():
    lagging = robust().conditions()[1]
    assert lagging.make("learned-preview").platform == lagging.platform


def test_a_policy_that_is_told_the_drive_is_left_out_where_it_must_be_causal():
    make = robust(["classical-ceiling"]).conditions()[0].make
    with pytest.raises(ConfigurationError, match="told the drive"):
        make("classical-ceiling")
    assert robust().conditions()[0].make("classical-ceiling") is not None


@pytest.fixture
def cue_file(tmp_path):
    path = tmp_path / "bend.csv"
    bend().to_csv(path)
    return path


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
    assert main([*argv, "--fresh"]) == 0
    assert "10 of 10 drives driven now" in capsys.readouterr().out


def test_robustness_writes_everything(cue_file, tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["robustness", "--policies", "no-motion", "classical", "--maneuvers", str(cue_file)]
    assert main([*argv, "--lag", "15", "--fierceness", "1.5", "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "12 of 12 drives driven now" in shown
    values = json.loads((out / "study.json").read_text())
    assert values["conditions"]["lag"].startswith("actuators with a lag of 15 rad/s")
    ratio = {name: found["no-motion"]["ratio"] for name, found in values["summaries"].items()}
    assert ratio["nominal"] == ratio["lag"] == ratio["noise"] == 1.0
    assert ratio["fierce"] > 1.5


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["compare", "--platforms", "papre"], "paper"),
        (["compare", "--policies", "classikal"], "classical"),
        (["compare", "--maneuvers", "none.csv"], "no such file"),
        (["robustness", "--fierceness", "9"], "fierceness"),
        (["robustness", "--lag", "0"], "lag"),
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

"""The interface of policies: one place adapts objects, and every entry takes one with ``predict`` alone."""

from __future__ import annotations

import ast
import re
import textwrap
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, NoMotion, Policy, TaskPolicy, as_policy, make_policy
from motion_cueing.baselines import policy as policy_module
from motion_cueing.baselines.interface import Machines
from motion_cueing.baselines.policy import NOW, WHOLE_DRIVE, Information, Wrapper
from motion_cueing.baselines.registry import POLICIES
from motion_cueing.envs.car import get_car
from motion_cueing.envs.errors import ActionError, ConfigurationError
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE, SLICES, read
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.evaluation import rollout
from motion_cueing.evaluation.demonstrations import Demonstrator, demonstrate
from motion_cueing.evaluation.endurance import NOMINAL, SLOWER, Endurance
from motion_cueing.evaluation.endurance.run import EnduranceRequest, EnduranceRun
from motion_cueing.evaluation.frequency_response.response import FrequencyTest, frequency_response
from motion_cueing.evaluation.rollout import Rollout
from motion_cueing.evaluation.studies.disturbances import Disturbances, Study
from motion_cueing.evaluation.studies.study import Condition, run_study
from motion_cueing.evaluation.suite import run_suite
from motion_cueing.realtime import make_machine

from ..repository import ROOT
from .drives import trace, weave

PAPER, SEDAN = get_platform("paper"), get_car("sedan")

PROBES = {"isinstance", "issubclass", "getattr", "hasattr", "callable"}
SUBJECT = re.compile(r"(policy|agent|controller|teacher)$")
"""What the probed expression ends in."""
KINDS = re.compile(
    r"\b(\w*Policy|Agent|\w*Washout|NoMotion|Optimum|PredictiveController|PreviewController)\b"
)
OF_TORCH = "train/algorithms/sb3/"
"""Where policies are networks of Stable-Baselines3."""


def probes(path):
    """Calls that ask what kind of policy an object is, or what it has, with their lines."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in PROBES:
            subject, *kinds = (ast.unparse(argument) for argument in node.args)
            if SUBJECT.search(subject) or (node.func.id == "isinstance" and KINDS.search(kinds[0])):
                yield node.lineno, ast.unparse(node)


def test_nothing_but_as_policy_asks_what_kind_of_policy_there_is():
    found = {}
    for room in ("envs", "baselines", "train", "evaluation", "realtime", "cli"):
        for path in sorted((ROOT / room).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            for line, call in probes(path):
                if not name.startswith(OF_TORCH):
                    found[f"{name}:{line}"] = call
    assert {place.partition(":")[0] for place in found} <= {"baselines/policy.py"}, found
    module = ast.parse((ROOT / "baselines/policy.py").read_text())
    functions = {node.name: node for node in module.body if isinstance(node, ast.FunctionDef)}
    adapting = functions["as_policy"]
    lines = [int(place.partition(":")[2]) for place in found]
    assert lines
    assert all(adapting.lineno <= line <= adapting.end_lineno for line in lines)


class Bare:
    """Has ``predict`` alone: pushes the carriage with the car."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        action = np.zeros((len(observation), 9))
        action[:, :2] = 0.2 * read(observation, "reference_force")[:, :2]
        return action, state


class Heir(Policy):
    """The same, as a subclass."""

    predict = Bare.predict


CUES = trace(1.0, weave)


def test_the_example_of_the_interface_runs(monkeypatch):
    # Private, as a registry has no other way to forget a name.
    monkeypatch.setattr(POLICIES, "_entries", dict(POLICIES._entries))
    lines = policy_module.__doc__.splitlines()
    exec(textwrap.dedent("\n".join(line for line in lines if line.startswith("    "))), {})
    damper = make_policy("damper", PAPER)
    moving = np.zeros((1, OBSERVATION_SIZE))
    moving[:, SLICES["carriage_rate"]] = 1.0
    action, _ = damper.predict(moving)
    assert action[0, :2] == pytest.approx(-0.5 * read(moving, "carriage_rate")[0])
    assert rollout(damper, CUES, PAPER).policy == "damper"


def test_rollout_takes_an_object_that_has_predict_alone():
    found = rollout(Bare(), CUES, PAPER)
    assert found.policy == "Bare"
    assert np.abs(found.carriage).max() > 1e-4
    np.testing.assert_array_equal(found.carriage, rollout(Heir(), CUES, PAPER).carriage)


def test_a_suite_takes_it():
    outcome = run_suite(
        {"weave": lambda: CUES}, {"bare": partial(rollout, Bare(), platform=PAPER)}, lambda *given: None
    )
    assert not outcome.failures
    assert outcome.maneuvers["weave"]["bare"].cue_error > 0.0


def test_endurance_takes_it(tmp_path):
    request = EnduranceRequest(Endurance(duration=1.0, machines=2), PAPER, {"bare": Bare()}, [3], 1, tmp_path)
    found = EnduranceRun(request).drive(lambda what, seconds: None)
    (drive,) = found.policies["bare"].drives
    assert set(drive.conditions) == {NOMINAL, SLOWER}
    assert drive.conditions[NOMINAL].cue_error > 0.0


def test_studies_take_it(tmp_path):
    maneuvers = {"weave": lambda: CUES}
    compared = [
        Condition(one.name, "", one, SEDAN, maneuvers, partial(make_policy, platform=one, force=True))
        for one in (PAPER, get_platform("24-inch"))
    ]
    study = Study(PAPER, SEDAN, get_car("e-class-suv"), lambda car: maneuvers, Disturbances())
    for number, conditions in enumerate((compared, study.conditions())):
        found = run_study(conditions, {"bare": Bare()}, tmp_path / str(number))
        assert not found.failures
        assert not any(found.skipped.values())
        assert all(found.metrics[one.name]["bare"]["weave"].cue_error > 0.0 for one in conditions)


def test_the_frequency_response_takes_it():
    test = FrequencyTest(frequencies=(10.0,), settling=1.0, window=1.0)
    found = frequency_response(Bare(), PAPER, test, ("f_x", "w_z"))
    assert found.policy == "Bare"
    assert abs(found.response("f_x", "f_x")[0]) > 1e-3
    assert found.response("w_z", "w_z")[0] == 0.0


def test_demonstrations_take_it():
    demonstrator = Demonstrator("bare", Bare(), PAPER, get_vestibular_model("zacharias"))
    record, data = demonstrate(demonstrator, "weave", CUES)
    assert data.observation.shape == (len(record) - 1, OBSERVATION_SIZE)
    np.testing.assert_allclose(data.action[:, 0], 2.0 * data.observation[:, 0], rtol=1e-6)


def test_the_machine_in_real_time_takes_it():
    machine = make_machine(Bare(), PAPER)
    machine.catch_up(np.array([1.0, 0.0, -9.81, 0.0, 0.0, 0.0]))
    action, seconds = machine.act()
    assert action[0] == pytest.approx(0.2)
    assert seconds > 0.0


def test_what_is_no_policy_is_refused_with_what_to_do():
    for wrong in (None, "classical", Bare, 3):
        with pytest.raises(ConfigurationError, match=r"no method predict\(observation"):
            rollout(wrong, CUES, PAPER)
    with pytest.raises(ConfigurationError, match="must know the drive"):
        make_policy("classical-per-maneuver", PAPER).predict(np.zeros((1, OBSERVATION_SIZE)))
    with pytest.raises(NotImplementedError, match="Policy has no predict"):
        Policy().predict(np.zeros((1, OBSERVATION_SIZE)))


def test_an_object_keeps_what_it_has_by_its_new_name_or_its_old_one():
    class Rich(Bare):
        def __init__(self):
            self.name, self.parameters, self.time_step = "rich", {"gain": 0.2}, 0.01
            self.start_pose, self.statistics = np.full(9, 0.01), {"calls": "7"}

    class Earlier(Bare):
        def __init__(self):
            self.start, self.notes, self.dt = np.full(9, 0.01), {"calls": "7"}, 0.02

    rich, earlier = as_policy(Rich()), as_policy(Earlier())
    assert (rich.name, rich.parameters, rich.time_step, rich.task) == ("rich", {"gain": 0.2}, 0.01, None)
    assert earlier.time_step == 0.02
    for policy in (rich, earlier):
        assert policy.statistics == {"calls": "7"}
        assert policy.start_pose.tolist() == [0.01] * 9
    assert as_policy(rich) is rich


def test_information_of_each_kind_of_policy():
    assert ClassicalWashout().information == NoMotion().information == as_policy(Bare()).information == NOW
    assert make_policy("mpc", PAPER).information == NOW
    assert make_policy("mpc-preview", PAPER).information == Information("preview", 2.0)
    assert make_policy("optimum", PAPER).information == WHOLE_DRIVE
    assert make_policy("learned", PAPER).information == NOW
    assert make_policy("learned-preview", PAPER).information.kind == "preview"
    needing = ("mpc-preview", "optimum", "classical-per-maneuver")
    for name in ("no-motion", "classical", "mpc", "learned-preview", *needing):
        assert make_policy(name, PAPER).needs_drive == (name in needing)


def test_a_model_acts_in_the_environment_it_was_trained_in():
    class Model:
        """As of Stable-Baselines3: no name, no task."""

        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            assert observation.shape[1] > OBSERVATION_SIZE
            return np.full((len(observation), 9), 0.1, dtype=np.float32), None

    task = TaskOptions(observation=ObservationOptions(preview=2), action=ActionOptions(authority=0.1))
    policy = as_policy(Model(), task)
    assert isinstance(policy, TaskPolicy)
    assert policy.information == Information("preview", 0.4)
    found = rollout(policy, CUES)
    assert found.platform == "paper"
    assert 0.0 < found.action[1, 0] < 9.0
    with pytest.raises(ConfigurationError, match="made for the motion base 'paper', not '24-inch'"):
        rollout(policy, CUES, get_platform("24-inch"))
    assert rollout(policy.on(get_platform("24-inch")), CUES).platform == "24-inch"
    anywhere = as_policy(Model(), replace(task, observation=replace(task.observation, machine=True)))
    assert rollout(anywhere, CUES, get_platform("24-inch")).platform == "24-inch"


def test_side_by_side_each_drive_is_what_it_is_alone():
    drives = [CUES, trace(1.0, lambda t: 2.0 * weave(t)), trace(1.0)]
    machines = Machines(drives, [PAPER, get_platform("nads-1")], [0, 1, 0])
    run = Rollout(ClassicalWashout(), machines)
    for _ in run.steps():
        pass
    for i, platform in enumerate((PAPER, get_platform("nads-1"), PAPER)):
        alone = Rollout(ClassicalWashout(), Machines([drives[i]], [platform]))
        for _ in alone.steps():
            pass
        assert alone.simulator.state[0]["motion"] == run.simulator.state[i]["motion"]
        assert alone.simulator.state[0]["simulator_cue"] == run.simulator.state[i]["simulator_cue"]


def test_actions_of_a_batch_are_checked_as_those_of_one():
    class Few(Bare):
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            return np.zeros((1, 9)), None

    with pytest.raises(ActionError, match=r"shape \(1, 9\), expected \(2, 9\)"):
        next(Rollout(Few(), Machines([CUES, CUES], [PAPER])).steps())


def test_a_wrapper_is_what_it_stands_before():
    class Doubled(Wrapper):
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            action, state = self.inner.predict(observation, state, episode_start, deterministic)
            return 2.0 * action, state

    for name in ("classical", "mpc-preview", "learned-preview"):
        inner = make_policy(name, PAPER)
        outer = Doubled(inner)
        for attribute in ("name", "parameters", "time_step", "information", "task", "needs_drive"):
            assert getattr(outer, attribute) == getattr(inner, attribute)
        assert type(outer.for_drive(CUES)) is type(outer.on(PAPER)) is Doubled
    plain = rollout(Bare(), CUES, PAPER)
    doubled = rollout(Doubled(as_policy(Bare())), CUES, PAPER)
    np.testing.assert_allclose(doubled.action[1], 2.0 * plain.action[1])

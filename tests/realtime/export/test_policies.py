"""Washouts and agents in C equal Python: by themselves ``predict``, whole the simulator's step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import make_policy as make_baseline
from motion_cueing.baselines.interface import Machines
from motion_cueing.baselines.washout import ScheduledWashout
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import Rollout, record
from motion_cueing.realtime.export import make_source
from motion_cueing.realtime.export.check import compare

from ...envs.platform.odd_geometries import accepted_machines
from ...envs.task.tasks import EVERY_OPTION, drive
from ...train.agents import agent, recurrent
from . import compiled, needs_compiler, warnings

PAPER = get_platform("paper")
ROUNDING = 1e-12
"""Of double precision, over a drive."""
NETWORK = 1e-6
"""Networks compute in single precision, in C as in Python."""
DRIVEN = 5e-6
"""The machine integrates what their rounding differs; the largest of all drives is 2e-6."""

PAIRS = [
    ("classical", "paper", "lane-change"),
    ("classical-tuned", "24-inch", "sine-with-dwell"),
    ("est1", "nads-1", "step-steer"),
    ("brk", "dim-hexapod", "lane-change"),
    ("adaptive", "paper-no-turntable", "step-steer"),
    ("adaptive-tuned", "nads-1", "lane-change"),
    ("optimal-washout", "paper", "sine-with-dwell"),
    ("optimal-washout-tuned", "24-inch", "lane-change"),
    ("learned", "paper", "step-steer"),
    ("learned-perceived", "paper", "sine-with-dwell"),
    ("learned-preview", "paper", "lane-change"),
    ("learned-any", "nads-1", "sine-with-dwell"),
    ("learned-any", "24-inch", "lane-change"),
    ("learned-ppo", "paper", "step-steer"),
    ("learned-ppo-now", "paper", "lane-change"),
    ("linear-washout", "paper", "sine-with-dwell"),
]
"""Every family and every agent of the package, and every machine."""


def is_agent(name: str) -> bool:
    return name.startswith(("learned", "linear"))


@needs_compiler
@pytest.mark.parametrize(("name", "machine", "maneuver"), PAIRS)
def test_the_whole_step_equals_the_simulators(name, machine, maneuver, tmp_path):
    platform = get_platform(machine)
    policy = make_policy(name, platform)
    found = compare(compiled(tmp_path, policy, platform), policy, platform, get_maneuver(maneuver).drive())
    assert found.difference < (DRIVEN if is_agent(name) else ROUNDING)


@needs_compiler
@pytest.mark.parametrize(("name", "machine", "maneuver"), PAIRS[::2] + PAIRS[-3:])
def test_a_policy_by_itself_equals_predict(name, machine, maneuver, tmp_path):
    platform = get_platform(machine)
    policy = make_policy(name, platform)
    found = compare(compiled(tmp_path, policy), policy, platform, get_maneuver(maneuver).drive())
    assert found.difference < (NETWORK if is_agent(name) else ROUNDING)


@needs_compiler
@pytest.mark.parametrize("seed", range(4))
def test_odd_machines_at_their_limits(seed, tmp_path):
    rng = np.random.default_rng(seed)
    platform = accepted_machines(1, rng)[0]
    policy = make_baseline("classical", platform)
    calm = get_maneuver("lane-change").drive()
    lift = np.array([0.0, 0.0, -9.81])
    cues = CueTrace(
        "fierce", calm.time, lift + 8.0 * (calm.specific_force - lift), 5.0 * calm.angular_velocity
    )
    inputs = np.hstack([cues.specific_force, cues.angular_velocity])[:-1]
    export = compiled(tmp_path, policy, platform)
    out, _ = export.drive(inputs)
    states = record(Rollout(policy, Machines([cues], [platform])))[0].states[1:]
    setpoint, limits = states["setpoint"], states["limits"]
    assert (limits != 0).sum() > 50
    np.testing.assert_allclose(out[:, 27:33], setpoint["position"][:, 2:8], atol=1e-9)
    np.testing.assert_allclose(out[:, 2:5], setpoint["displacement"], atol=1e-9)
    # A limit that is met to the last bit may be flagged or not.
    assert (out[:, -1].astype(np.uint64) != limits).mean() < 0.02


KINDS = {
    "stack": {"observation": ObservationOptions(stack=3)},
    "jerk": {"action": ActionOptions(mode="jerk", authority=0.1)},
    "velocity": {"action": ActionOptions(mode="velocity", authority=0.1)},
    "ramp": {"action": ActionOptions(authority=0.1, repeat=4, ramp=True, frozen=("heave",))},
    "cab frame": {
        "action": ActionOptions(authority=0.1, frame="cab"),
        "observation": ObservationOptions(frame="cab", memory=(0.3, 2.0), machine=True),
    },
    "typical": {
        "action": ActionOptions(authority=0.1),
        "observation": ObservationOptions(scaling="typical", simulator_cue="model", preview=3),
    },
    "residual": {"action": ActionOptions(mode="residual", authority=0.05, repeat=2), "base": "adaptive"},
}
"""Each option that the whole step knows."""


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_environment(kind, tmp_path):
    options = dict(KINDS[kind])
    base = options.pop("base", None)
    policy = agent(TaskOptions(platform=PAPER, **options), base)
    found = compare(compiled(tmp_path, policy, PAPER), policy, PAPER, drive(samples=200))
    # A random network swings: it amplifies what rounding differs.
    assert found.difference < 1e-5


@needs_compiler
@pytest.mark.parametrize("activation", ["tanh", "relu", "elu", "silu"])
@pytest.mark.parametrize(("squash", "skip"), [("clip", True), ("tanh", False)])
def test_every_kind_of_network(activation, squash, skip, tmp_path):
    policy = agent(activation=activation, squash=squash, skip=skip)
    found = compare(compiled(tmp_path, policy), policy, PAPER, drive(samples=100))
    assert found.difference < NETWORK


@needs_compiler
@pytest.mark.parametrize("whole", [False, True])
def test_a_network_with_a_memory(whole, tmp_path):
    plain = agent(TaskOptions(action=ActionOptions(authority=0.1)))
    policy = replace(plain, network=recurrent(plain.layout.size))
    found = compare(compiled(tmp_path, policy, PAPER if whole else None), policy, PAPER, drive(samples=150))
    assert found.difference < 2e-6


@needs_compiler
@pytest.mark.parametrize(
    ("name", "bound"), [("classical", 1e-5), ("optimal-washout", 1e-5), ("learned-ppo-now", 1e-5)]
)
def test_single_precision_is_close(name, bound, tmp_path):
    policy = make_policy(name, PAPER)
    export = compiled(tmp_path, policy, PAPER, single=True)
    assert "typedef float " in export.source.header
    found = compare(export, policy, PAPER, get_maneuver("lane-change").drive())
    assert 1e-9 < found.difference < bound


@needs_compiler
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize(
    ("name", "machine"),
    [
        ("classical", "24-inch"),
        ("adaptive", "paper"),
        ("optimal-washout", "paper-hexapod-only"),
        ("learned-any", "nads-1"),
        ("learned-ppo", "paper"),
        ("linear-washout", "paper"),
    ],
)
def test_strict_compilers_have_nothing_to_say(name, machine, single, tmp_path):
    platform = get_platform(machine)
    policy = make_policy(name, platform)
    for where in (None, platform):
        source = make_source(policy, where, single=single)
        assert warnings(source, tmp_path) == ""
        assert max(map(len, source.header.splitlines())) < 160
        for word in ("malloc", "stdlib", "stdio"):
            assert word not in source.code


@needs_compiler
def test_it_begins_anew(tmp_path):
    policy = make_policy("learned-ppo-now", PAPER)
    export = compiled(tmp_path, policy, PAPER)
    cues = drive(samples=120)
    inputs = np.hstack([cues.specific_force, cues.angular_velocity])
    once, _ = export.drive(inputs)
    again, seconds = export.drive(inputs, repeats=3)
    np.testing.assert_array_equal(once, again)
    assert len(seconds) == 360


@pytest.mark.parametrize(
    ("policy", "why"),
    [
        (lambda: make_policy("mpc", PAPER), "mpc has no form in C"),
        (lambda: ScheduledWashout("classical", PAPER.cab), "its gains are chosen from outside"),
        (lambda: agent(TaskOptions(**EVERY_OPTION["perceived"])), "observation.perceived is not made in C"),
        (lambda: agent(TaskOptions(action=ActionOptions(mode="gains")), "classical"), "a washout's gains"),
    ],
)
def test_what_has_no_form_in_c_is_refused_by_name(policy, why):
    with pytest.raises(ConfigurationError, match=why):
        make_source(policy(), PAPER)

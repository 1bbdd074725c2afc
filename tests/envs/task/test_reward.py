"""Every term of the reward against its definition in plain NumPy, and the ends of episodes."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs.task import DrivingSimulator, EpisodeOptions, RewardOptions, RewardWeights
from motion_cueing.envs.task.kernels import reward as reward_page
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.evaluation.metrics import Criteria, beyond, false_cues

from .tasks import drive

REST = np.array([0.0, 0.0, -9.81])
C = Criteria()


def six(cues: np.void) -> np.ndarray:
    """Force relative to rest, and rate."""
    return np.concatenate([cues["force"] - REST, cues["rate"]])


def expected_terms(env: DrivingSimulator, action: np.ndarray, before: np.ndarray) -> dict[str, float]:
    state = env.batch.simulator.state[0]
    wanted, felt = six(state["reference_cue"]), six(state["simulator_cue"])
    sensed = six(state["perceived_simulator"]) - six(state["perceived_reference"])
    error = ((felt - wanted) / np.array(C.indifference_zone)) ** 2
    false = [false_cues(wanted[i : i + 1], felt[i : i + 1], C.thresholds[i])[0] for i in range(6)]
    extra = beyond(wanted[3:5], felt[3:5])
    position = state["motion"]["position"]
    use = np.abs(position[:8]) / np.array([13.72] * 2 + [0.67] * 6)
    active = [(int(state["limits"]) >> (4 * k)) & 15 for k in range(9)]
    return {
        "cue_error": float(error.sum()),
        "perceived_error": float(np.sum((sensed / np.array(C.indifference_zone)) ** 2)),
        "false_cues": float(error[false].sum()),
        "tilt_rate": max(math.hypot(*extra) / C.tilt_rate - 1.0, 0.0) ** 2,
        "stroke": float(np.sum(np.maximum((use - 0.8) / 0.2, 0.0) ** 2)),
        "limits": float(np.mean([flags != 0 for flags in active])),
        "action_rate": float(np.mean((action.astype(float) - before.astype(float)) ** 2)),
        "failure": 0.0,
    }


def test_terms_are_what_they_are_defined_to_be():
    weights = RewardWeights(*(0.1 * (k + 1) for k in range(len(TERMS))))
    env = DrivingSimulator(drives=[drive()], reward=RewardOptions(weights=weights))
    rng, before, seen = np.random.default_rng(1), np.zeros(9, dtype=np.float32), []
    env.reset(seed=0)
    push = rng.uniform(-0.5, 0.5, 9)
    for k in range(300):
        noise = rng.uniform(-0.3, 0.3, 9)
        action = (push * np.sin(0.02 * k) + noise).astype(np.float32)
        _, reward, _, _, info = env.step(action)
        expected = expected_terms(env, action, before)
        for name in TERMS:
            assert info[name] == pytest.approx(expected[name], rel=1e-9, abs=1e-12), name
        total = sum(getattr(weights, name) * expected[name] for name in TERMS)
        assert reward == pytest.approx(-total, rel=1e-9)
        before = action
        seen.append([info[name] for name in TERMS])
    # Every term but failure was there and was not always the same.
    assert np.all(np.ptp(np.array(seen), axis=0)[:-1] > 0.0)


def test_zero_weights_switch_terms_off():
    weights = RewardWeights(**dict.fromkeys(TERMS, 0.0))
    env = DrivingSimulator(drives=[drive()], reward=RewardOptions(weights=weights))
    env.reset(seed=0)
    for _ in range(20):
        _, reward, _, _, info = env.step(np.ones(9))
        assert reward == 0.0
        assert info["cue_error"] > 0.0


@pytest.mark.parametrize("asked", [False, True])
def test_an_end_of_travel_terminates_only_where_asked(asked):
    episode = EpisodeOptions(terminate_on_failure=asked)
    env = DrivingSimulator(drives=[drive(samples=1001)], episode=episode)
    env.reset(seed=0)
    action, ended = np.zeros(9), False
    action[0] = 1.0
    for _ in range(1000):
        _, reward, terminated, truncated, info = env.step(action)
        at_end = bool(int(env.batch.simulator.state["limits"][0]) & 1)
        assert terminated == (asked and at_end)
        assert info["failure"] == float(terminated)
        ended |= at_end
        if terminated:
            assert reward <= -RewardWeights().failure
            break
    assert ended
    assert truncated == (not asked)


def test_terms_have_weights_of_the_same_names():
    assert list(TERMS) == list(RewardWeights.__dataclass_fields__)


ANOTHER_TERM = """
import importlib.util, sys

PAGE = "motion_cueing.envs.task.kernels.reward"


class Changed:
    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_file_location(name, sys.argv[1]) if name == PAGE else None


sys.meta_path.insert(0, Changed())
import numpy as np
from motion_cueing.envs.task import DrivingSimulator, RewardWeights
from motion_cueing.envs.task.kernels.reward import TERMS, reward_table

assert TERMS[4:6] == ("height", "stroke")
assert "| `height` | 3 | Depth of the cab, m. |" in reward_table()
env = DrivingSimulator(episode={"library": 1, "drive_duration": 30.0, "terminate_on_failure": True})
env.reset(seed=0)
action, terminated = np.array([1.0, 0, 0, 0, 0.05, 0, 0, 0, 0]), False
while not terminated:
    _, reward, terminated, truncated, info = env.step(action)
    assert not truncated
    assert info["height"] == abs(env.batch.simulator.state[0]["motion"]["displacement"][2])
    weights = RewardWeights()
    assert np.isclose(reward, -sum(getattr(weights, name) * info[name] for name in TERMS))
assert info["failure"] == 1.0 and reward < -100.0 and info["stroke"] > 0.5
"""


@pytest.mark.slow
def test_another_term_takes_one_function_and_moves_no_weight(tmp_path):
    page = Path(reward_page.__file__).read_text(encoding="utf-8")
    before = "@term(weight=0.1)\n@wp.func\ndef stroke("
    assert page.count(before) == 1
    added = (
        "@term(weight=3.0)\n@wp.func\ndef height(r: RewardScale, m: Machine, s: State) -> real:\n"
        '    """Depth of the cab, m."""\n    return wp.abs(s.motion.displacement[2])\n\n\n'
    )
    (tmp_path / "reward.py").write_text(page.replace(before, added + before), encoding="utf-8")
    command = [sys.executable, "-c", ANOTHER_TERM, str(tmp_path / "reward.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr

"""The batch against a loop of single environments."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from motion_cueing.envs.errors import ActionError, ConfigurationError
from motion_cueing.envs.task import DrivingSimulator, DrivingSimulatorVector

from .tasks import EVERY_OPTION, SHORT, options

N = 3


def equal(a, b) -> bool:
    """Whether infos agree, keys, masks and values, bit for bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype == object:
        return all((x is None and y is None) or np.array_equal(x, y) for x, y in zip(a, b, strict=True))
    return np.array_equal(a, b)


def pair(mode: AutoresetMode, **arguments):
    loop = SyncVectorEnv([lambda: DrivingSimulator(**arguments)] * N, autoreset_mode=mode)
    return DrivingSimulatorVector(N, autoreset_mode=mode, **arguments), loop


MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)
# Every option with one of the modes, and both where episodes end early or begin on another machine.
CASES = {(name, MODES[k % 2]) for k, name in enumerate(EVERY_OPTION)}
CASES |= {(name, mode) for name in ("defaults", "termination", "stack", "builds") for mode in MODES}


@pytest.mark.parametrize(("name", "mode"), sorted(CASES, key=str))
def test_batch_is_a_loop_of_single_environments_bit_for_bit(name, mode):
    batch, loop = pair(mode, **options(name))
    seen, expected = batch.reset(seed=5), loop.reset(seed=5)
    assert np.array_equal(seen[0], expected[0])
    assert equal(seen[1], expected[1])
    batch.action_space.seed(6)
    ends = 0
    for _ in range(110):
        # Wilder than the box, so that something is clipped and limits are met.
        action = 1.5 * batch.action_space.sample()
        seen, expected = batch.step(action), loop.step(action)
        for got, wanted in zip(seen[:4], expected[:4], strict=True):
            assert np.array_equal(got, wanted)
        assert equal(seen[4], expected[4])
        ends += int(seen[2].sum() + seen[3].sum())
    assert ends > 0


def test_disabled_autoreset_begins_only_where_told():
    batch, loop = pair(AutoresetMode.DISABLED, episode=SHORT)
    batch.reset(seed=1)
    loop.reset(seed=1)
    mask = np.array([True, False, True])
    for k in range(39):
        action = np.full((N, 9), 0.01 * k, dtype=np.float32)
        assert np.array_equal(batch.step(action)[0], loop.step(action)[0])
        if k in (10, 25):
            seen = batch.reset(options={"reset_mask": mask})
            expected = loop.reset(options={"reset_mask": mask})
            assert np.array_equal(seen[0], expected[0])
            assert equal(seen[1], expected[1])


def test_environments_take_the_seeds_of_a_list():
    batch = DrivingSimulatorVector(N, episode=SHORT)
    observation, _ = batch.reset(seed=[9, 4, 9])
    single = DrivingSimulator(episode=SHORT)
    assert np.array_equal(observation[1], single.reset(seed=4)[0])
    assert np.array_equal(observation[0], observation[2])


def test_unseeded_environments_differ_from_each_other():
    observation, _ = DrivingSimulatorVector(N, episode=SHORT).reset()
    assert len({row.tobytes() for row in observation}) == N


def test_observations_are_copies_unless_told_otherwise():
    action = np.full((N, 9), 0.3, dtype=np.float32)
    for copy in (True, False):
        batch = DrivingSimulatorVector(N, episode=SHORT, copy=copy)
        first, _ = batch.reset(seed=0)
        kept = first.copy()
        batch.step(action)
        assert np.array_equal(first, kept) is copy


def test_wrong_arguments_are_named():
    with pytest.raises(ConfigurationError, match="at least one environment"):
        DrivingSimulatorVector(0, episode=SHORT)
    with pytest.raises(ConfigurationError, match="device is 'gpu'; use one of 'cpu'"):
        DrivingSimulatorVector(N, episode=SHORT, device="gpu")
    batch = DrivingSimulatorVector(N, episode=SHORT)
    batch.reset(seed=0)
    with pytest.raises(ActionError, match=r"shape \(2, 9\), expected \(3, 9\)"):
        batch.step(np.zeros((2, 9)))
    with pytest.raises(ConfigurationError, match="seed has 2 entries for 3 environments"):
        batch.reset(seed=[1, 2])
    with pytest.raises(ConfigurationError, match="reset_mask must be 3 booleans"):
        batch.reset(options={"reset_mask": np.zeros(3, dtype=bool)})

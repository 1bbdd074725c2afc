"""Which actuators exceed which limit, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.platform import actuator_limits, get_platform, platform_names
from motion_cueing.envs.platform.machines import limits_exceeded

TOLERANCE = 1e-6


@pytest.mark.parametrize("name", [*platform_names(), "paper-hexapod-only"])
def test_each_actuator_is_held_against_its_own_limits(name):
    limits = actuator_limits(get_platform(name))
    ends = {
        "position": [limits["position_min"], limits["position_max"]],
        "velocity": [-limits["velocity"], limits["velocity"]],
        "acceleration": [-limits["acceleration"], limits["acceleration"]],
    }
    for k, (quantity, sides) in enumerate(ends.items()):
        for side in sides:
            for actuator in np.flatnonzero(np.isfinite(side)):
                motion = np.zeros((3, 2, 9))
                slack = TOLERANCE * (sides[1] - sides[0])[actuator] * (1.0 if k == 0 else 0.5)
                # At the limit, within its tolerance, and beyond it.
                step = np.sign(side[actuator]) * slack
                for row, share in enumerate((0.0, 0.9)):
                    motion[k, row, actuator] = side[actuator] + share * step
                assert not np.any(limits_exceeded(limits, *motion, TOLERANCE))
                motion[k, 1, actuator] = side[actuator] + 1.1 * step + np.sign(step) * 1e-12
                exceeded = limits_exceeded(limits, *motion, TOLERANCE)
                beyond = np.argwhere(np.array(exceeded))
                expected = [[k, 1, actuator]] if step else []
                np.testing.assert_array_equal(beyond, np.array(expected).reshape(-1, 3))
                assert getattr(exceeded, quantity)[1, actuator] == bool(step)


def test_a_nan_exceeds_every_limit():
    limits = actuator_limits(get_platform("paper"))
    nan = np.full(9, np.nan)
    assert np.all(limits_exceeded(limits, nan, nan, nan, TOLERANCE))

"""Washouts in batches: the fused launch against single rollouts, and gradients against differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines.washout import (
    ClassicalWashout,
    HighPass,
    LowPass,
    TiltCoordination,
    WashoutParameters,
    load_washout,
)
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.evaluation import measure, rollout

from ..drives import trace

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")
DRIVES = [
    trace(8.0, lambda t: np.column_stack([0.5 * np.sin(t), 1.2 * np.sin(0.8 * t)]), name="weave"),
    trace(6.0, rate=lambda t: np.column_stack([0.0 * t, 0.0 * t, 0.2 * np.sin(t)]), name="yaw"),
]


@pytest.mark.parametrize("threads", [1, 3])
def test_scores_are_those_of_single_rollouts(threads):
    sets = [load_washout(name) for name in ("est1", "classical", "lc2")]
    scores = WashoutBatch(sets, DRIVES, PAPER).scores(threads=threads)
    for i, parameters in enumerate(sets):
        for j, drive in enumerate(DRIVES):
            metrics = measure(rollout(ClassicalWashout(parameters), drive, PAPER))
            assert scores.cue_error[i, j] == pytest.approx(metrics.cue_error, rel=1e-9)
            assert scores.perceived_error[i, j] == pytest.approx(metrics.perceived_cue_error, rel=1e-9)
            assert scores.at_limit[i, j] == 0.0


def varied(name: str, h: float) -> WashoutParameters:
    p = load_washout("est1")
    tilt = TiltCoordination(rate=1.0, acceleration=5.0)
    p = replace(p, tilt=tilt)
    changes: dict[str, Callable[[], WashoutParameters]] = {
        "tilt_frequency": lambda: replace(p, tilt=replace(tilt, low_pass=LowPass(5.0 + h))),
        "hps_y.frequency": lambda: replace(p, hps=(p.hps[0], HighPass(2, p.hps[1].frequency + h))),
        "hpi_y.frequency": lambda: replace(p, hpi=(p.hpi[0], HighPass(1, p.hpi[1].frequency + h), p.hpi[2])),
        "hpr_yaw.frequency": lambda: replace(p, hpr=(*p.hpr[:2], HighPass(1, 0.2 + h))),
        "force_scale": lambda: replace(p, force_scale=(1.0 + h, 1.0, 1.0)),
        "rate_bandwidth": lambda: replace(p, rate_bandwidth=50.0 + h),
    }
    return changes[name]()


@pytest.mark.parametrize(
    "name",
    [
        "tilt_frequency",
        "hps_y.frequency",
        "hpi_y.frequency",
        "hpr_yaw.frequency",
        "force_scale",
        "rate_bandwidth",
    ],
)
def test_gradients_of_j_in_the_parameters(name):
    steps, h = 300, 1e-5
    _, gradient = WashoutBatch([varied(name, 0.0)], DRIVES, PAPER).gradient(steps)
    found = gradient[0]
    for part in name.split("."):
        found = found[part]
    sides = [WashoutBatch([varied(name, s * h)], DRIVES, PAPER).gradient(steps)[0][0] for s in (1.0, -1.0)]
    expected = (sides[0] - sides[1]) / (2.0 * h)
    assert abs(expected) > 1e-6
    assert float(np.ravel(found)[0]) == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_a_lagging_machine_is_refused():
    lagging = replace(
        PAPER, hexapod=replace(PAPER.hexapod, dynamics=ActuatorDynamics(natural_frequency=30.0))
    )
    with pytest.raises(ConfigurationError, match="actuator dynamics"):
        WashoutBatch([load_washout("est1")], DRIVES, lagging)


@pytest.mark.parametrize("steps", [0, -1])
def test_a_gradient_over_no_step_is_refused(steps):
    batch = WashoutBatch([load_washout("est1")], DRIVES, PAPER)
    with pytest.raises(ConfigurationError, match=f"steps must be at least 1, found {steps}"):
        batch.gradient(steps)

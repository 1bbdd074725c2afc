"""One policy through one drive: the loop every figure in this project comes from."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import Policy, start_of
from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.errors import ActionError, ConfigurationError
from ..envs.observation import OBSERVATION_SIZE, observe_forward
from ..envs.perception import VestibularModel
from ..envs.platform import Platform, actuator_limits, get_platform
from ..envs.precision import real
from ..envs.settings import to_dict
from ..envs.simulator import N_AXES, TIME_STEP, Simulator
from .trajectory import LimitTable, Trajectory


class Observer:
    """Observations of a simulator's environments on the host, (n, OBSERVATION_SIZE)."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._out = wp.zeros((simulator.n, OBSERVATION_SIZE), dtype=real, device=simulator.device)

    def __call__(self) -> NDArray[Any]:
        """The observations now."""
        simulator = self._simulator
        wp.launch(
            observe_forward,
            simulator.n,
            inputs=[simulator.machines, simulator.machine_of, simulator.state_array],
            outputs=[self._out],
            device=simulator.device,
        )
        return np.array(self._out.numpy())


def rollout(
    policy: Policy,
    cues: CueTrace,
    platform: Platform | None = None,
    car: Car | None = None,
    *,
    start: ArrayLike | None = None,
    vestibular: VestibularModel | None = None,
    dt: float = TIME_STEP,
    on_step: Callable[[int, int], None] | None = None,
) -> Trajectory:
    """Drive a machine through a cue trace with a policy.

    Args:
        policy: Anything with ``predict``.
        cues: The drive; another time step is resampled.
        platform: The machine; default: the paper's.
        car: The car that was driven, for the record.
        start: (9,) pose to begin at; default: the policy's ``start``, or neutral.
        vestibular: Perception model; default: Zacharias'.
        dt: Time step, s.
        on_step: Called with the steps done and the steps in all.

    Raises:
        ActionError: the policy returned something that is not nine finite numbers and a state.
        ConfigurationError: an argument is of the wrong type, or the policy was made for another time step.
    """
    if not isinstance(cues, CueTrace):
        raise ConfigurationError(
            f"cues must be a CueTrace, found {type(cues).__name__}; get_maneuver(name).drive()"
        )
    if platform is not None and not isinstance(platform, Platform):
        raise ConfigurationError(
            f"platform must be a Platform, found {type(platform).__name__}; get_platform(name)"
        )
    if getattr(policy, "dt", dt) != dt:
        raise ConfigurationError(f"the policy's time step is {policy.dt} s, the rollout's {dt} s")  # type: ignore[attr-defined]
    platform = platform or get_platform("paper")
    cues = cues.resampled(dt)
    simulator = Simulator(platform, cues, vestibular=vestibular, dt=dt)
    states, actions, seconds = _drive(
        policy, simulator, start_of(policy) if start is None else start, on_step
    )
    return _trajectory(policy, cues, platform, car, states, actions, seconds, simulator)


def _drive(
    policy: Policy, simulator: Simulator, start: ArrayLike, on_step: Callable[[int, int], None] | None
) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.float64]]:
    n = len(simulator.drives[0])
    observe = Observer(simulator)
    states = np.zeros(n, dtype=simulator.state.dtype)
    actions, seconds = np.zeros((n, N_AXES)), np.full(n, np.nan)
    states[0] = simulator.reset(start)[0]
    memory, begins = None, np.ones(1, dtype=bool)
    for k in range(1, n):
        observation = observe()
        began = time.perf_counter()
        answer = policy.predict(observation, memory, begins, deterministic=True)
        seconds[k] = time.perf_counter() - began
        action, memory = _pair(answer, k)
        begins = np.zeros(1, dtype=bool)
        actions[k] = _one(action, k)
        states[k] = simulator.step(actions[k])[0]
        if on_step is not None:
            on_step(k, n - 1)
    return states, actions, seconds


def _pair(answer: Any, k: int) -> tuple[Any, Any]:
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise ActionError(
            f"predict must return (action, state); at step {k} it returned {type(answer).__name__}"
        )
    return answer


def _one(action: Any, k: int) -> NDArray[np.float64]:
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ActionError(f"the policy's action at step {k} is not made of numbers") from None
    if values.shape not in ((1, N_AXES), (N_AXES,)):
        raise ActionError(f"the policy's action at step {k} has shape {values.shape}, expected (1, {N_AXES})")
    return values.reshape(N_AXES)


def _trajectory(
    policy: Policy,
    cues: CueTrace,
    platform: Platform,
    car: Car | None,
    states: NDArray[Any],
    actions: NDArray[np.float64],
    seconds: NDArray[np.float64],
    simulator: Simulator,
) -> Trajectory:
    motion, felt, wanted = states["motion"], states["felt"], states["wanted"]
    shifts = np.arange(0, 36, 4, dtype=np.uint64)
    limits = actuator_limits(platform)
    parameters = getattr(policy, "parameters", None)
    return Trajectory(
        maneuver=cues.name,
        policy=str(getattr(policy, "name", type(policy).__name__)),
        platform=platform.name,
        car=car.name if car else cues.source or cues.name,
        time=cues.time,
        f_wanted=wanted["force"],
        w_wanted=wanted["rate"],
        head_f_wanted=wanted["head_force"],
        f_felt=felt["force"],
        w_felt=felt["rate"],
        head_f_felt=felt["head_force"],
        sensed_f_wanted=states["sensed_wanted"]["force"],
        sensed_w_wanted=states["sensed_wanted"]["rate"],
        sensed_f_felt=states["sensed_felt"]["force"],
        sensed_w_felt=states["sensed_felt"]["rate"],
        carriage=motion["position"][:, :2],
        carriage_rate=motion["rate"][:, :2],
        hexapod=np.hstack([motion["displacement"], motion["beta"]]),
        hexapod_rate=np.hstack([motion["velocity"], motion["beta_rate"]]),
        turntable=motion["position"][:, 8],
        turntable_rate=motion["rate"][:, 8],
        legs=motion["position"][:, 2:8],
        legs_rate=motion["rate"][:, 2:8],
        action=actions,
        applied=states["acceleration"],
        limits_active=((states["limits"][:, None] >> shifts) & np.uint64(0xF)).astype(np.uint8),
        step_time=seconds,
        limits=LimitTable(**limits),
        metadata={
            "parameters": json.dumps(to_dict(parameters)) if parameters is not None else "{}",
            "vestibular": simulator.vestibular.name,
            "source": cues.source,
        },
    )

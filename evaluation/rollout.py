"""A policy through drives: the one loop every figure of this project comes from.

:func:`rollout` takes one policy through one drive and returns the trajectory. :class:`Rollout` is the loop
under it, for n drives at once: evaluation, endurance, studies, frequency responses and demonstrations run it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.interface import Machines
from ..baselines.policy import OneEach, Policy, as_policy
from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.errors import ActionError, ConfigurationError, MotionCueingError, PolicyError, place, summary
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform, actuator_limits, get_platform
from ..envs.platform.kernels.step import HELD
from ..envs.settings import to_dict
from ..envs.simulator.simulator import N_AXES, TIME_STEP
from .trajectory import LimitTable, Trajectory

Floats = NDArray[np.float64]

_ABOUT: Final = ("parameters", "vestibular", "source", "scale")
"""Metadata of every trajectory; the rest a policy counted."""


class Actor:
    """A policy with its state between calls.

    Args:
        policy: The policy.
        n: Machines it acts on.
        size: Entries of an action.
        finite: Whether entries that are no finite numbers are counted and made 0.

    Attributes:
        not_finite: (n,) actions so far with such an entry.
    """

    def __init__(self, policy: Policy, n: int, size: int, finite: bool = False) -> None:
        self._policy, self._shape, self._finite = policy, (n, size), finite
        self._state: Any = None
        self._calls = 0
        self.not_finite = np.zeros(n, dtype=np.int64)

    def __call__(self, observation: NDArray[Any]) -> tuple[Floats, float]:
        """The (n, size) actions and the seconds they took.

        Raises:
            ActionError: the policy returned something else than numbers of this shape and a state.
            PolicyError: the policy raised an error of its own.
        """
        begins = np.full(self._shape[0], self._calls == 0)
        self._calls += 1
        began = time.perf_counter()
        try:
            answer: Any = self._policy.predict(observation, self._state, begins, deterministic=True)
        except MotionCueingError:
            raise
        except Exception as error:  # It is a user's code.
            raise PolicyError(
                f"{self._policy.name} raised {summary(error)} at step {self._calls} ({place(error)})"
            ) from error
        seconds = time.perf_counter() - began
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise ActionError(
                f"predict must return (action, state); at step {self._calls} it returned "
                f"{type(answer).__name__}"
            )
        action, self._state = self._numbers(answer[0]), answer[1]
        known = np.isfinite(action)
        if not known.all():
            if not self._finite:
                machine, entry = np.argwhere(~known)[0]
                raise ActionError(
                    f"the action of {self._policy.name} at step {self._calls} is not finite: "
                    f"entry {entry} is {action[machine, entry]}"
                )
            self.not_finite += ~known.all(axis=1)
            action = np.where(known, action, 0.0)
        return action, seconds

    def _numbers(self, action: Any) -> Floats:
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise ActionError(f"the policy's action at step {self._calls} is not made of numbers") from None
        n, size = self._shape
        if values.shape != self._shape and not (n == 1 and values.shape == (size,)):
            raise ActionError(
                f"the policy's action at step {self._calls} has shape {values.shape}, expected ({n}, {size})"
            )
        return values.reshape(self._shape)


class Rollout:
    """A policy in n drives at once, each on its machine: at rest at the first sample, then step by step.

    Args:
        policy: A policy, or what :func:`~motion_cueing.baselines.as_policy` takes.
        machines: The drives and their machines; the policy is not checked to be made for them.
        start: (9,) pose to begin at; default: the policy's start pose.
        finite: Whether actions that are no finite numbers are counted and made 0, instead of refused.

    Attributes:
        policy: That acts: one that needs its drive is given it.
        interface: How it sees and moves the machines.
        observation: (n, size) the last one it saw.

    Raises:
        ConfigurationError: the policy was made for another time step or vestibular model.
    """

    def __init__(
        self, policy: Any, machines: Machines, start: ArrayLike | None = None, finite: bool = False
    ) -> None:
        acting = as_policy(policy)
        if acting.time_step not in (None, machines.time_step):
            raise ConfigurationError(
                f"the policy's time step is {acting.time_step} s, the rollout's {machines.time_step} s"
            )
        if acting.needs_drive:
            each = [acting.for_drive(drive) for drive in machines.drives]
            acting = each[0] if len(each) == 1 else OneEach(each)
        self.policy = acting
        self.interface = self.policy.connect(machines)
        self.simulator = self.interface.simulator
        self._actor = Actor(self.policy, self.simulator.n, self.interface.action_size, finite)
        self.samples = max(len(drive) for drive in machines.drives)
        self.interface.begin(self.policy.start_pose if start is None else start)
        self.observation: NDArray[Any] = np.zeros(0)

    @property
    def not_finite(self) -> NDArray[np.int64]:
        """(n,) actions so far with an entry that was no finite number."""
        return self._actor.not_finite

    @property
    def requested(self) -> Floats:
        """(n, 9) accelerations requested of the axes in the last time step, m/s^2 and rad/s^2."""
        return self.interface.requested

    def steps(self) -> Iterator[float]:
        """Time step after time step to the end of the longest drive.

        Yields:
            Wall-clock seconds the policy took; NaN where it held its last action.
        """
        left = self.samples - 1
        while left:
            self.observation = self.interface.observe()
            action, seconds = self._actor(self.observation)
            for _ in islice(self.interface.act(action), left):
                left -= 1
                yield seconds
                seconds = np.nan


@dataclass(frozen=True)
class Recording:
    """One drive; row k is the machine at sample k, row 0 the start.

    Args:
        states: (n,) rows of ``Simulator.state``.
        actions: (n, 9) accelerations requested in the step that ended at a row.
        seconds: (n,) wall-clock time of the policy; NaN where it held its last action.
    """

    states: NDArray[Any]
    actions: Floats
    seconds: Floats


def record(run: Rollout, on_step: Callable[[int, int], None] | None = None) -> Recording:
    """Drive the only drive of a rollout to its end.

    Args:
        run: At its first sample.
        on_step: Called with the steps done and the steps in all.
    """
    n = run.samples
    states = np.zeros(n, dtype=run.simulator.state.dtype)
    actions, seconds = np.zeros((n, N_AXES)), np.full(n, np.nan)
    states[0] = run.simulator.state[0]
    for k, taken in enumerate(run.steps(), start=1):
        actions[k], states[k], seconds[k] = run.requested[0], run.simulator.state[0], taken
        if on_step is not None:
            on_step(k, n - 1)
    return Recording(states, actions, seconds)


def trajectory_of(recording: Recording, run: Rollout, car: Car | None = None) -> Trajectory:
    """The trajectory of a recorded drive."""
    states, platform, policy = recording.states, run.simulator.platforms[0], run.policy
    cues = run.simulator.drives[0]
    motion, simulated, reference = states["motion"], states["simulator_cue"], states["reference_cue"]
    shifts = np.arange(0, 36, 4, dtype=np.uint64)
    return Trajectory(
        maneuver=cues.name,
        policy=policy.name,
        platform=platform.name,
        car=car.name if car else cues.source or cues.name,
        time=cues.time,
        f_reference=reference["force"],
        w_reference=reference["rate"],
        head_f_reference=reference["head_force"],
        f_simulator=simulated["force"],
        w_simulator=simulated["rate"],
        head_f_simulator=simulated["head_force"],
        perceived_f_reference=states["perceived_reference"]["force"],
        perceived_w_reference=states["perceived_reference"]["rate"],
        perceived_f_simulator=states["perceived_simulator"]["force"],
        perceived_w_simulator=states["perceived_simulator"]["rate"],
        carriage=motion["position"][:, :2],
        carriage_rate=motion["rate"][:, :2],
        hexapod=np.hstack([motion["displacement"], motion["beta"]]),
        hexapod_rate=np.hstack([motion["velocity"], motion["beta_rate"]]),
        turntable=motion["position"][:, 8],
        turntable_rate=motion["rate"][:, 8],
        legs=motion["position"][:, 2:8],
        legs_rate=motion["rate"][:, 2:8],
        action=recording.actions,
        applied=states["acceleration"],
        limits_active=((states["limits"][:, None] >> shifts) & np.uint64(0xF)).astype(np.uint8),
        step_time=recording.seconds,
        limits=LimitTable(**actuator_limits(platform)),
        metadata={
            "parameters": json.dumps({} if policy.parameters is None else to_dict(policy.parameters)),
            "vestibular": run.simulator.vestibular.name,
            "source": cues.source,
            **({} if cues.scale.neutral else {"scale": str(cues.scale)}),
            **policy.statistics,
            **emergency_stops(states["limits"]),
        },
    )


def emergency_stops(limits: NDArray[np.uint64]) -> dict[str, str]:
    """The number of steps (n,) in which the pose was held, where there are any; counted with the policy's."""
    count = int(np.count_nonzero(limits & np.uint64(HELD)))
    return {"emergency stops of the hexapod": str(count)} if count else {}


def statistics_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """What a policy counted in a drive, such as solves that did not converge, by the drive's metadata."""
    return {name: text for name, text in metadata.items() if name not in _ABOUT}


def begin_rollout(
    policy: Any,
    cues: CueTrace,
    platform: Platform | None = None,
    *,
    start: ArrayLike | None = None,
    vestibular: VestibularModel | None = None,
    time_step: float = TIME_STEP,
) -> Rollout:
    """A rollout of one drive, at its first sample; arguments as of :func:`rollout`."""
    policy = as_policy(policy)
    if not isinstance(cues, CueTrace):
        raise ConfigurationError(
            f"cues must be a CueTrace, found {type(cues).__name__}; get_maneuver(name).drive()"
        )
    if platform is None:
        platform = policy.platform or get_platform("paper")
    if not isinstance(platform, Platform):
        raise ConfigurationError(
            f"platform must be a Platform, found {type(platform).__name__}; get_platform(name)"
        )
    vestibular = vestibular or get_vestibular_model("zacharias")
    machines = Machines([cues.resampled(time_step)], [platform], None, vestibular, time_step)
    return Rollout(policy.for_platform(platform), machines, start)


def rollout(
    policy: Any,
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
        policy: A :class:`~motion_cueing.baselines.Policy`, or any object with ``predict``.
        cues: The drive; another time step is resampled.
        platform: The machine; default: the one the policy was made for, or the paper's.
        car: The car that was driven, for the record.
        start: (9,) pose to begin at; default: the policy's start pose.
        vestibular: Perception model; default: Zacharias'.
        dt: Time step, s.
        on_step: Called with the steps done and the steps in all.

    Raises:
        ActionError: the policy returned something else than as many finite numbers as expected and a state.
        PolicyError: the policy raised an error of its own.
        ConfigurationError: an argument is of the wrong type, or the policy was made for another time step,
            machine or perception model.
    """
    run = begin_rollout(policy, cues, platform, start=start, vestibular=vestibular, time_step=dt)
    return trajectory_of(record(run, on_step), run, car)

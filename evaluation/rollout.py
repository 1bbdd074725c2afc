"""A policy through drives: the one loop every figure of this project comes from.

:func:`rollout` takes one policy through one drive and returns the trajectory. :class:`Rollout` is the loop
under it, for n drives at once: evaluation, endurance, studies, frequency responses and demonstrations run it.
"""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.interface import Machines
from ..baselines.policy import Policy, as_policy
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


_SIDE_BY_SIDE: Final = 16
"""Drives of a batch; more are hardly faster."""
_MOST_ROWS: Final = 200_000
"""Time steps of all drives of a batch: a quarter of a gigabyte."""


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
        alone: Whether the policy is called for each drive by itself, until that drive ends, as in a rollout
            of one drive: the numbers are the same to the last digit, and so is the time of a step. Else one
            call answers for all drives, which is faster, and sums of a network may be rounded differently.

    Attributes:
        policies: That act: one for each drive, or one for all. One that needs its drive is given it.
        interface: How it sees and moves the machines.
        observation: (n, size) the last one it saw.

    Raises:
        ConfigurationError: the policy was made for another time step or vestibular model.
    """

    def __init__(
        self,
        policy: Any,
        machines: Machines,
        start: ArrayLike | None = None,
        finite: bool = False,
        alone: bool = False,
    ) -> None:
        acting = as_policy(policy)
        if acting.time_step not in (None, machines.time_step):
            raise ConfigurationError(
                f"the policy's time step is {acting.time_step} s, the rollout's {machines.time_step} s"
            )
        drives = machines.drives
        if acting.needs_drive:
            of = np.zeros(len(drives), dtype=int) if machines.platform_of is None else machines.platform_of
            pairs = zip(drives, np.asarray(of), strict=True)
            self.policies = [acting.on(machines.platforms[k]).for_drive(drive) for drive, k in pairs]
        elif alone:
            # A copy each: what a policy counts belongs to its drive.
            self.policies = [copy.copy(acting) for _ in drives]
        else:
            self.policies = [acting]
        self.interface = self.policies[0].connect(machines)
        self.simulator = self.interface.simulator
        each = self.simulator.n // len(self.policies)
        self._actors = [Actor(one, each, self.interface.action_size, finite) for one in self.policies]
        self._lengths = [len(drive) for drive in drives]
        self.samples = max(self._lengths)
        if start is None:
            poses = [one.start_pose for one in self.policies]
            start = poses[0] if len(poses) == 1 else np.array(poses)
        self.interface.begin(start)
        self.observation: NDArray[Any] = np.zeros(0)

    @property
    def policy(self) -> Policy:
        """The policy of the first drive."""
        return self.policies[0]

    @property
    def not_finite(self) -> NDArray[np.int64]:
        """(n,) actions so far with an entry that was no finite number."""
        return np.concatenate([actor.not_finite for actor in self._actors])

    @property
    def requested(self) -> Floats:
        """(n, 9) accelerations requested of the axes in the last time step, m/s^2 and rad/s^2."""
        return self.interface.requested

    def steps(self) -> Iterator[Floats]:
        """Time step after time step to the end of the longest drive.

        Yields:
            (n,) wall-clock seconds the policy took; NaN where it held its last action, or the drive is over.
        """
        left = self.samples - 1
        while left:
            self.observation = self.interface.observe()
            action, seconds = self._decide(self.samples - left)
            for _ in islice(self.interface.act(action), left):
                left -= 1
                yield seconds
                seconds = np.full(self.simulator.n, np.nan)

    def _decide(self, sample: int) -> tuple[Floats, Floats]:
        """The actions (n, size) that lead to a sample of the drives, and the seconds (n,) they took."""
        if len(self._actors) == 1:
            action, took = self._actors[0](self.observation)
            return action, np.full(self.simulator.n, took)
        actions = np.zeros((self.simulator.n, self.interface.action_size))
        seconds = np.full(self.simulator.n, np.nan)
        for i, (actor, length) in enumerate(zip(self._actors, self._lengths, strict=True)):
            if sample < length:
                actions[i : i + 1], seconds[i] = actor(self.observation[i : i + 1])
        return actions, seconds


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


def record(run: Rollout, on_step: Callable[[int, int], None] | None = None) -> list[Recording]:
    """Drive the drives of a rollout to their ends.

    Args:
        run: At its first sample.
        on_step: Called with the steps done and the steps in all.
    """
    kind, n, samples = run.simulator.state.dtype, run.simulator.n, run.samples
    # As bytes, which NumPy copies at once; structures it copies field by field.
    states = np.zeros((samples, n, kind.itemsize), dtype=np.uint8)
    actions, seconds = np.zeros((samples, n, N_AXES)), np.full((samples, n), np.nan)

    def note(k: int) -> None:
        states[k] = run.simulator.state.view(np.uint8).reshape(n, kind.itemsize)

    note(0)
    for k, taken in enumerate(run.steps(), start=1):
        actions[k], seconds[k] = run.requested, taken
        note(k)
        if on_step is not None:
            on_step(k, samples - 1)
    return [
        Recording(
            np.ascontiguousarray(states[:length, i]).view(kind)[:, 0],
            actions[:length, i],
            seconds[:length, i],
        )
        for i, length in enumerate(map(len, run.simulator.drives))
    ]


def trajectory_of(recording: Recording, run: Rollout, car: Car | None = None, drive: int = 0) -> Trajectory:
    """The trajectory of a recorded drive.

    Args:
        recording: Of it.
        run: That was recorded.
        car: The car that was driven, for the record.
        drive: Its number in the rollout.
    """
    states, platform = recording.states, run.simulator.platforms[run.simulator.platform_of[drive]]
    policy, cues = run.policies[drive % len(run.policies)], run.simulator.drives[drive]
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
    return trajectory_of(record(run, on_step)[0], run, car)


def rollouts(
    policy: Any,
    drives: Sequence[CueTrace],
    platform: Platform,
    car: Car | None = None,
    *,
    vestibular: VestibularModel | None = None,
) -> Iterator[Trajectory]:
    """Take a policy through drives side by side; each trajectory equals that of :func:`rollout`, bit by bit.

    It takes a third of the time of one rollout after the other. The states of all drives are in memory, some
    1.2 kB a time step: see :func:`batches`.

    Args:
        policy: As of :func:`rollout`.
        drives: Another time step than 10 ms is resampled.
        platform: The machine.
        car: The car that was driven, for the record.
        vestibular: Perception model; default: Zacharias'.

    Yields:
        The trajectory of each drive, in their order.

    Raises:
        MotionCueingError: as :func:`rollout`; then no drive of them has a trajectory.
    """
    fitted = as_policy(policy).for_platform(platform)
    cues = [drive.resampled(TIME_STEP) for drive in drives]
    vestibular = vestibular or get_vestibular_model("zacharias")
    run = Rollout(fitted, Machines(cues, [platform], None, vestibular), alone=True)
    for i, recording in enumerate(record(run)):
        yield trajectory_of(recording, run, car, i)


def batches(policy: Policy, drives: Mapping[str, CueTrace]) -> list[list[str]]:
    """Names of drives that a policy is best driven through side by side, those of similar length together.

    A policy that must know the drive, or that may keep something in itself, has each drive alone.

    Args:
        policy: It.
        drives: By name.
    """
    largest = _SIDE_BY_SIDE if policy.side_by_side and not policy.needs_drive else 1
    names = sorted(drives, key=lambda name: -drives[name].duration)
    groups: list[list[str]] = []
    for name in names:
        # The first of a group is its longest.
        rows = (len(groups[-1]) + 1) * drives[groups[-1][0]].duration / TIME_STEP if groups else np.inf
        if rows <= _MOST_ROWS and len(groups[-1]) < largest:
            groups[-1].append(name)
        else:
            groups.append([name])
    return groups

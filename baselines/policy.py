"""The interface of a controller: subclass :class:`Policy`, write ``predict``, and every command can drive it.

A policy sees the machine in every time step of 10 ms, and answers with accelerations of its nine axes::

    import numpy as np
    from motion_cueing.baselines import Policy, register
    from motion_cueing.envs.simulator.kernels.observation import read

    class Damper(Policy):
        name = "damper"

        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            action = np.zeros((len(observation), 9))
            action[:, :2] = -0.5 * read(observation, "carriage_rate")  # (n, 2) m/s -> m/s^2
            return action, state

    register("damper", lambda platform: Damper(), "brings the carriage to rest")

``motion_cueing.envs.simulator.kernels.observation`` lists the rows of an observation. The machine's limiter
holds back whatever its actuators cannot do. A policy with a memory returns it as the state, and gets it back
in the next call. It keeps nothing in itself, since one policy may drive many machines side by side.

Everything but ``predict`` has a default:

- ``name``, ``parameters`` and ``statistics`` are for tables and records.
- ``start_pose`` is the pose a drive begins at, and ``time_step`` the only one the policy can run with.
- ``for_drive`` gives it the drive beforehand, as predictive control with preview needs.
- ``for_platform`` refuses a machine it was not made for.
- ``connect`` decides what it sees and what its actions mean. A :class:`TaskPolicy`, such as an agent, sees
  the observations of the Gymnasium environment and answers in [-1, 1].

An object that has ``predict`` alone need not inherit: every function that takes a policy calls
:func:`as_policy`, which adapts it. A model of Stable-Baselines3 is ``as_policy(model, task)``, with the
``TaskOptions`` of the environment it was trained in.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..envs.arrays import FLOAT
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, DataError
from ..envs.platform.machines import Platform
from ..envs.simulator.kernels.observation import OBSERVATION_SIZE
from ..envs.simulator.simulator import N_AXES, TIME_STEP
from ..envs.task.episode import platform_of
from ..envs.task.options import TaskOptions
from .interface import Interface, MachineInterface, Machines, TaskInterface

Array = NDArray[Any]
Starts: TypeAlias = "NDArray[Any] | None"
"""(n,) whether each machine begins a drive; None in mid-drive."""


@dataclass(frozen=True)
class Information:
    """What a policy knows of the drive.

    Args:
        kind: "now": the cues up to now. "controls": also the driver's steering wheel and pedals, which move
            before the car does. "road": also the road ahead. "preview": also the true cues of the next
            ``seconds``. "drive": all of it.
        seconds: Length of the preview, s.
    """

    kind: Literal["now", "controls", "road", "preview", "drive"] = "now"
    seconds: float = 0.0

    @property
    def label(self) -> str:
        """In tables: ``now``, ``controls``, ``road``, ``2 s true`` or ``whole drive``."""
        names = {"preview": f"{self.seconds:g} s true", "drive": "whole drive"}
        return names.get(self.kind, self.kind)

    @classmethod
    def ahead(cls, seconds: float) -> Information:
        """A preview of some seconds; "now" for none."""
        return cls("preview", seconds) if seconds > 0.0 else cls()


NOW: Final = Information()
WHOLE_DRIVE: Final = Information("drive")


class Policy:
    """A controller of the motion base.

    Attributes:
        name: In tables and file names.
        parameters: Its configuration, a dataclass or a mapping, for the record; None for none.
        time_step: Of its calls, s; None for any.
        information: What it knows of the drive.
        platform: The machine it was made for; None for any.
        task: The environment whose observations it sees; None where it sees the simulator's rows.
        side_by_side: Whether it may be called for several drives in turn: it keeps nothing in itself.
    """

    name: str = ""
    parameters: Any = None
    time_step: float | None = None
    information: Information = NOW
    platform: Platform | None = None
    task: TaskOptions | None = None
    side_by_side: bool = True

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        if not cls.name:
            cls.name = cls.__name__

    @property
    def start_pose(self) -> Array:
        """(9,) pose the machine begins a drive at, m and rad from neutral."""
        return np.zeros(N_AXES)

    @property
    def statistics(self) -> Mapping[str, str]:
        """What it counted in the drive, such as solves without a solution; kept with the trajectory."""
        return {}

    @property
    def needs_drive(self) -> bool:
        """Whether :meth:`for_drive` must come before ``predict``; such a policy cannot run in real time."""
        return type(self).for_drive is not Policy.for_drive

    def for_drive(self, cues: CueTrace) -> Policy:
        """The policy for one drive, at the time step of the rollout; it begins at the first sample."""
        return self

    def for_platform(self, platform: Platform) -> Policy:
        """The same policy for a machine; most run on any, or are made for one by their factory.

        Raises:
            ConfigurationError: it was made for another machine.
        """
        return self

    def on(self, platform: Platform) -> Policy:
        """The same policy on a machine that it may not have been made for: no fair test of it."""
        return self

    def connect(self, machines: Machines) -> Interface:
        """A batch of machines as this policy sees and moves it."""
        return MachineInterface(machines)

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, Any]:
        """Actions for observations, in the convention of Stable-Baselines3.

        Args:
            observation: (n, OBSERVATION_SIZE) or (OBSERVATION_SIZE,), see
                ``envs.simulator.kernels.observation``.
            state: What the last call returned; None at first.
            episode_start: (n,) whether each machine begins a drive.
            deterministic: No effect on a policy without randomness.

        Returns:
            Accelerations (n, 9) or (9,) in the order of ``AXES``, m/s^2 and rad/s^2, and the next state.
        """
        if self.needs_drive:
            raise ConfigurationError(
                f"{self.name} must know the drive before it begins; call for_drive first"
            )
        raise NotImplementedError(f"{type(self).__name__} has no predict")


class NoMotion(Policy):
    """The machine stands still: the zero every other policy is measured from."""

    name = "no-motion"

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, Any]:
        """Nine zeros."""
        return np.zeros((*np.shape(observation)[:-1], N_AXES)), state


class TaskPolicy(Policy):
    """A policy of the Gymnasium environment: sees its observations, and answers with actions in [-1, 1].

    Attributes:
        task: The environment.
        base_policy: What acts under it in the action modes "residual" and "gains", or None.
    """

    task: TaskOptions
    base_policy: Any = None
    time_step = TIME_STEP

    @property
    def platform(self) -> Platform:  # type: ignore[override]
        """The machine of its environment."""
        return platform_of(self.task)

    @property
    def information(self) -> Information:  # type: ignore[override]
        """The preview, the road or the controls in its observation."""
        options = self.task.observation
        if options.knows and not options.preview:
            return Information("road" if options.road else "controls")
        stride = max(1, round(options.preview_spacing / TIME_STEP))
        return Information.ahead(options.preview * stride * TIME_STEP)

    def for_platform(self, platform: Platform) -> Policy:
        """The same policy for a machine: one whose observation describes the machine runs on any.

        Raises:
            ConfigurationError: it was made for another machine.
        """
        if self.task.observation.machine:
            return self.on(platform)
        own = self.platform
        # A machine that brakes more gently for its limits is the same one while it meets none.
        if platform.braking != own.braking and replace(own, braking=platform.braking) == platform:
            return self.on(platform)
        if own != platform:
            raise ConfigurationError(
                f"{self.name} was made for the motion base {own.name!r}, not {platform.name!r}; take "
                "an agent that observes its machine, such as 'learned-any', evaluate this one on "
                f"{own.name!r}, or force it, in Python: policy.on(get_platform({platform.name!r}))"
            )
        return self

    def on(self, platform: Platform) -> Policy:
        """The same policy in the same environment of another machine."""
        moved = copy.copy(self)
        moved.task = replace(self.task, platform=platform)
        return moved

    def connect(self, machines: Machines) -> Interface:
        """The machines with the environment's observations and actions, without its randomness.

        Raises:
            ConfigurationError: it senses with another vestibular model than the machines' drivers.
        """
        return TaskInterface(machines, self.task, self.base_policy)


class Wrapper(Policy):
    """A policy that stands before another one, and is what that one is in all that it does not override."""

    def __init__(self, policy: Policy) -> None:
        self.inner = policy
        self.name, self.parameters, self.time_step = policy.name, policy.parameters, policy.time_step
        self.information, self.platform, self.task = policy.information, policy.platform, policy.task
        self.side_by_side = policy.side_by_side

    @property
    def start_pose(self) -> Array:
        """Start pose of the other one."""
        return self.inner.start_pose

    @property
    def statistics(self) -> Mapping[str, str]:
        """What the other one counted."""
        return self.inner.statistics

    @property
    def needs_drive(self) -> bool:
        """Whether the other one must know the drive."""
        return self.inner.needs_drive

    def around(self, policy: Policy) -> Policy:
        """The same wrapper before another policy."""
        moved = copy.copy(self)
        Wrapper.__init__(moved, policy)
        return moved

    def for_drive(self, cues: CueTrace) -> Policy:
        """The wrapper before the other one's policy for a drive."""
        return self.around(self.inner.for_drive(cues))

    def for_platform(self, platform: Platform) -> Policy:
        """The wrapper before the other one for a machine."""
        return self.around(self.inner.for_platform(platform))

    def on(self, platform: Platform) -> Policy:
        """The wrapper before the other one on a machine."""
        return self.around(self.inner.on(platform))

    def connect(self, machines: Machines) -> Interface:
        """The other one's interface."""
        return self.inner.connect(machines)

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, Any]:
        """The other one's answer."""
        return self.inner.predict(observation, state, episode_start, deterministic)


# Objects that are no Policy: the one place where their attributes are looked for.

_EARLIER: Final = {"time_step": "dt", "start_pose": "start", "statistics": "notes"}
"""Attributes by what they were called before."""


class _Adapter:
    """What an object has of a policy, by attribute; the rest has the defaults of :class:`Policy`."""

    def __init__(self, given: Any) -> None:
        self._given = given
        self.name = str(self._own("name", type(given).__name__))
        parameters = self._own("parameters", None)
        # Modules of PyTorch have a method of this name.
        self.parameters = None if callable(parameters) else parameters
        self._for_drive: Callable[[CueTrace], Any] | None = getattr(given, "for_drive", None)
        # It promised nothing, unless it says so.
        self.side_by_side = bool(self._own("side_by_side", False))

    def _own(self, name: str, default: Any) -> Any:
        return getattr(self._given, name, getattr(self._given, _EARLIER.get(name, name), default))

    @property
    def start_pose(self) -> Array:
        return np.asarray(self._own("start_pose", np.zeros(N_AXES)), dtype=np.float64)

    @property
    def statistics(self) -> Mapping[str, str]:
        return dict(self._own("statistics", {}))

    @property
    def needs_drive(self) -> bool:
        return self._for_drive is not None

    def for_drive(self, cues: CueTrace) -> Any:
        return self if self._for_drive is None else as_policy(self._for_drive(cues))

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, Any]:
        return self._given.predict(  # type: ignore[no-any-return]
            observation, state, episode_start, deterministic=deterministic
        )


class _AdaptedPolicy(_Adapter, Policy):
    """An object that sees the machine."""

    def __init__(self, given: Any) -> None:
        super().__init__(given)
        self.time_step = self._own("time_step", None)
        self.information = self._own("information", WHOLE_DRIVE if self.needs_drive else NOW)


class _AdaptedTaskPolicy(_Adapter, TaskPolicy):
    """An object that sees the environment of its ``task``."""

    def __init__(self, given: Any, task: TaskOptions, base_policy: Any) -> None:
        super().__init__(given)
        self.task, self.base_policy = task, base_policy


def as_policy(policy: Any, task: TaskOptions | None = None, base_policy: Any = None) -> Policy:
    """Whatever acts as a policy, as a :class:`Policy`: itself, or an adapter around it.

    Args:
        policy: A policy, or any object with ``predict``, or with ``for_drive`` that returns one. Other
            attributes of :class:`Policy` are taken where it has them.
        task: The environment it was trained in, for a model of Stable-Baselines3 and the like; default: its
            own attribute ``task``. Without one it sees the simulator's rows and answers with accelerations.
        base_policy: What acts under it, where the environment needs that; default: its own attribute.

    Raises:
        ConfigurationError: it has no ``predict``.
    """
    if isinstance(policy, Policy):
        return policy
    if isinstance(policy, type) or not any(
        callable(getattr(policy, name, None)) for name in ("predict", "for_drive")
    ):
        if isinstance(policy, str):
            what = repr(policy)
        else:
            what = f"the class {policy.__name__}" if isinstance(policy, type) else type(policy).__name__
        raise ConfigurationError(
            f"{what} is no policy: it has no method predict(observation, state, episode_start, "
            "deterministic); give an object with one, or make_policy(name, platform)"
        )
    task = getattr(policy, "task", None) if task is None else task
    if task is None:
        return _AdaptedPolicy(policy)
    own = getattr(policy, "base_policy", None) if base_policy is None else base_policy
    return _AdaptedTaskPolicy(policy, task, own)


# Checks of what a policy is given, for the policies of this package.


def checked_observation(observation: Any) -> Array:
    """Observations as the kernels' numbers.

    Raises:
        DataError: they are not (n, OBSERVATION_SIZE) or (OBSERVATION_SIZE,) finite numbers.
    """
    try:
        values = np.asarray(observation, dtype=FLOAT)
    except (TypeError, ValueError):
        raise DataError(
            f"observation is not numeric; give an array of (n, {OBSERVATION_SIZE}) numbers"
        ) from None
    if values.ndim not in (1, 2) or values.shape[-1] != OBSERVATION_SIZE or not len(values):
        raise DataError(f"observation has shape {values.shape}, expected (n, {OBSERVATION_SIZE})")
    if not np.isfinite(values).all():
        raise DataError("observation is not finite")
    return values


def checked_episode_start(episode_start: Any, n: int) -> NDArray[np.bool_]:
    """(n,) flags of n environments.

    Raises:
        DataError: they are something else.
    """
    flags = np.asarray(episode_start)
    if flags.dtype != np.bool_ or flags.shape != (n,):
        raise DataError(
            f"episode_start is {_kind_of(flags)}; give {n} booleans, one an observation, "
            "or None in mid-episode"
        )
    return flags


def wrong_state(state: Any, n: int) -> DataError:
    """The error for a ``state`` that is not what a policy returned."""
    return DataError(
        f"state is {_kind_of(state)}; give what the last call for these {n} observations returned, "
        "or None to begin"
    )


def _kind_of(values: Any) -> str:
    """What something is, for messages."""
    if not isinstance(values, np.ndarray):
        return f"of type {type(values).__name__}"
    held = "washout memory" if values.dtype.names else str(values.dtype)
    return f"an array of {held} of shape {values.shape}"

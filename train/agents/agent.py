"""Agents: trained policies with everything an evaluation needs, in one file each.

An agent is a :class:`~motion_cueing.baselines.policy.TaskPolicy`: it sees the observations of the environment
it was trained in, and acts there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...baselines.mpc.parameters import MpcParameters
from ...baselines.policy import TaskPolicy
from ...baselines.registry import make_policy
from ...baselines.washout import ScheduledWashout, WashoutParameters
from ...baselines.washout.classical.policies import KNOBS
from ...baselines.washout.families import FAMILIES
from ...baselines.washout.policy import make_washout
from ...envs.errors import ConfigurationError, DataError, UnknownNameError
from ...envs.platform.machines import Platform
from ...envs.settings import from_dict, to_dict
from ...envs.task.episode import platform_of
from ...envs.task.kernels.observation import Layout, layout_of
from ...envs.task.options import TaskOptions
from . import names
from .files import Arrays, Contents, Record, arrays_below, contents_of, network_of, read, write
from .names import SUFFIX, description_of
from .network import Array, PolicyNetwork

DEFAULT: Final = "classical"
"""The washout where one is needed and none is named."""


def base_of(base: Any, task: TaskOptions) -> Any:
    """The base policy that a task's action mode needs under the agent, as an agent's file holds it.

    Args:
        base: Parameters of a washout or of predictive control, an :class:`Agent`, or the name or file of
            either; None for ``task.action.base``, or :data:`DEFAULT`.
        task: The environment.

    Returns:
        Parameters, an agent, or None where the mode needs nothing.

    Raises:
        UnknownNameError: no policy has this name.
        ConfigurationError: a base is named, but the action mode has none; or no file could hold it.
    """
    mode = task.action.mode
    if mode not in ("residual", "gains"):
        if base is not None:
            raise ConfigurationError(f"base is of no use with task.action.mode {mode!r}; leave it out")
        return None
    given = held = base or task.action.base or DEFAULT
    if not isinstance(given, _parameter_sets()):
        named = isinstance(given, str | Path)
        made = make_policy(given, platform_of(task), force=not named)
        if made.task is None:
            held = made.parameters
        elif named:
            held = made
        if made.task is None and not isinstance(held, _parameter_sets()):
            raise ConfigurationError(
                f"base {given}: an agent's file cannot hold it; take a washout, predictive control, an agent"
            )
    if mode == "gains" and not isinstance(held, WashoutParameters):
        raise ConfigurationError("task.action.mode 'gains' needs the classical washout as its base")
    return held


def base_policy(base: Any, task: TaskOptions) -> Any:
    """The policy of :func:`base_of`, as the environment takes it, or None."""
    held, platform = base_of(base, task), platform_of(task)
    if held is None:
        return None
    if not isinstance(held, _parameter_sets()):
        return held.on(platform)
    if isinstance(held, MpcParameters):
        from ...baselines.mpc import make_mpc

        return make_mpc(platform, held)
    if task.action.mode == "gains":
        return ScheduledWashout(held, platform.cab)
    return make_washout(held, platform.cab)


def _parameter_sets() -> tuple[type[Any], ...]:
    """Classes of parameters that are enough to make a base policy of; else it is an agent."""
    return (MpcParameters, *(FAMILIES[family].parameters for family in FAMILIES))


@dataclass(frozen=True, eq=False)
class Agent(TaskPolicy):
    """A policy for the environment of its ``task``.

    Args:
        name: How it is called in tables.
        task: The environment it was trained in.
        network: From the environment's observations to its actions.
        record: How it was made.
        base: What acts under the agent in the action modes "residual" and "gains": parameters of a washout or
            of predictive control, an agent, or the name or file of either.

    Raises:
        DataError: the network does not fit the task's observation or action.
        ConfigurationError: the action mode needs a base, or has no use for one.
    """

    name: str = field()
    task: TaskOptions = field()
    network: PolicyNetwork = field()
    record: Record = field()
    base: Any = None

    def __post_init__(self) -> None:
        if not self.name:
            raise ConfigurationError("agent: name must not be empty")
        mode, named = self.task.action.mode, self.base is not None or self.task.action.base is not None
        if named != (mode in ("residual", "gains")):
            need = "has no use for" if named else "needs"
            raise ConfigurationError(f"agent {self.name}: action.mode {mode!r} {need} a base, a controller")
        object.__setattr__(self, "base", base_of(self.base, self.task))
        if self.network.bound != self.task.action.bound:
            raise DataError(
                f"agent {self.name}: its network's actions end at {self.network.bound:g}, its task's at "
                f"{self.task.action.bound:g}"
            )
        self._check_size("observation", self.network.size, self.layout.size)
        self._check_size("action", self.network.action_size, self.action_size)

    def _check_size(self, what: str, size: int, expected: int) -> None:
        if size != expected:
            raise DataError(
                f"agent {self.name}: its network has {size} entries of {what}, its task {expected}; "
                f"give it the {what} options it was trained with"
            )

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return len(KNOBS) if self.task.action.mode == "gains" else self.task.action.size

    @property
    def layout(self) -> Layout:
        """Of its observations."""
        return layout_of(self.task.observation, self.task.action.mode, self.action_size)

    @property
    def parameters(self) -> Record:
        """How it was made, for the record of an evaluation."""
        return self.record

    @property
    def description(self) -> str:
        """One line for people."""
        return description_of(
            self.record.algo, self.task.observation.machine, self.platform.name, self.task.action.mode
        )

    @cached_property
    def base_policy(self) -> Any:
        """What the environment needs as ``base``, or None."""
        return None if self.base is None else base_policy(self.base, self.task)

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Actions within the bound, (n, k) or (k,), for observations (n, size) or (size,) of its environment.

        The state of a network with a memory is an array with a row an environment.

        Raises:
            DataError: the observation has the wrong shape, or is not finite; or the state is of others.
        """
        values = np.asarray(observation, dtype=np.float32)
        if values.ndim not in (1, 2) or values.shape[-1] != self.network.size:
            raise DataError(f"observation has shape {values.shape}, expected (n, {self.network.size})")
        if not np.isfinite(values).all():
            raise DataError("observation is not finite")
        return self.network.step(values, state, episode_start)

    def on(self, platform: Platform | str) -> Agent:
        """The same agent on another machine than it was trained on.

        That is no fair test of it, unless its observation describes the machine.
        """
        return replace(self, task=replace(self.task, platform=platform))

    def save(self, path: str | Path) -> None:
        """Write one ``.safetensors`` file, whole or not at all.

        Raises:
            ConfigurationError: the file's name ends otherwise.
        """
        if Path(path).suffix != SUFFIX:
            raise ConfigurationError(f"{path}: an agent's file ends in {SUFFIX}")
        arrays, contents = self._contents()
        write(path, arrays, to_dict(contents))

    def _contents(self) -> tuple[Arrays, Contents]:
        plain = self.base is None or isinstance(self.base, _parameter_sets())
        base = self.base if plain else self.base._contents()
        return contents_of(self.name, self.task, self.network, self.record, base)

    @classmethod
    def load(cls, path: str | Path) -> Agent:
        """Read a file that :meth:`save` wrote; nothing in it is executed.

        Raises:
            DataError: the file is missing, broken, no agent, or of a newer version.
            ConfigurationError: its task is none that this version of the package knows.
        """
        tensors, values = read(path)
        return cls._of(tensors, from_dict(Contents, values, str(path)), str(path))

    @classmethod
    def _of(cls, tensors: Arrays, contents: Contents, source: str) -> Agent:
        own, below = arrays_below(tensors)
        network = network_of(own, contents, source)
        base = contents.base if contents.agent is None else cls._of(below, contents.agent, source)
        return cls(contents.name, contents.task, network, contents.record, base)


def get_agent(name: str) -> Agent:
    """A shipped agent.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: there is none at all.
    """
    known = names.agent_names()
    if not known:
        raise DataError(f"agent {name!r}: no agent comes with this package; name an agent's {SUFFIX} file")
    if name not in known:
        raise UnknownNameError("agent", name, known)
    return Agent.load(names.FOLDER / f"{name}{SUFFIX}")


def find_agent(name: str) -> Agent:
    """An agent by the name of a shipped one, or from its file.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: the file does not exist, is broken or no agent.
    """
    is_file = bool(Path(name).suffix) or len(Path(name).parts) > 1 or Path(name).exists()
    return Agent.load(name) if is_file and name not in names.agent_names() else get_agent(name)

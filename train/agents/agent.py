"""A trained policy with everything an evaluation needs: network, task, base policy, and how it was made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...baselines import ClassicalWashout
from ...baselines.washout import ScheduledWashout, WashoutParameters, load_washout
from ...baselines.washout.classical.scheduled import KNOBS
from ...envs.errors import ConfigurationError, DataError, UnknownNameError
from ...envs.platform.kernels.step import AXES
from ...envs.platform.machines import Platform
from ...envs.task.drives import platform_of
from ...envs.task.observation import Layout, layout_of
from ...envs.task.options import TaskOptions
from .files import SUFFIX, Record, contents_of, network_of, read, write
from .network import Array, Network


@dataclass(frozen=True, eq=False)
class Agent:
    """A policy for the environment of its ``task``.

    Args:
        name: How it is called in tables.
        task: The environment it was trained in.
        network: From the environment's observations to its actions.
        record: How it was made.
        base: Washout under the action modes "residual" and "gains", as parameters, preset name or YAML file.

    Raises:
        DataError: the network does not fit the task's observation or action.
        ConfigurationError: the action mode needs a base, or has no use for one.
    """

    name: str
    task: TaskOptions
    network: Network
    record: Record
    base: WashoutParameters | str | Path | None = None

    def __post_init__(self) -> None:
        if not self.name:
            raise ConfigurationError("agent: name must not be empty")
        if isinstance(self.base, str | Path):
            object.__setattr__(self, "base", load_washout(self.base))
        mode = self.task.action.mode
        if (self.base is not None) != (mode in ("residual", "gains")):
            need = "has no use for" if self.base is not None else "needs"
            raise ConfigurationError(f"agent {self.name}: action.mode {mode!r} {need} a base, a washout")
        self._check_size("observation", self.network.size, self.layout.size)
        self._check_size("action", self.network.action_size, self.action_size)

    def _check_size(self, what: str, found: int, expected: int) -> None:
        if found != expected:
            raise DataError(
                f"agent {self.name}: its network has {found} entries of {what}, its task {expected}; "
                f"give it the {what} options it was trained with"
            )

    @property
    def platform(self) -> Platform:
        """The machine it was trained on."""
        return platform_of(self.task)

    @property
    def told(self) -> bool:
        """Whether it is told its machine, and so runs on any."""
        return self.task.observation.machine

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return len(KNOBS) if self.task.action.mode == "gains" else len(AXES)

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
        base = "any motion base, which it is told" if self.told else f"the motion base {self.platform.name}"
        return f"agent by {self.record.algo} for {base}, action {self.task.action.mode}"

    @cached_property
    def base_policy(self) -> ClassicalWashout | None:
        """The washout that the environment needs as ``base``, or None."""
        if not isinstance(self.base, WashoutParameters):
            return None
        kind = ScheduledWashout if self.task.action.mode == "gains" else ClassicalWashout
        return kind(self.base, self.platform.cab)

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Actions in [-1, 1], (n, k) or (k,), for observations (n, size) or (size,) of its environment.

        Raises:
            DataError: the observation has the wrong shape, or is not finite.
        """
        values = np.asarray(observation, dtype=np.float32)
        if values.ndim not in (1, 2) or values.shape[-1] != self.network.size:
            raise DataError(f"observation has shape {values.shape}, expected (n, {self.network.size})")
        if not np.isfinite(values).all():
            raise DataError("observation is not finite")
        return self.network(values), state

    def on(self, platform: Platform | str) -> Agent:
        """The same agent on another machine than it was trained on: no fair test of it, unless it is told."""
        return replace(self, task=replace(self.task, platform=platform))

    def save(self, path: str | Path) -> None:
        """Write one ``.safetensors`` file, whole or not at all.

        Raises:
            ConfigurationError: the file's name ends otherwise.
        """
        if Path(path).suffix != SUFFIX:
            raise ConfigurationError(f"{path}: an agent's file ends in {SUFFIX}")
        base = self.base if isinstance(self.base, WashoutParameters) else None
        contents = contents_of(self.name, self.task, self.network, self.record, base)
        write(path, *contents)

    @classmethod
    def load(cls, path: str | Path) -> Agent:
        """Read a file that :meth:`save` wrote; nothing in it is executed.

        Raises:
            DataError: the file is missing, broken, no agent, or of a newer version.
            ConfigurationError: its task is none that this version of the package knows.
        """
        tensors, values = read(path)
        contents, network = network_of(tensors, values, str(path))
        return cls(contents.name, contents.task, network, contents.record, contents.base)


# The agents that come with the package.


FOLDER: Final = Path(__file__).parent


def agent_names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def get_agent(name: str) -> Agent:
    """A shipped agent.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: there is none at all.
    """
    known = agent_names()
    if not known:
        raise DataError(f"agent {name!r}: no agent comes with this package; name an agent's {SUFFIX} file")
    if name not in known:
        raise UnknownNameError("agent", name, known)
    return Agent.load(FOLDER / f"{name}{SUFFIX}")

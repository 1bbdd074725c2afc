"""The native vector environment of Gymnasium: a batch, not a loop of single environments."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ..cues import CueTrace
from ..errors import ConfigurationError
from ..simulator.simulator import TIME_STEP
from .batch import Batch
from .environment import (
    ARGUMENTS,
    RENDER_MODES,
    action_space,
    drive_option,
    frames_per_second,
    normalized,
    observation_space,
    pictures_of,
    rendered,
    task_options,
)
from .kernels.reward import TERMS
from .options import TaskOptions

if TYPE_CHECKING:
    from ..rendering.renderer import Picture

Mask = NDArray[np.bool_]
Info = dict[str, Any]
Result = tuple[NDArray[np.float32], NDArray[np.float64], Mask, Mask, Info]


class DrivingSimulatorVector(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """A batch of driving simulators; row i is :class:`~.environment.DrivingSimulator` with the same seed.

    Args:
        num_envs: Environments.
        task: Everything that can be chosen, or the name or file of a task; default: all defaults.
        drives: Cue traces to drive instead of those of ``task.episode``.
        base: The base policy of the action modes "residual" and "gains", by name or file too; default:
            ``action.base``.
        autoreset_mode: When an ended environment begins anew; Gymnasium's default is with the next step.
        copy: Whether observations are copies; else each step overwrites those of the one before.
        device: "cpu" or a CUDA device of Warp.
        render_mode: "rgb_array" (:meth:`render` gives a frame of each environment), "human" (a window that
            shows the first one, at the pace of the drive), or None;
            see ``docs/guides/films-and-pictures.md``.
        render_size: Width and height of a frame, pixels; default: 960 x 540, of a window 1280 x 720.
        **fields: Fields of :class:`~.options.TaskOptions` to replace, as dataclasses or dictionaries.

    Raises:
        UnknownArgumentError: an argument is unknown.
        ConfigurationError: an option is unknown, of the wrong type or out of range.
        RenderingUnavailableError: ``render_mode`` is given, and the extra ``render`` is not installed.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  (as Gymnasium declares it)
        "render_modes": list(RENDER_MODES),
        "render_fps": 1.0 / TIME_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        task: TaskOptions | str | Path | None = None,
        *,
        drives: Sequence[CueTrace] | None = None,
        base: Any = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        device: str = "cpu",
        render_mode: str | None = None,
        render_size: tuple[int, int] | None = None,
        **fields: Any,
    ) -> None:
        super().__init__()
        self.render_mode = render_mode
        self.task = task_options(task, fields, (*ARGUMENTS, "autoreset_mode", "copy", "device"))
        self.batch = Batch(num_envs, self.task, drives=drives, base=base, device=device)
        self.num_envs = num_envs
        self.single_observation_space = observation_space(self.batch)
        self.single_action_space = action_space(self.batch)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        own = {"render_fps": frames_per_second(self.batch), "autoreset_mode": self.autoreset_mode}
        self.metadata = self.metadata | own
        self._pictures = pictures_of(self.batch, render_mode, render_size)
        self._copy = copy
        self._ended = np.zeros(num_envs, dtype=bool)
        self._seeded = False

    @property
    def scale(self) -> NDArray[np.float64]:
        """(9,) accelerations that an action of 1 stands for, m/s^2, rad/s^2; (n, 9) where machines differ."""
        return self.batch.scale

    def action_of(self, acceleration: ArrayLike) -> NDArray[np.float32]:
        """Actions of the mode "acceleration" for accelerations (..., 9); 0 on axes that cannot move."""
        return normalized(acceleration, self.batch.scale)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Begin the next episodes.

        Args:
            seed: Start over: environment i with ``seed + i``, or with the i-th of a list (None: go on).
            options: ``drive``: index or name of the drive, or one for each environment, instead of drawing;
                ``reset_mask``: (n,) environments to begin anew, the others go on.

        Returns:
            Observations, and ``drive`` (index into ``batch.drives``) and ``time`` (s, in the drive).
        """
        drive = drive_option(options, ("drive", "reset_mask"))
        super().reset(seed=seed if isinstance(seed, int) else None)
        mask = self._reset_mask(options or {})
        self._seed(mask, seed)
        self.batch.begin(mask, None if drive is None else self.batch.drive_indices(drive))
        self._observe(mask)
        self._ended[mask] = False
        return self._observations(), self._begun(mask)

    def _reset_mask(self, options: dict[str, Any]) -> Mask:
        mask = options.get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ConfigurationError(
                f"reset_mask must be {self.num_envs} booleans, at least one of them true; found {mask!r}"
            )
        return mask

    def _seed(self, mask: Mask, seed: int | Sequence[int | None] | None) -> None:
        if seed is None and self._seeded:
            return
        if seed is None or isinstance(seed, int):
            seeds = self._following(seed)
        elif len(seed) == self.num_envs:
            pairs = zip(seed, self._following(None), strict=True)
            seeds = [own if given is None else given for given, own in pairs]
            if self._seeded:
                mask = mask & np.array([given is not None for given in seed])
        else:
            raise ConfigurationError(f"seed has {len(seed)} entries for {self.num_envs} environments")
        self.batch.seed(mask, seeds)
        self._seeded = True

    def _following(self, seed: int | None) -> list[int]:
        """The seeds from ``seed`` on, or from Gymnasium's own."""
        first: Any = self.np_random_seed if seed is None else seed
        return [int(first) + i for i in range(self.num_envs)]

    def step(self, actions: ArrayLike) -> Result:
        """Advance every environment by one action; see :meth:`DrivingSimulator.step`.

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        self.batch.write(actions)
        self.batch.step()
        if self.autoreset_mode == AutoresetMode.NEXT_STEP:
            return self._step_or_begin()
        return self._step_and_begin()

    def _step_or_begin(self) -> Result:
        """Environments that ended in the last step begin anew in this one, and ignore its action."""
        batch, began = self.batch, self._ended
        self._follow(~began)
        reward, terminated, truncated = self._outcome()
        anything = bool(began.any())
        if anything:
            reward[began], terminated[began], truncated[began] = 0.0, False, False
        info = self._stepped(~began)
        if anything:
            batch.begin(began)
            self._observe(began)
            info |= self._begun(began)
        self._ended = terminated | truncated
        return self._observations(), reward, terminated, truncated, info

    def _step_and_begin(self) -> Result:
        """Environments that end in this step begin anew in it, and tell their end in ``info``."""
        batch = self.batch
        self._follow(np.ones(self.num_envs, dtype=bool))
        reward, terminated, truncated = self._outcome()
        ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.DISABLED or not ended.any():
            return self._observations(), reward, terminated, truncated, self._stepped(~np.zeros_like(ended))
        info = self._stepped(~ended) | self._final(ended)
        batch.begin(ended)
        self._observe(ended)
        info |= self._begun(ended)
        return self._observations(), reward, terminated, truncated, info

    def render(self) -> tuple[Picture, ...] | None:
        """The machines now, beside the reference and the simulator cues.

        Returns:
            In the mode "rgb_array" a frame of each environment, as :meth:`DrivingSimulator.render`; else
            None. In the mode "human" steps show themselves.
        """
        return rendered(self._pictures)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """What :class:`~.environment.DrivingSimulator` has under this name, of each environment."""
        if name == "scale":
            return tuple(np.broadcast_to(self.scale, (self.num_envs, self.scale.shape[-1])).copy())
        return (getattr(self, name),) * self.num_envs

    def call(self, name: str, *arguments: Any, **keywords: Any) -> tuple[Any, ...]:
        """What a method of each environment returns, or its attribute, as Gymnasium's vector environments do.

        Raises:
            ConfigurationError: the method moves the environments, which only the whole batch can do.
        """
        if name == "render":
            return self.render() or (None,) * self.num_envs
        if name in ("reset", "step", "close"):
            raise ConfigurationError(f"call: use {name}() of the vector environment")
        return tuple(one(*arguments, **keywords) if callable(one) else one for one in self.get_attr(name))

    def get_state(self) -> dict[str, Any]:
        """Everything that changes, for :meth:`set_state` of a batch made alike."""
        return {"batch": self.batch.snapshot(), "seeded": self._seeded, "ended": self._ended.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from where :meth:`get_state` was called: the same actions then give the same bits.

        Raises:
            DataError: the state is of another batch or version.
        """
        self.batch.restore(state["batch"])
        self._seeded, self._ended = state["seeded"], state["ended"].copy()
        if self._pictures is not None and self._seeded:
            self._pictures.begin(np.ones(self.num_envs, dtype=bool))

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if there is one."""
        if self._pictures is not None:
            self._pictures.close()

    def _follow(self, mask: Mask) -> None:
        if self._pictures is not None:
            self._pictures.follow(mask)

    def _observe(self, begins: Mask) -> None:
        """Make the observations new, and the pictures, where episodes begin."""
        self.batch.observe(begins)
        if self._pictures is not None:
            self._pictures.begin(begins)

    def _observations(self) -> NDArray[np.float32]:
        view = self.batch.arrays.observation.pull()
        return view.copy() if self._copy else view

    def _outcome(self) -> tuple[NDArray[np.float64], Mask, Mask]:
        batch = self.batch
        reward = batch.arrays.reward.pull().astype(np.float64)
        return reward, batch.arrays.terminated.pull().copy(), batch.arrays.truncated.pull().copy()

    def _stepped(self, mask: Mask) -> Info:
        """What the masked environments tell of their step."""
        if not mask.any():
            return {}
        terms = np.where(mask[:, None], self.batch.arrays.terms.pull(), 0.0).T.copy()
        info: Info = dict(zip(TERMS, terms, strict=True))
        info["clipped"] = np.where(mask, self.batch.clipped, 0)
        return _masked(info, mask)

    def _begun(self, mask: Mask) -> Info:
        """What the masked environments tell of their beginning."""
        batch = self.batch
        drive = np.where(mask, batch.simulator.drive_of, 0)
        samples = batch.simulator.state["sample"]
        time = np.zeros(self.num_envs)
        for i in np.flatnonzero(mask):
            time[i] = batch.drives[drive[i]].time[samples[i]]
        return _masked({"drive": drive, "time": time}, mask)

    def _final(self, mask: Mask) -> Info:
        """The last observation and info of the masked environments' episodes."""
        view = self.batch.arrays.observation.pull()
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(mask):
            final[i] = view[i].copy()
        return _masked({"final_obs": final, "final_info": self._stepped(mask)}, mask)


def _masked(info: Info, mask: Mask) -> Info:
    """Each entry with the mask of the environments it is of, as Gymnasium has it."""
    return info | {f"_{key}": mask.copy() for key in info}

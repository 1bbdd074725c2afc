"""The Gymnasium environment: a batch with one row; and what it shares with the vector environment."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import gymnasium
import numpy as np
from gymnasium import logger
from gymnasium.spaces import Box, Space
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from ..cues import CueTrace
from ..errors import ActionError, ConfigurationError, UnknownArgumentError, suggest
from ..simulator.simulator import TIME_STEP
from .batch import Batch
from .kernels.reward import TERMS
from .options import TaskOptions, load_task

if TYPE_CHECKING:
    from ..rendering.renderer import Picture
    from .rendering import Pictures

RENDER_MODES: Final = ("human", "rgb_array")
"""What ``render_mode`` may be, beside None."""

ARGUMENTS: Final = ("task", "drives", "base", "render_mode", "render_size")
"""Arguments of an environment beside the fields of :class:`~.options.TaskOptions`."""

_BEFORE: Final = {"randomisation": "randomization"}
"""Names of fields in earlier versions."""


def observation_space(batch: Batch) -> Space[Any]:
    """Of one environment: float32, bounded by each row's bound."""
    bounds = batch.layout.bounds
    return Box(-bounds, bounds, dtype=np.float32)


def action_space(batch: Batch) -> Space[Any]:
    """Of one environment: float32 within the bound of ``action``."""
    bound = batch.options.action.bound
    return Box(-bound, bound, (batch.action_size,), dtype=np.float32)


def task_options(
    task: TaskOptions | str | Path | None, fields: dict[str, Any], arguments: Iterable[str] = ()
) -> TaskOptions:
    """A task with some fields replaced; in a plain dictionary, the fields it names alone.

    Args:
        task: Where to begin: a task, its name or file; default: all defaults.
        fields: Fields to replace.
        arguments: Further keywords that the caller knows, for the message.

    Raises:
        UnknownArgumentError: there is no such field.
        ConfigurationError: a nested field is unknown, or one is of the wrong type or out of range.
    """
    known = [field.name for field in dataclasses.fields(TaskOptions)]
    for name in fields:
        if name not in (*known, *_BEFORE):
            raise UnknownArgumentError(
                f"got an unexpected keyword argument {name!r}. {suggest(name, [*known, *arguments])}"
            )
    return load_task(task, **{_BEFORE.get(name, name): value for name, value in fields.items()})


def drive_option(options: dict[str, Any] | None, known: Sequence[str] = ("drive",)) -> Any:
    """The drive that ``reset(options=...)`` asks for, or None.

    Raises:
        ConfigurationError: there is an option that is none of ``known``.
    """
    for name in options or {}:
        if name not in known:
            raise ConfigurationError(f"reset: unknown option {name!r}. {suggest(str(name), known)}")
    return (options or {}).get("drive")


def pictures_of(batch: Batch, mode: str | None, size: tuple[int, int] | None) -> Pictures | None:
    """What draws a batch; None without a render mode, and then nothing that draws is imported.

    Raises:
        ConfigurationError: there is no such mode, or ``size`` cannot be drawn or is given without one.
        RenderingUnavailableError: the extra ``render`` is not installed.
    """
    if mode is None:
        if size is not None:
            raise ConfigurationError("render_size is of no use without a render_mode; leave it out")
        return None
    if mode not in RENDER_MODES:
        raise ConfigurationError(f"render_mode {mode!r} is none of {', '.join(RENDER_MODES)}; leave it out")
    from .rendering import Pictures

    return Pictures(batch, mode, size)


def rendered(pictures: Pictures | None) -> tuple[Picture, ...] | None:
    """What ``render`` returns of a batch; without a render mode it warns, as Gymnasium's environments do."""
    if pictures is None:
        logger.warn('render() draws nothing without a render mode; give render_mode="rgb_array" or "human"')
        return None
    return pictures.render()


def frames_per_second(batch: Batch) -> float:
    """Gymnasium's ``render_fps``: one frame a step, so that a film of all of them runs at true speed."""
    return 1.0 / batch.time_step


Observation = NDArray[np.float32]
Action = NDArray[np.float32]


class DrivingSimulator(gymnasium.Env[Observation, Action], EzPickle):
    """A driving simulator that moves its driver as a car would, as far as its travel lets it.

    **Description.** A car drives, and a motion base (carriage, hexapod, turntable) moves the cab of a driving
    simulator. The agent commands the motion base. Its driver shall feel what the driver of the car feels:
    specific force and angular velocity, without false cues and without an end of travel.

    **Action Space.** ``Box(-1, 1)``, float32: for each of nine axes (carriage x, y; surge, sway, heave; roll,
    pitch, yaw; turntable) its acceleration, as a share of the largest one the axis can do by itself. See
    :class:`~.kernels.action.ActionOptions` for rates, speeds, residuals and gains instead.

    **Observation Space.** ``Box``, float32, in fixed physical scaling: the car's cues, the cab's cues, the
    set-points of the motion base, the cues' errors and the last action; and by choice a preview, a memory,
    perceived cues, true motion and what the machine can do.
    :func:`~.kernels.observation.observation_table` describes every row.

    **Rewards.** Minus the weighted sum of terms, which ``info`` has by name: above all the cue error, whose
    mean over a drive is J. :func:`~.kernels.reward.reward_table` describes every term with its weight.

    **Starting State.** The motion base at rest at neutral, or anywhere within ``episode.platform_offset`` of
    its travel. The car at the begin of a drive drawn from the library, or anywhere in it with
    ``episode.random_start``. The seed and the number of the episode decide all draws.

    **Episode End.** ``truncated`` at the end of the drive or after ``episode.duration``; ``terminated`` at an
    end of travel or a nearly singular pose, with ``episode.terminate_on_failure`` alone.

    **Arguments.** Below, and every field of :class:`~.options.TaskOptions`.

    **Version History.** v0: the first.

    Args:
        task: Everything that can be chosen, or the name or file of a task; default: all defaults.
        drives: Cue traces to drive instead of those of ``task.episode``.
        base: The base policy of the action modes "residual" and "gains", by name or file too; default:
            ``action.base``.
        render_mode: "rgb_array" (:meth:`render` gives a frame), "human" (a window, at the pace of the
            drive), or None; see ``docs/guides/films-and-pictures.md``.
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
        task: TaskOptions | str | Path | None = None,
        *,
        drives: Sequence[CueTrace] | None = None,
        base: Any = None,
        render_mode: str | None = None,
        render_size: tuple[int, int] | None = None,
        **fields: Any,
    ) -> None:
        looks = {"render_mode": render_mode, "render_size": render_size}
        EzPickle.__init__(self, task, drives=drives, base=base, **looks, **fields)
        self.render_mode = render_mode
        self.task = task_options(task, fields, ARGUMENTS)
        self.batch = Batch(1, self.task, drives=drives, base=base)
        self.observation_space = observation_space(self.batch)
        self.action_space = action_space(self.batch)
        self.metadata = self.metadata | {"render_fps": frames_per_second(self.batch)}
        self._pictures = pictures_of(self.batch, render_mode, render_size)
        self._all = np.ones(1, dtype=bool)
        self._seeded = False

    @property
    def scale(self) -> NDArray[np.float64]:
        """(9,) accelerations that an action of 1 stands for, m/s^2 and rad/s^2."""
        return np.array(np.atleast_2d(self.batch.scale)[0])

    def action_of(self, acceleration: ArrayLike) -> Action:
        """Actions of the mode "acceleration" for accelerations (..., 9); 0 on axes that cannot move."""
        return normalized(acceleration, self.scale)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next episode.

        Args:
            seed: Start over with this seed.
            options: ``drive``: index or name of the drive, instead of drawing one.

        Returns:
            The observation, and ``drive`` (index into ``batch.drives``) and ``time`` (s, in the drive).
        """
        drive = drive_option(options)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self.batch.seed(self._all, [self.np_random_seed])
            self._seeded = True
        self.batch.begin(self._all, None if drive is None else self.batch.drive_indices(drive))
        self.batch.observe(self._all)
        if self._pictures is not None:
            self._pictures.begin(self._all)
        state = self.batch.simulator.state[0]
        where = int(self.batch.simulator.drive_of[0])
        info = {"drive": where, "time": float(self.batch.drives[where].time[state["sample"]])}
        return self.batch.arrays.observation.pull()[0].copy(), info

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one action.

        Returns:
            Observation, reward, whether failed, whether at the end, and every term of the reward by
            name, with ``clipped``, the entries of the action outside [-1, 1].

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        batch = self.batch
        batch.write(np.asarray(action)[None])
        batch.step()
        info: dict[str, Any] = dict(zip(TERMS, batch.arrays.terms.pull()[0].tolist(), strict=True))
        info["clipped"] = int(batch.clipped[0])
        if self._pictures is not None:
            self._pictures.follow(self._all)
        return (
            batch.arrays.observation.pull()[0].copy(),
            float(batch.arrays.reward.pull()[0]),
            bool(batch.arrays.terminated.pull()[0]),
            bool(batch.arrays.truncated.pull()[0]),
            info,
        )

    def render(self) -> Picture | None:
        """The machine now, beside the reference and the simulator cues.

        Returns:
            In the mode "rgb_array" a frame (height, width, 3), read-only, at most 1/30 s old; else None.
            In the mode "human" steps show themselves.
        """
        frames = rendered(self._pictures)
        return None if frames is None else frames[0]

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._pictures is not None:
            self._pictures.close()

    def get_state(self) -> dict[str, Any]:
        """Everything that changes, for :meth:`set_state` of an environment made alike."""
        return {"batch": self.batch.snapshot(), "seeded": self._seeded}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from where :meth:`get_state` was called: the same actions then give the same bits.

        Raises:
            DataError: the state is of another environment or version.
        """
        self.batch.restore(state["batch"])
        self._seeded = state["seeded"]
        if self._pictures is not None and self._seeded:
            self._pictures.begin(self._all)

    def __getstate__(self) -> dict[str, Any]:
        """Pickles and deep copies go on in mid-episode."""
        generator = {"_np_random": self._np_random, "_np_random_seed": self._np_random_seed}
        return {**EzPickle.__getstate__(self), "state": self.get_state(), "generator": generator}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        EzPickle.__setstate__(self, pickled)
        self.__dict__.update(pickled["generator"])
        self.set_state(pickled["state"])


def normalized(acceleration: ArrayLike, scale: NDArray[np.float64]) -> Action:
    """Actions (..., 9) for accelerations in SI units and their scale (9,) or (n, 9); 0 where it is 0.

    Raises:
        ActionError: not nine accelerations.
    """
    values = np.asarray(acceleration, dtype=np.float64)
    if values.shape[-1:] != scale.shape[-1:]:
        raise ActionError(f"accelerations have shape {values.shape}, expected (..., {scale.shape[-1]})")
    out = np.zeros(np.broadcast_shapes(values.shape, scale.shape))
    return np.divide(values, scale, out=out, where=scale > 0.0).astype(np.float32)

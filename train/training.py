"""The training loop: from the start or a checkpoint to the end, with log, validation, checkpoints and agents.

A :class:`Training` makes the learner of its algorithm and calls ``learn``. Between updates the learner calls
back: then whatever is due happens (:meth:`Training._boundary`). So every algorithm is validated, saved and
stopped alike.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..baselines import ClassicalWashout, NoMotion
from ..envs.errors import ConfigurationError, DataError
from ..envs.progress import Interrupt
from ..envs.settings import from_dict, to_dict
from ..envs.task.batch import Batch
from ..envs.task.episode import platform_of
from ..envs.task.kernels.observation import layout_of
from .agents import Agent, PolicyNetwork, Record
from .agents.agent import DEFAULT, base_of, find_agent
from .config import Measure, TrainingConfig
from .logs import TrainingLog
from .networks import Actor, start_as_spring_damper
from .registry import ALGORITHMS, Learner, StopTraining
from .run import RunFolder
from .validation import Score, Validation
from .watch import References, Watch


def initial_agent(config: TrainingConfig) -> Agent | None:
    """The agent of ``config.initial``, or None where nothing is named."""
    return None if config.initial is None else find_agent(config.initial)


def initial_network(config: TrainingConfig) -> PolicyNetwork | None:
    """Its network; rows of controls and road that it does not see begin without an effect.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: that agent sees, does or drives something else.
    """
    agent = initial_agent(config)
    if agent is None:
        return None
    ours, own = config.task.observation, agent.task.observation
    added = replace(own, controls=ours.controls, road=ours.road, allow_missing=ours.allow_missing)
    widens = added == ours and own.stack == 1 and not agent.network.lstm
    # An agent that observes its machine begins on any.
    same = ["action", *([] if own.machine else ["platform"]), *([] if widens else ["observation"])]
    for name in same:
        theirs, asked = getattr(agent.task, name), getattr(config.task, name)
        if theirs != asked:
            raise ConfigurationError(f"initial {config.initial}: its task.{name} is {theirs}, not {asked}")
    return _widened(agent, config) if own != ours else agent.network


def _widened(agent: Agent, config: TrainingConfig) -> PolicyNetwork:
    """The network of an agent for more rows, which have no effect yet."""
    action = config.task.action
    # Every entry of an action has a place, whatever its number.
    before, after = (
        layout_of(seen, action.mode, action.size)
        for seen in (agent.task.observation, config.task.observation)
    )
    sizes = {row.name: row.size for row in after.rows}
    lost = [row.name for row in before.rows if sizes.get(row.name) != row.size]
    if lost:
        raise ConfigurationError(f"initial {config.initial}: it sees {', '.join(lost)}, which the task lacks")
    places = np.concatenate([np.arange(after.size)[after.slices[row.name]] for row in before.rows])
    return agent.network.head.widened(places, after.size)


def start_actor(actor: Actor, batch: Batch, config: TrainingConfig) -> None:
    """Initialize an actor: the network of ``config.initial``, or a spring to neutral where none is named."""
    network = initial_network(config)
    if network is None:
        start_as_spring_damper(actor, batch)
    elif network.lstm:
        raise DataError(f"initial: {config.algo} trains no network with a memory, which the agent has")
    else:
        actor.load(network.head)


def check_episodes(config: TrainingConfig, why: str) -> None:
    """Refuse settings of algorithms that learn from whole episodes, on the CPU, in the machine's own scales.

    Args:
        config: The training.
        why: The reason why observations and rewards are not normalized.
    """
    if config.task.episode.duration is None:
        raise ConfigurationError(
            "task.episode.duration must say how long an episode is, s; 20 is a good start"
        )
    if config.task.action.bound != 1.0:
        raise ConfigurationError(
            f"task.action.bound must be 1 for {config.algo}; change authority or largest"
        )
    if config.normalize.observation or config.normalize.reward:
        raise ConfigurationError(f"normalize must be off for {config.algo}: {why}")
    if not str(config.device).startswith("cpu"):
        raise ConfigurationError(f"device {config.device}: {config.algo} runs on the CPU")


_WARM_UP: Final = 0.1
"""Share of the training in which the learning rate rises."""

_LEAST_RATE: Final = 0.02
"""Learning rate at the start and the end, as a share of the largest."""


def warm_cosine(progress: float) -> float:
    """Learning rate as a share of the largest: linear warm-up in the first tenth, then cosine decay.

    Args:
        progress: Share of the training that is done.
    """
    progress = min(progress, 1.0)
    if progress < _WARM_UP:
        return max(progress / _WARM_UP, _LEAST_RATE)
    turn = math.pi * (progress - _WARM_UP) / (1.0 - _WARM_UP)
    return _LEAST_RATE + (1.0 - _LEAST_RATE) * 0.5 * (1.0 + math.cos(turn))


START: Final = "start"
"""Name in the log of the controller that a training begins with."""

Tell = Callable[["Status"], None]
"""Receives the status at every boundary."""


@dataclass
class Status:
    """Where a training is.

    Args:
        steps: Actions so far.
        total: Actions in all.
        score: Of the last validation.
        best: Score of the best agent so far, in what the configuration calls best; lower is better.
        references: J on the same drives of what the agent is compared with; None before they are measured.
        news: Whether ``score`` is new.
        drive_share: Share of the variance of rewards that environments in the same drive have in common; None
            without groups.
        entropy: Of the actions explored with, where the algorithm tells it.
        kl: How far the last update moved the policy, likewise.
        warnings: New since the last status, in plain words.
    """

    steps: int
    total: int
    score: Score | None = None
    best: float | None = None
    references: References | None = None
    news: bool = False
    drive_share: float | None = None
    entropy: float | None = None
    kl: float | None = None
    warnings: list[str] = field(default_factory=list)

    @property
    def reference(self) -> float | None:
        """J of the classical washout on the validation drives."""
        return None if self.references is None else self.references.washout


@dataclass(frozen=True)
class Outcome:
    """The result of a training.

    Args:
        status: At the end.
        interrupted: Whether Ctrl-C stopped it; it can be resumed.
    """

    status: Status
    interrupted: bool


class Training:
    """One training in its folder.

    Args:
        run: The folder; a checkpoint in it is gone on from.
        tell: Receives the status at every boundary.
        interrupt: Whoever decides when to stop; default: Ctrl-C, which is caught while it trains.
    """

    def __init__(
        self, run: RunFolder, tell: Tell = lambda status: None, interrupt: Interrupt | None = None
    ) -> None:
        self.run, self.config, self._tell = run, run.config, tell
        state = run.last_checkpoint()
        # A checkpoint goes before the agent that the training began with, which may be gone by now.
        config = run.config if state is None else replace(run.config, initial=None)
        begun = initial_agent(config)
        self._initial = None if begun is None else begun.record
        algorithm = ALGORITHMS[config.algo]
        self._advice = algorithm.advice(config) if state is None else []
        self.learner: Learner = algorithm(config)
        self.validation = Validation(run.config)
        # As if all sessions had followed each other without a pause.
        self._begun, self._seen = time.perf_counter(), -1
        self._interrupt = interrupt or Interrupt()
        self._caught = self._interrupt.caught if interrupt is None else nullcontext
        self.status, self._watch = Status(0, run.config.steps), Watch()
        if state is not None:
            self._go_on(state)

    def _go_on(self, state: dict[str, Any]) -> None:
        self.learner.restore(state["learner"])
        self._begun -= state["elapsed"]
        self._seen = self.status.steps = self.learner.steps
        self.status.best = state["best"]
        # Checkpoints of early versions have the washout's J alone, or no score.
        self.status.references = References(**state.get("references", {"washout": state.get("reference")}))
        if "watch" in state:
            self._watch.restore(state["watch"])
        if state.get("score") is not None:
            score = state["score"]
            self.status.score = Score(**{**score, "by_drive": tuple(score.get("by_drive", ()))})
        if state["initial"] is not None:
            self._initial = from_dict(Record, state["initial"], "initial")

    def train(self) -> Outcome:
        """Train to the configuration's steps, or until Ctrl-C; nothing where that is done already."""
        if self.status.steps >= self.config.steps and self.run.final_agent.exists():
            return Outcome(self.status, interrupted=False)
        self.run.begin(self.status.steps)
        self.log = TrainingLog(self.run.path, self.status.steps)
        try:
            with self._caught():
                if self._advice:
                    self._say(self._advice)
                if self.status.references is None:
                    self.status.references = self._measured_references()
                self.learner.learn(self._boundary)
                self._boundary()
                self.agent("final").save(self.run.final_agent)
        except StopTraining:
            return Outcome(self.status, interrupted=True)
        finally:
            self.log.close()
        return Outcome(self.status, interrupted=False)

    def _say(self, warnings: list[str]) -> None:
        self.status.warnings = warnings
        self._tell(self.status)
        self.status.warnings = []

    def _measured_references(self) -> References:
        """Washout and standing still, and the base policy where the training begins with it alone."""
        still = NoMotion()
        scores = {
            DEFAULT: self.validation.score_policy(
                ClassicalWashout(DEFAULT, platform_of(self.config.task).cab)
            ),
            still.name: self.validation.score_policy(still),
        }
        if self.config.initial is None and base_of(self.config.base, self.config.task) is not None:
            scores[START] = self.validation.score_base()
        for name, score in scores.items():
            self._log_reference(0, name, score)
        start = scores.get(START)
        return References(
            washout=scores[DEFAULT].cue_error,
            standing=scores[still.name].cue_error,
            start=None if start is None else start.cue_error,
        )

    def _log_reference(self, steps: int, name: str, score: Score) -> None:
        scalars = {"J": score.cue_error, "perceived_J": score.perceived_error}
        self.log.write(steps, {f"{name}/{scalar}": value for scalar, value in scalars.items()})

    def _boundary(self) -> None:
        """Between updates: whatever is due."""
        steps = self.status.steps = self.learner.steps
        last = steps >= self.config.steps
        self.status.news, self.status.warnings = False, []
        if self._due(self.config.log_every) or last:
            self.log.write(steps, self.learner.scalars())
        if steps > self._seen and (self._due(self.config.validation.every) or last):
            self._validate()
        self._tell(self.status)
        checkpoint = self.config.checkpoints.every
        due = bool(checkpoint) and self._seen >= 0 and self._due(checkpoint)
        self._seen = max(steps, self._seen)
        if due or self._interrupt.asked or (last and checkpoint):
            self.checkpoint()
        if self._interrupt.asked and not last:
            raise StopTraining

    def _due(self, every: int) -> bool:
        """Whether a multiple of ``every`` has been passed since the last boundary."""
        return self._seen < 0 or self.learner.steps // every > self._seen // every

    def _validate(self) -> None:
        network, status, first = self.learner.network(), self.status, self.status.score is None
        score = self.validation.score(network.acting())
        with self.learner.exploring(self.validation.noisy_drives) as act:
            if act is not None:
                score = self.validation.with_noise(score, act)
        status.score, status.news = score, True
        self.log.write(status.steps, score.scalars())
        references = status.references or References()
        if first and references.start is None:
            # The training begins with its network.
            references = status.references = replace(references, start=score.cue_error)
            self._log_reference(status.steps, START, score)
        status.warnings = self._watch.look(score, references)
        status.entropy, status.kl = self.log.last("train/entropy"), self.log.last("train/approx_kl")
        status.drive_share = self.log.last("rollout/drive_share")
        value = rating(score, self.config.validation.best)
        if status.best is None or value < status.best:
            status.best = value
            self.agent("best").save(self.run.best_agent)

    def agent(self, kind: str) -> Agent:
        """The agent as it is now, its validation that of the last validation."""
        config, session = self.config, self.run.sessions[-1]
        record = Record(
            algo=config.algo,
            seed=config.seed,
            command=self.run.sessions[0]["command"],
            steps=self.learner.steps,
            wall_time=round(time.perf_counter() - self._begun, 1),
            hardware=session["hardware"],
            versions=session["versions"],
            created=session["begun"],
            validation=None if self.status.score is None else self.status.score.cue_error,
            initial=self._initial,
        )
        name = f"{self.run.path.resolve().name}-{kind}"
        base = base_of(config.base, config.task)
        return Agent(name, config.task, self.learner.network(), record, base)

    def checkpoint(self) -> Path:
        """Write a checkpoint of the boundary this is called at."""
        state = {
            "learner": self.learner.state(),
            "elapsed": time.perf_counter() - self._begun,
            "best": self.status.best,
            "references": None if self.status.references is None else asdict(self.status.references),
            "watch": self._watch.state(),
            "score": None if self.status.score is None else asdict(self.status.score),
            "initial": None if self._initial is None else to_dict(self._initial),
        }
        return self.run.save_checkpoint(self.status.steps, state)


def rating(score: Score, measure: Measure) -> float:
    """What a configuration calls best, lower is better."""
    return -score.reward if measure == "reward" else float(getattr(score, measure))

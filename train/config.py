"""Everything that can be chosen about a training, as a frozen dataclass that loads from YAML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field, JsonValue

from ..baselines.washout.families import AnyWashout, load_parameters
from ..envs.errors import ConfigurationError
from ..envs.maneuvers import drive_seeds
from ..envs.settings import Positive, configuration, from_dict, merge, read_yaml
from ..envs.task.options import (
    Count,
    EpisodeOptions,
    PositiveCount,
    RandomizationOptions,
    TaskOptions,
    task_values,
)
from .registry import algorithm_names, preset_of

Measure = Literal["cue_error", "perceived_error", "reward"]
"""What makes one agent better than another on the validation drives."""

EVALUATION_ONLY: Final = (
    "standard maneuvers and recorded drives are for evaluation and are never trained on; "
    "leave it empty for random drives"
)

_WHOLE: Final = {"task": "preset", "hyperparameters": "policy"}
"""Fields of a file that begin anew where they have this entry, not with an algorithm's preset."""

_RECIPES: Final = Path(__file__).parent / "recipes"


@configuration
class NormalizeOptions:
    """Running normalization, as Stable-Baselines3's ``VecNormalize`` does it.

    Args:
        observation: Whether observations are; the agent's file holds their mean and variance.
        reward: Whether rewards are divided by the standard deviation of the discounted return.
        clip: Largest absolute value of either.
    """

    observation: bool = True
    reward: bool = True
    clip: Positive = 10.0


@configuration
class ValidationOptions:
    """Random drives that are never trained on, driven whole from neutral without randomization.

    Args:
        every: Actions between validations, over all environments.
        drives: Their number.
        duration: Of each, s.
        seed: Of the drives; another one than ``task.episode.library_seed``.
        best: What the best agent is best in.
    """

    every: PositiveCount = 100_000
    drives: PositiveCount = 16
    duration: Positive = 60.0
    seed: Count = 1_000_000
    best: Measure = "cue_error"


@configuration
class CheckpointOptions:
    """What a training that was stopped goes on from.

    Args:
        every: Actions between checkpoints, over all environments; 0 for none but that of Ctrl-C.
        keep: Checkpoints kept, the latest.
    """

    every: Count = 500_000
    keep: PositiveCount = 2


@configuration
class Choice:
    """What a search may set a field to: one of ``choices``, or a number from ``low`` to ``high``.

    Args:
        choices: Values to choose from.
        low: Smallest number.
        high: Largest number.
        log: Whether numbers are drawn by their logarithm.
        integer: Whether numbers are whole.
    """

    choices: tuple[JsonValue, ...] = ()
    low: float | None = None
    high: float | None = None
    log: bool = False
    integer: bool = False

    def __post_init__(self) -> None:
        ranged = self.low is not None and self.high is not None
        if bool(self.choices) == ranged or (self.low is None) != (self.high is None):
            raise ValueError("give either choices, or low and high")
        if self.low is not None and self.high is not None:
            if self.low >= self.high:
                raise ValueError(f"low must be below high, found {self.low} and {self.high}")
            if self.log and self.low <= 0.0:
                raise ValueError(f"log needs a low above 0, found {self.low}")


@configuration
class PopulationOptions:
    """How a population is trained.

    Shares and factors are those of Jaderberg et al., "Population Based Training of Neural Networks", 2017,
    section 4.1.1; the rest is chosen.

    Args:
        members: Trainings.
        interval: Validations between exchanges.
        replaced: Share that goes on from the best, as many as those are.
        factors: What a value is multiplied by, one of them at random.
        redrawn: Probability that a value is drawn anew instead.
    """

    members: Annotated[int, Field(ge=2)] = 8
    interval: PositiveCount = 1
    replaced: Annotated[float, Field(gt=0.0, le=0.5)] = 0.2
    factors: tuple[Positive, Positive] = (0.8, 1.2)
    redrawn: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1


@configuration
class TrainingConfig:
    """A training; with its seed it determines the agent.

    Args:
        algo: The algorithm, by name.
        task: The environment: a task's name or file, or its fields, with the task they change as ``preset``.
            ``task.episode.drives`` stays empty: only random drives are trained on.
        base: What acts under the agent, where ``task.action.mode`` needs that: parameters of a washout, or
            the name or file of a washout, predictive control or an agent; default: ``task.action.base``,
            or "classical".
        initial: Agent, by file or name, whose network the training begins with; it sees and does the same.
        hyperparameters: Arguments of the algorithm.
        normalize: Running normalization.
        n_envs: Environments stepped together.
        group: Environments in the same drive, whose rewards are relative to each other's; for algorithms of
            Stable-Baselines3, see :class:`~.vec_env.DrivingSimulatorVecEnv`.
        steps: Actions in all, over all environments.
        seed: Of everything that is drawn.
        validation: How the agent is judged meanwhile.
        checkpoints: What a stopped training goes on from.
        log_every: Actions between rows of the log.
        threads: Of PyTorch.
        device: Of network and simulation: "cpu" or "cuda:0" and the like.
        search: What a search or a population varies: fields by path, as ``hyperparameters.learning_rate``.
        population: How a population is trained.
    """

    algo: str
    task: Annotated[TaskOptions, BeforeValidator(task_values)] = TaskOptions()
    base: AnyWashout | str | None = None
    initial: str | None = None
    hyperparameters: dict[str, JsonValue] = field(default_factory=dict)
    normalize: NormalizeOptions = NormalizeOptions()
    n_envs: PositiveCount = 64
    group: PositiveCount = 1
    steps: PositiveCount = 1_000_000
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    validation: ValidationOptions = ValidationOptions()
    checkpoints: CheckpointOptions = CheckpointOptions()
    log_every: PositiveCount = 10_000
    threads: PositiveCount = 1
    device: str = "cpu"
    search: dict[str, Choice] = field(default_factory=dict)
    population: PopulationOptions = PopulationOptions()

    def __post_init__(self) -> None:
        episode = self.task.episode
        if self.n_envs % self.group:
            raise ValueError(f"n_envs {self.n_envs} must be a multiple of group {self.group}")
        if self.algo not in algorithm_names():
            raise ValueError(f"algo must be one of {', '.join(algorithm_names())}, found {self.algo!r}")
        if episode.drives:
            raise ValueError(f"task.episode.drives names {', '.join(episode.drives)}: {EVALUATION_ONLY}")
        trained = set(drive_seeds(episode.library, episode.library_seed))
        if trained & set(drive_seeds(self.validation.drives, self.validation.seed)):
            raise ValueError(
                f"validation.seed {self.validation.seed} gives drives that are trained on; "
                "use another than task.episode.library_seed"
            )


def validation_task(config: TrainingConfig) -> TaskOptions:
    """The environment of the validation drives, on platforms of their own where these are drawn."""
    given, ranges = config.validation, config.task.randomization.platform
    episode = EpisodeOptions(
        random=config.task.episode.random,
        library=given.drives,
        library_seed=given.seed,
        drive_duration=given.duration,
        scale=config.task.episode.scale,
    )
    machines = RandomizationOptions(platform=ranges, platforms=given.drives)
    return replace(config.task, episode=episode, randomization=machines)


def load_config(algo: str | None, path: Path | None = None, **fields: Any) -> TrainingConfig:
    """An algorithm's default configuration, with what a file and arguments set instead.

    Args:
        algo: The algorithm; None for the one that the file names.
        path: YAML file with any of the fields, or one of :func:`recipe_names`; mappings are merged, all else
            replaces. ``search``, a ``task`` that names its ``preset`` and ``hyperparameters`` that name their
            ``policy`` are meant as a whole.
        **fields: Fields of :class:`TrainingConfig` that go before the file; None leaves one as it is.

    Raises:
        UnknownNameError: no algorithm has this name.
        DataError: the file cannot be read or is not YAML.
        ConfigurationError: a field is unknown, missing or out of range.
    """
    recipe = _RECIPES / f"{path}.yaml" if str(path) in recipe_names() else path
    given = {} if recipe is None else _fields(recipe)
    named = given.get("algo")
    if algo is not None and named not in (None, algo):
        raise ConfigurationError(f"{path}: it is for algo {named}, but --algorithm is {algo}; leave one out")
    name = algo or named
    if name is None:
        raise ConfigurationError(f"--algorithm is missing; use one of {', '.join(algorithm_names())}")
    default = preset_of(str(name))
    preset = {} if default is None else _fields(default)
    chosen = {key: value for key, value in fields.items() if value is not None}
    for key, entry in _WHOLE.items():
        values = (given.get(key), chosen.get(key))
        if any(isinstance(value, Mapping) and entry in value for value in values):
            preset = {name: value for name, value in preset.items() if name != key}
    merged = merge(merge(preset, given), {"algo": name, **chosen})
    if "search" in given:
        # What is varied is meant as a whole.
        merged["search"] = given["search"]
    config = from_dict(TrainingConfig, merged, str(path) if path is not None else f"--algorithm {name}")
    if isinstance(config.base, str) and Path(config.base).suffix in (".yaml", ".yml"):
        # The file may not be there any more when the training is resumed.
        config = replace(config, base=load_parameters(config.base))
    return config


def recipe_names() -> list[str]:
    """Names of the configurations that made the shipped agents."""
    return sorted(path.stem for path in _RECIPES.glob("*.yaml"))


def _fields(path: Path) -> dict[str, Any]:
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise ConfigurationError(f"{path}: expected fields with values, found {type(values).__name__}")
    return values

"""What an algorithm has to offer, so that run directory, log, validation and checkpoints work with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from ..envs.errors import ConfigurationError, DataError, UnknownNameError
from .agents import Network

if TYPE_CHECKING:
    from .config import TrainingConfig

Boundary = Callable[[], None]
"""Called between updates; may raise :class:`StopTraining`."""

State = Mapping[str, Any]
"""Nested mappings and lists of tensors, arrays, numbers, text and None."""


class StopTraining(Exception):  # noqa: N818  (as StopIteration, no error)
    """Ends :meth:`Learner.learn` at a boundary."""


@contextmanager
def restoring() -> Iterator[None]:
    """Within :meth:`Learner.restore`: what does not fit becomes a sentence.

    Raises:
        DataError: the state is of another configuration or version.
    """
    try:
        yield
    except (IndexError, KeyError, TypeError, ValueError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DataError(f"the checkpoint is of another configuration or version ({reason})") from None


class Learner(Protocol):
    """An algorithm in the middle of its work."""

    @property
    def steps(self) -> int:
        """Actions so far, over all environments."""
        ...

    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps.

        Args:
            boundary: Called before each round of experience, where :meth:`state` is everything there is.
        """
        ...

    def scalars(self) -> dict[str, float]:
        """What there is to log, means since the last call: ``rollout/...``, ``terms/...``, ``train/...``."""
        ...

    def network(self) -> Network:
        """The deterministic policy as it is now."""
        ...

    def state(self) -> dict[str, Any]:
        """Everything that :meth:`restore` needs to go on from a boundary as if nothing had happened."""
        ...

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises:
            DataError: it is of another configuration or version.
        """
        ...


# The algorithms by name; each is a module that is imported only when it is asked for.


_PRESETS: Final = Path(__file__).parent / "presets"


@dataclass(frozen=True)
class Algorithm:
    """A way to train.

    Args:
        name: As ``--algorithm`` takes it.
        module: Its module, by full name; has ``make_learner(config) -> Learner``.
        summary: One line.
        needs: Modules of other projects that it imports.
        preset: YAML file with its default configuration; None for ``presets/NAME.yaml`` of this package.
    """

    name: str
    module: str
    summary: str
    needs: tuple[str, ...] = ("torch", "stable_baselines3")
    preset: Path | None = None


_SB3: Final = "motion_cueing.train.algorithms.sb3.learner"
_CONTRIB: Final = ("torch", "stable_baselines3", "sb3_contrib")
_ALGORITHMS: Final[dict[str, Algorithm]] = {}


def register(algorithm: Algorithm) -> None:
    """Add an algorithm; one with the same name is replaced."""
    _ALGORITHMS[algorithm.name] = algorithm


for _algorithm in (
    Algorithm("ppo", _SB3, "proximal policy optimization"),
    Algorithm("sac", _SB3, "soft actor-critic"),
    Algorithm("td3", _SB3, "twin delayed deep deterministic policy gradient"),
    Algorithm("tqc", _SB3, "truncated quantile critics", _CONTRIB),
    Algorithm(
        "apg",
        "motion_cueing.train.algorithms.apg.learner",
        "analytic policy gradient, through the machine",
        ("torch",),
    ),
    Algorithm(
        "dagger",
        "motion_cueing.train.algorithms.dagger.learner",
        "imitation of a controller, with dataset aggregation",
        ("torch",),
    ),
    Algorithm(
        "linear",
        "motion_cueing.train.algorithms.linear.learner",
        "the best linear washout, by evolution: a beginning for apg",
        ("torch",),
    ),
):
    register(_algorithm)


def algorithm_names() -> list[str]:
    """Names ``--algorithm`` takes."""
    return list(_ALGORITHMS)


def get_algorithm(name: str) -> Algorithm:
    """An algorithm by name.

    Raises:
        UnknownNameError: no algorithm has this name.
    """
    if name not in _ALGORITHMS:
        raise UnknownNameError("algorithm", name, _ALGORITHMS)
    return _ALGORITHMS[name]


def preset_file(algorithm: Algorithm) -> Path:
    """The YAML file with an algorithm's default configuration."""
    return algorithm.preset or _PRESETS / f"{algorithm.name}.yaml"


def make_learner(config: TrainingConfig) -> Learner:
    """The learner of a configuration.

    Raises:
        ConfigurationError: a package is missing, or a hyperparameter is wrong.
    """
    algorithm = get_algorithm(config.algo)
    missing = [name for name in algorithm.needs if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"{config.algo} needs {', '.join(missing)}: pip install 'motion-cueing-gym[train]'"
        )
    make: Callable[[TrainingConfig], Learner] = import_module(algorithm.module).make_learner
    return make(config)

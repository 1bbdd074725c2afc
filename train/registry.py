"""Algorithms by name, and what an algorithm has to offer: a :class:`Learner`.

Run folder, log, validation, checkpoints, seeds, searches and populations then work with it. Another package
adds its own by ``motion_cueing.train.register``, or by an entry point::

    [project.entry-points."motion_cueing.algorithms"]
    my-algorithm = "my_package.algorithm:MyLearner"
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from ..envs.errors import DataError
from ..envs.registry import Registry

if TYPE_CHECKING:
    from .agents import PolicyNetwork
    from .config import TrainingConfig
    from .validation import Act

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
    except (IndexError, KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        if isinstance(error, DataError):
            raise
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DataError(f"the checkpoint is of another configuration or version ({reason})") from None


class Learner(ABC):
    """An algorithm in the middle of its work.

    Args:
        config: The training.

    Attributes:
        preset: YAML file with the default configuration; None for the defaults of ``TrainingConfig``.
    """

    preset: ClassVar[Path | None] = None

    @abstractmethod
    def __init__(self, config: TrainingConfig) -> None: ...

    @property
    @abstractmethod
    def steps(self) -> int:
        """Actions so far, over all environments."""

    @abstractmethod
    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps.

        Args:
            boundary: Called before each round of experience, where :meth:`state` is everything there is.
        """

    @abstractmethod
    def scalars(self) -> dict[str, float]:
        """What there is to log, means since the last call: ``rollout/...``, ``terms/...``, ``train/...``."""

    @abstractmethod
    def network(self) -> PolicyNetwork:
        """The deterministic policy as it is now."""

    def exploring(self, n: int) -> AbstractContextManager[Act | None]:
        """The policy as it explores, for ``n`` environments from the begin of their episodes.

        Within the block nothing is learned, and after it all random generators are as before.

        Returns:
            What yields the policy; None, as by default, where an algorithm does not explore by noise.
        """
        return nullcontext(None)

    @classmethod
    def advice(cls, config: TrainingConfig) -> list[str]:
        """Reasons why a configuration will hardly learn, a sentence each; none by default.

        Raises:
            ConfigurationError: it cannot learn at all.
        """
        return []

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Everything that :meth:`restore` needs to go on from a boundary as if nothing had happened."""

    @abstractmethod
    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises:
            DataError: it is of another configuration or version.
        """


ALGORITHMS: Final = Registry[type[Learner]]("algorithm", "motion_cueing.algorithms", extra="train")
"""Algorithms that ``--algorithm`` takes; their modules are imported when they are asked for."""

_SHIPPED: Final = "motion_cueing.train.algorithms"
for _name, _place, _summary in (
    ("ppo", "sb3.sb3:SB3Learner", "proximal policy optimization"),
    ("trpo", "sb3.sb3:SB3Learner", "trust region policy optimization"),
    ("recurrent-ppo", "sb3.sb3:SB3Learner", "proximal policy optimization of a network with a memory (LSTM)"),
    ("sac", "sb3.sb3:SB3Learner", "soft actor-critic"),
    ("td3", "sb3.sb3:SB3Learner", "twin delayed deep deterministic policy gradient"),
    ("tqc", "sb3.sb3:SB3Learner", "truncated quantile critics"),
    ("crossq", "sb3.sb3:SB3Learner", "soft actor-critic with batch normalization, without target networks"),
    ("apg", "apg.apg:ApgLearner", "analytic policy gradient, through the simulator"),
    ("dagger", "dagger.dagger:DaggerLearner", "imitation of a controller, with dataset aggregation"),
    ("linear", "linear.linear:LinearLearner", "the best linear washout, by evolution: a start for apg"),
):
    ALGORITHMS.register(_name, f"{_SHIPPED}.{_place}", _summary)


def register(
    name: str, learner: type[Learner] | str, description: str = "", *, replace: bool = False
) -> None:
    """Add an algorithm, which ``train --algo NAME`` then takes.

    Args:
        name: As ``--algorithm`` takes it.
        learner: The class, or ``"module:attribute"`` where to find it.
        description: One line for lists.
        replace: Whether it takes the place of one of the same name.

    Raises:
        ConfigurationError: the name is not one word, or is taken.
    """
    ALGORITHMS.register(name, learner, description, replace=replace)


def algorithm_names() -> list[str]:
    """Names ``--algorithm`` takes."""
    return ALGORITHMS.names()


def preset_of(name: str) -> Path | None:
    """The YAML file with an algorithm's default configuration, or None.

    Raises:
        UnknownNameError: no algorithm has this name.
    """
    shipped = Path(__file__).parent / "presets" / f"{name}.yaml"
    return shipped if name in ALGORITHMS and shipped.exists() else ALGORITHMS[name].preset

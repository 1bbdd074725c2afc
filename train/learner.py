"""What an algorithm has to offer, so that run directory, log, validation and checkpoints work with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

from ..envs.errors import DataError
from .agent import Network

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

"""CasADi's call after every iteration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..symbolic.library import Expression, cs


def listener(variables: int, constraints: int, parameters: int, tell: Callable[[int], None]) -> Expression:
    """A callback that tells how many iterations are done.

    Args:
        variables: Of the program.
        constraints: Of the program.
        parameters: Of the program.
        tell: What is told.
    """
    sizes = {"x": variables, "f": 1, "g": constraints, "lam_x": variables, "lam_g": constraints}

    class Listener(cs.Callback):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.done = 0
            self.construct("listener", {})

        def get_n_in(self) -> int:
            return int(cs.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, i: int) -> Any:
            return cs.Sparsity.dense(sizes.get(cs.nlpsol_out(i), parameters), 1)

        def eval(self, arguments: Any) -> list[int]:
            self.done += 1
            tell(self.done)
            return [0]

    return Listener()

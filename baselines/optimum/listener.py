"""What goes on during a solve: its iterations, and Ctrl-C, which ends it after the iteration at hand."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..symbolic.library import Expression, cs

Tell = Callable[[int], None]


class Watch:
    """Hears of iterations, and remembers whether an end was asked for.

    Args:
        tell: Called with the number of iterations done.
    """

    def __init__(self, tell: Tell | None = None) -> None:
        self._tell = tell
        self._done = 0
        self._asked = False

    def heard(self) -> bool:
        """One more iteration is done; returns whether to stop."""
        self._done += 1
        if self._tell is not None:
            self._tell(self._done)
        return self._asked

    @contextmanager
    def solving(self) -> Iterator[None]:
        """A solve.

        CasADi would take a KeyboardInterrupt for a function that cannot be evaluated, and go on.

        Raises:
            KeyboardInterrupt: at the end of the solve, if Ctrl-C was pressed in it.
        """
        self._done, self._asked = 0, False
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = signal.signal(signal.SIGINT, lambda number, frame: self._ask())
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
        if self._asked:
            raise KeyboardInterrupt

    def _ask(self) -> None:
        self._asked = True


def listener(variables: int, constraints: int, parameters: int, watch: Watch) -> Expression:
    """CasADi's call after every iteration.

    Args:
        variables: Of the program.
        constraints: Of the program.
        parameters: Of the program.
        watch: Who hears of it.
    """
    sizes = {"x": variables, "f": 1, "g": constraints, "lam_x": variables, "lam_g": constraints}

    class Listener(cs.Callback):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.construct("listener", {})

        def get_n_in(self) -> int:
            return int(cs.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, i: int) -> Any:
            return cs.Sparsity.dense(sizes.get(cs.nlpsol_out(i), parameters), 1)

        def eval(self, arguments: Any) -> list[int]:
            return [int(watch.heard())]

    return Listener()

"""One thread for small matrices.

BLAS shares a product among all cores. For matrices of this size that gains nothing on an idle machine, and on
a busy one the threads wait for each other: 130 ms instead of 1 ms was measured.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from ...envs.errors import ConfigurationError

try:
    from threadpoolctl import ThreadpoolController
except ImportError:
    raise ConfigurationError(
        "this controller needs threadpoolctl, which is not installed: "
        "pip install 'motion-cueing-gym[optimal]'"
    ) from None


class OneThread:
    """Holds the libraries that are loaded when it is made to one thread: ``with one_thread(): ...``."""

    def __init__(self) -> None:
        self._libraries: Any = ThreadpoolController()

    def __call__(self) -> AbstractContextManager[Any]:
        """For the length of a block."""
        return self._libraries.limit(limits=1, user_api="blas")  # type: ignore[no-any-return]

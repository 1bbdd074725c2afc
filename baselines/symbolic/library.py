"""CasADi where it is installed, else a sentence that says how to get it."""

from __future__ import annotations

from typing import Any

from ...envs.errors import ConfigurationError

try:
    import casadi
except ImportError:
    raise ConfigurationError(
        "this controller needs CasADi, which is not installed: pip install 'motion-cueing-gym[optimal]'"
    ) from None

cs: Any = casadi
"""The module ``casadi``."""

Expression = Any
"""A symbolic column vector or matrix: ``SX``, ``MX`` or ``DM``."""

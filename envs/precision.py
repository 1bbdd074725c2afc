"""The number types of every Warp kernel: one place that says single or double.

Double is the default. ``MOTION_CUEING_PRECISION=single`` in the environment, set before
the first import, selects single precision (useful on consumer GPUs).
"""

from __future__ import annotations

import os
import sys
from typing import Any, Final

import numpy as np
import warp as wp

from .errors import ConfigurationError


def _initialise_quietly() -> None:
    """Start Warp without its greeting and its native warning on a machine that has no GPU."""
    wp.config.log_level = wp.LOG_ERROR
    sys.stderr.flush()
    saved, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        wp.init()
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)
    wp.config.log_level = wp.LOG_WARNING


_initialise_quietly()

_NAME: Final = os.environ.get("MOTION_CUEING_PRECISION", "double")
if _NAME not in ("single", "double"):
    raise ConfigurationError(f"MOTION_CUEING_PRECISION is {_NAME!r}; use 'single' or 'double'")

real: Any = wp.float64 if _NAME == "double" else wp.float32
"""Scalar type of the kernels."""

FLOAT: Final[type[np.floating[Any]]] = np.float64 if _NAME == "double" else np.float32
"""The same type for NumPy."""

vec2: Any = wp.types.vector(2, real)
vec3: Any = wp.types.vector(3, real)
vec6: Any = wp.types.vector(6, real)
vec9: Any = wp.types.vector(9, real)
mat22: Any = wp.types.matrix((2, 2), real)
mat33: Any = wp.types.matrix((3, 3), real)
mat63: Any = wp.types.matrix((6, 3), real)
mat65: Any = wp.types.matrix((6, 5), real)

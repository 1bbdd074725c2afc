"""Number types of the kernels, devices, and arrays that host and kernels share.

Kernels compute in double precision. ``MOTION_CUEING_PRECISION=single`` in the environment, set before the
first import, selects single precision (useful on consumer GPUs).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from .errors import ConfigurationError
from .storage import writable_cache


def _usual_kernel_cache() -> str:
    """Where Warp keeps compiled kernels by default."""
    try:
        from warp._src.build import appdirs  # type: ignore[attr-defined,unused-ignore]

        return str(appdirs.user_cache_dir(appname="warp", appauthor="NVIDIA", version=wp.config.version))
    except (ImportError, AttributeError):
        return str(Path.home() / ".cache" / "warp" / wp.__version__)


def _initialize_quietly() -> None:
    """Start Warp without its greeting and its native warning on a machine that has no GPU.

    Where its cache of kernels cannot be written, it gets a temporary one.
    """
    wp.config.log_level = wp.LOG_ERROR
    usual = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH") or _usual_kernel_cache()
    cache = writable_cache(Path(usual), "WARP_CACHE_PATH")
    if str(cache) != usual:
        wp.config.kernel_cache_dir = str(cache)
        # Workers say nothing again.
        os.environ["WARP_CACHE_PATH"] = str(cache)
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


_initialize_quietly()

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
vec7: Any = wp.types.vector(7, real)
vec9: Any = wp.types.vector(9, real)
vec9i: Any = wp.types.vector(9, int)
mat22: Any = wp.types.matrix((2, 2), real)
mat33: Any = wp.types.matrix((3, 3), real)
mat63: Any = wp.types.matrix((6, 3), real)
mat65: Any = wp.types.matrix((6, 5), real)

int_array: Any = wp.array(dtype=int)
bool_array: Any = wp.array(dtype=wp.bool)
pair_array: Any = wp.array(dtype=wp.vec2f)
float_rows: Any = wp.array2d(dtype=wp.float32)
real_rows: Any = wp.array2d(dtype=real)
"""Types of arrays that kernels take; those of floats are what an agent sees and does."""


def find_device(name: str) -> Any:
    """Warp's device of this name: "cpu", "cuda" or "cuda:0" and so on.

    Raises:
        ConfigurationError: this machine has no such device.
    """
    # Warp leaves the reason of a "cuda" that cannot be started in a RuntimeError.
    try:
        return wp.get_device(name)
    except (ValueError, RuntimeError):
        known = ", ".join(repr(device.alias) for device in wp.get_devices())
        why = "" if wp.is_cuda_available() else " (Warp finds no CUDA driver)"
        raise ConfigurationError(f"device is {name!r}; use one of {known}{why}") from None


class Mirror:
    """A device array and its image on the host; on the CPU both are the same memory.

    Args:
        shape: Of the array.
        dtype: Of its entries, a Warp type or struct.
        device: Where kernels work on it.
    """

    def __init__(self, shape: int | tuple[int, ...], dtype: Any, device: Any) -> None:
        host = wp.zeros(shape, dtype=dtype, device="cpu")
        self.view: NDArray[Any] = np.asarray(host.numpy())
        self.shared = bool(wp.get_device(device).is_cpu)
        self.array = host if self.shared else wp.zeros(shape, dtype=dtype, device=device)
        self._host = host

    def push(self) -> None:
        """Bring what the host wrote into :attr:`view` to the device."""
        if not self.shared:
            wp.copy(self.array, self._host)

    def pull(self) -> NDArray[Any]:
        """Bring what kernels wrote to the host, and return :attr:`view`."""
        if not self.shared:
            self.view[...] = self.array.numpy()
        return self.view

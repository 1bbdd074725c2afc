"""Where arrays live and kernels run."""

from __future__ import annotations

from typing import Any

import warp as wp

from .errors import ConfigurationError


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

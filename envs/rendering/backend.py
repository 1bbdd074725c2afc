"""pygame, imported when a picture is first wanted."""

from __future__ import annotations

import os
from importlib import import_module
from types import ModuleType

from ..errors import MotionCueingError


class RenderingUnavailableError(MotionCueingError, ImportError):
    """A package that draws or writes pictures is not installed."""


def load_pygame() -> ModuleType:
    """Pygame, without its greeting.

    Raises:
        RenderingUnavailableError: it is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    return load("pygame", "pygame-ce")


def load(module: str, package: str) -> ModuleType:
    """A module of the extra ``render``.

    Args:
        module: What is imported.
        package: The distribution it comes from.

    Raises:
        RenderingUnavailableError: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        raise RenderingUnavailableError(
            f"rendering needs {package}: pip install 'motion-cueing-gym[render]'"
        ) from None

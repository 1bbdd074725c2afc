"""Which versions and configuration made a result."""

from __future__ import annotations

import json
import math
import platform as python_platform
import shlex
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

from pydantic import JsonValue

from .results import Provenance
from .saved import Headed

DISTRIBUTION: Final = "motion-cueing-gym"
"""Name of this package for installers."""
_LIBRARIES: Final = ("numpy", "scipy", "warp-lang", "gymnasium", "matplotlib", "pydantic")


def package_version() -> str:
    """Version of this package."""
    return _version(DISTRIBUTION)


def versions() -> dict[str, str]:
    """This package, Python, the system, and the libraries that could change a number."""
    found = {
        DISTRIBUTION: package_version(),
        "python": python_platform.python_version(),
        "system": f"{python_platform.system()} {python_platform.machine()}",
    }
    return found | {name: _version(name) for name in _LIBRARIES}


def created() -> str:
    """Now: UTC, ISO 8601."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def head_of(kind: type[Headed], words: Sequence[str]) -> dict[str, Any]:
    """The fields of :class:`~.saved.Headed`.

    Args:
        kind: Of the results.
        words: The command line, program first.
    """
    return {
        "schema": kind.version,
        "command": shlex.join(words),
        "created": created(),
        "versions": versions(),
    }


def provenance(
    arguments: Sequence[str],
    platform: tuple[str, Mapping[str, Any]],
    car: tuple[str, Mapping[str, Any]],
    policies: Mapping[str, Mapping[str, str]],
) -> Provenance:
    """What made a result.

    Args:
        arguments: Of the command line, program first.
        platform: Name and configuration of the motion base.
        car: Name and configuration of the car.
        policies: Metadata of each policy.
    """
    configuration = {"platform": platform[1], "car": car[1], "policies": policies}
    return Provenance(
        command=shlex.join(arguments),
        created=created(),
        versions=versions(),
        platform=platform[0],
        car=car[0],
        configuration={key: plain(value) for key, value in configuration.items()},
    )


def plain(value: Any) -> JsonValue:
    """A configuration as JSON has it; what is not finite becomes null, JSON inside a string is opened."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return _opened(value)
    if value is None or isinstance(value, (bool, int)):
        return value
    return str(value)


def _opened(text: str) -> JsonValue:
    if not text.startswith(("{", "[")):
        return text
    try:
        return plain(json.loads(text))
    except json.JSONDecodeError:
        return text


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"

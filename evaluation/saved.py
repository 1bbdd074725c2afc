"""Results of any kind as JSON: written whole or not at all, read only if they are of the version known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TypeVar

from ..envs.errors import DataError
from ..envs.settings import from_dict, to_dict
from ..envs.storage import write_text

T = TypeVar("T")


def save_json(results: Any, path: str | Path) -> None:
    """Write a configuration, whose field ``schema`` is its version.

    Args:
        results: The configuration.
        path: The file.
    """
    write_text(path, json.dumps(to_dict(results), indent=1, allow_nan=False) + "\n")


def load_json(cls: type[T], path: str | Path, what: str, schema: int) -> T:
    """Read what :func:`save_json` wrote.

    Args:
        cls: The configuration.
        path: The file.
        what: It is called in messages.
        schema: The version known.

    Raises:
        DataError: the file is missing, broken, or of another version.
        ConfigurationError: a field is missing, unknown or wrong.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise DataError(f"{path}: cannot be read as {what} ({error})") from None
    found = values.get("schema") if isinstance(values, dict) else None
    if found != schema:
        raise DataError(f"{path}: {what} of version {found}, this package reads {schema}")
    return from_dict(cls, values, str(path))

"""Results of any kind as JSON: written whole or not at all, read only if they are of the version known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from typing_extensions import Self

from ..envs.errors import DataError
from ..envs.settings import configuration, from_dict, to_dict
from ..envs.storage import write_text

T = TypeVar("T")


class Saved:
    """A configuration that is kept in a file, and has a field ``schema``.

    Attributes:
        what: It is called in messages.
        version: Of its file; a reader refuses others.
    """

    what: ClassVar[str]
    version: ClassVar[int]

    def save_json(self, path: str | Path) -> None:
        """Write it, whole or not at all."""
        save_json(self, path)

    @classmethod
    def load_json(cls, path: str | Path) -> Self:
        """Read what :meth:`save_json` wrote.

        Raises:
            DataError: the file is missing, broken, or of another version.
            ConfigurationError: a field is missing, unknown or wrong.
        """
        return load_json(cls, path, cls.what, cls.version)


@configuration
class Headed(Saved):
    """Results that begin with what made them; see ``provenance.head_of``.

    Args:
        schema: Version of the file.
        command: The command line.
        created: UTC, ISO 8601.
        versions: Of this package, Python and the libraries that matter.
    """

    schema: int
    command: str
    created: str
    versions: dict[str, str]


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

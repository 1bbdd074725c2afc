"""Results of any kind as JSON: written whole or not at all, and read from this and from earlier versions."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from typing_extensions import Self

from ..envs import provenance
from ..envs.errors import DataError
from ..envs.settings import configuration, from_dict, to_dict
from ..envs.storage import write_text


class Saved:
    """A configuration with a file of its own. Its field ``schema`` is the version of the file.

    Attributes:
        what: Its name in messages.
        version: Version that is written.
        oldest: Oldest version that is read.
    """

    what: ClassVar[str]
    version: ClassVar[int]
    oldest: ClassVar[int | None] = None

    def save_json(self, path: str | Path) -> None:
        """Write the file, whole or not at all."""
        write_text(path, json.dumps(to_dict(self), indent=1, allow_nan=False) + "\n")

    @classmethod
    def load_json(cls, path: str | Path) -> Self:
        """Read a file of this version, or of an earlier one that can be brought up to it.

        Raises:
            DataError: the file is missing, broken, or of another version.
            ConfigurationError: a field is missing, unknown or wrong.
        """
        try:
            values = json.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
            raise DataError(f"{path}: cannot be read as {cls.what} ({error})") from None
        schema = values.get("schema") if isinstance(values, dict) else None
        oldest = cls.version if cls.oldest is None else cls.oldest
        if not isinstance(schema, int) or not oldest <= schema <= cls.version:
            known = f"{cls.version}" if oldest == cls.version else f"{oldest} to {cls.version}"
            raise DataError(f"{path}: {cls.what} of version {schema}, this package reads {known}")
        return from_dict(cls, cls.upgrade(values) | {"schema": cls.version}, str(path))

    @classmethod
    def upgrade(cls, values: dict[str, Any]) -> dict[str, Any]:
        """The content of a file, with the structure of the current version."""
        return values


@configuration
class Headed(Saved):
    """Results that begin with their origin.

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

    @classmethod
    def head(cls, words: Sequence[str]) -> dict[str, Any]:
        """The fields above, for results made now.

        Args:
            words: The command line, program first.
        """
        return {
            "schema": cls.version,
            "command": shlex.join(words),
            "created": provenance.now(),
            "versions": provenance.versions(),
        }

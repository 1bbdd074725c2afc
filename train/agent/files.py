"""An agent's file: safetensors with one entry of metadata, JSON with version and checksum."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from ...envs.errors import DataError
from ...envs.storage import write_bytes

SUFFIX: Final = ".safetensors"

FORMAT: Final = 1
"""Version of the file; a reader refuses newer ones."""

_KEY: Final = "motion-cueing-agent"
_LENGTH: Final = 8
"""Bytes of the header's length, before the header, which begins with a brace."""


def write(path: str | Path, arrays: Mapping[str, NDArray[Any]], values: Mapping[str, Any]) -> None:
    """Write arrays and plain values, whole or not at all; the same contents give the same bytes."""
    about = {"format": FORMAT, "sha256": checksum(arrays, values), "contents": values}
    plain = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    # One entry: the library writes several in an order that changes.
    write_bytes(path, save(plain, metadata={_KEY: json.dumps(about, sort_keys=True)}))


def read(path: str | Path) -> tuple[dict[str, NDArray[Any]], Any]:
    """Arrays and plain values of a file that :func:`write` wrote.

    Raises:
        DataError: the file is missing, broken, something else, or of a newer version.
    """
    _check_kind(path)
    try:
        with safe_open(path, framework="numpy") as file:
            about = _about(path, file.metadata())
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, TypeError, OverflowError) as error:
        raise DataError(f"{path}: broken or cut off ({error}); copy or download it again") from None
    if about["sha256"] != checksum(arrays, about["contents"]):
        raise DataError(f"{path}: damaged, its checksum does not fit; copy or download it again")
    return arrays, about["contents"]


def checksum(arrays: Mapping[str, NDArray[Any]], values: Mapping[str, Any]) -> str:
    """SHA-256 of everything in a file: the values as sorted JSON, then the arrays by name."""
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _check_kind(path: str | Path) -> None:
    try:
        with open(path, "rb") as file:
            head = file.read(_LENGTH + 1)
    except FileNotFoundError:
        raise DataError(f"agent {path}: there is no such file") from None
    except OSError as error:
        raise DataError(f"agent {path}: cannot be read ({error.strerror})") from None
    if head[_LENGTH:] != b"{":
        raise _foreign(path)


def _about(path: str | Path, metadata: Mapping[str, str] | None) -> dict[str, Any]:
    if not metadata or _KEY not in metadata:
        raise _foreign(path)
    try:
        about = json.loads(metadata[_KEY])
        version = int(about["format"])
    except (ValueError, KeyError, TypeError):
        raise DataError(f"{path}: damaged, its description is no JSON; copy or download it again") from None
    if version > FORMAT:
        raise DataError(
            f"{path}: an agent of format {version}, this package reads {FORMAT}; update motion-cueing-gym"
        )
    if not {"sha256", "contents"} <= about.keys():
        raise DataError(f"{path}: damaged, its checksum or contents are missing; copy or download it again")
    return dict(about)


def _foreign(path: str | Path) -> DataError:
    return DataError(f"{path}: not an agent; expected a .safetensors file written by `motion-cueing train`")

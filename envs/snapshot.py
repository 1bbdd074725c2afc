"""Device arrays as plain bytes, to put a batch back where it was."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import DataError

Snapshot = dict[str, NDArray[Any]]
"""Arrays by name; those of kernels as bytes, which hold structs of any layout."""


def bytes_of(array: Any) -> NDArray[np.uint8]:
    """The content of a Warp array, flat."""
    return np.frombuffer(np.ascontiguousarray(array.numpy()).tobytes(), dtype=np.uint8).copy()


def put_bytes(array: Any, name: str, snapshot: Mapping[str, NDArray[Any]]) -> None:
    """Write the content called ``name`` into a Warp array, in place.

    Raises:
        DataError: it is missing or of another size: the snapshot is of another batch or version.
    """
    like = array.numpy()
    data = snapshot.get(name)
    if data is None or data.size != like.nbytes:
        found = "nothing" if data is None else f"{data.size} bytes"
        raise DataError(
            f"snapshot: {name} needs {like.nbytes} bytes, found {found}; it is of another batch or version"
        )
    array.assign(np.frombuffer(data.tobytes(), dtype=like.dtype).reshape(like.shape))

"""Checkpoints: one file each, with a checksum, read without executing anything in it."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from ..envs.errors import DataError
from ..envs.storage import replacing
from .learner import State

_MAGIC: Final = b"motion-cueing checkpoint 1\n"
_SUFFIX: Final = ".checkpoint"
_ARRAY: Final = "npy"


def checkpoint_file(folder: Path, steps: int) -> Path:
    """Where the checkpoint after so many actions lies; names sort by it."""
    return folder / f"step-{steps:012d}{_SUFFIX}"


def checkpoints_in(folder: Path) -> list[Path]:
    """The checkpoints in a folder, the oldest first."""
    return sorted(path for path in folder.glob(f"*{_SUFFIX}") if re.fullmatch(r"step-\d+", path.stem))


def write_checkpoint(path: Path, state: State) -> None:
    """Write a state, whole or not at all."""
    payload = io.BytesIO()
    torch.save(_packed(state), payload)
    data = payload.getbuffer()
    with replacing(path, "wb") as file:
        file.write(_MAGIC + hashlib.sha256(data).digest())
        file.write(data)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """A state that :func:`write_checkpoint` wrote.

    Raises:
        DataError: the file is missing, is none, or is damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror or error})") from None
    head = len(_MAGIC) + hashlib.sha256().digest_size
    if not data.startswith(_MAGIC):
        raise DataError(f"{path}: not a checkpoint of this version; {_advice(path)}")
    if hashlib.sha256(data[head:]).digest() != data[len(_MAGIC) : head]:
        raise DataError(f"{path}: damaged, its checksum does not match; {_advice(path)}")
    state: dict[str, Any] = _unpacked(torch.load(io.BytesIO(data[head:]), weights_only=True))
    return state


def _advice(path: Path) -> str:
    others = [other for other in checkpoints_in(path.parent) if other != path]
    if others:
        return f"delete it to go on from {others[-1].name}"
    return "there is no earlier one, begin anew"


def _packed(value: Any) -> Any:
    """Arrays, also those of structs, as the bytes of their own format: PyTorch takes only plain ones."""
    if isinstance(value, Mapping):
        return {name: _packed(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        payload = io.BytesIO()
        np.save(payload, value, allow_pickle=False)
        return {_ARRAY: torch.frombuffer(bytearray(payload.getvalue()), dtype=torch.uint8)}
    return value


def _unpacked(value: Any) -> Any:
    if isinstance(value, dict) and value.keys() == {_ARRAY}:
        return np.load(io.BytesIO(value[_ARRAY].numpy().tobytes()), allow_pickle=False)
    if isinstance(value, dict):
        return {name: _unpacked(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_unpacked(item) for item in value]
    return value

"""Files that are broken in every way, for each reader: byte by byte, and value by value.

A reader must answer each with a result or with one sentence of this package.
"""

from __future__ import annotations

import copy
import gzip
import io
import json
import random
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import MotionCueingError
from motion_cueing.envs.logs.proposal import propose
from motion_cueing.envs.logs.readers.registry import read_recording
from motion_cueing.envs.logs.units import FORCES, RATES
from motion_cueing.envs.platform.presets import get_platform, load_platform
from motion_cueing.envs.settings import to_dict
from motion_cueing.evaluation.trajectory import Trajectory
from motion_cueing.train.agents import Agent, get_agent
from motion_cueing.train.agents.files import write as write_agent
from motion_cueing.train.agents.names import FOLDER, SUFFIX

from .evaluation.synthetic import trajectory

WEIRD: tuple[Any, ...] = (
    None, True, -1, 0, 1, 10**12, 10**400, -0.0, 1e-320, 1e9, 1e308, float("nan"), float("inf"), "",
    "x" * 5000, "1e9", "paper", "\0", "\ud7ff", [], {}, [[]], [0.0] * 1000, {"a": {"b": []}}, "2024-01-01",
)  # fmt: skip
"""Values to put in the place of others."""

PIECES = (
    b"\0", b"\xff", b"\n", b",", b":", b"[", b"{", b"]", b"}", b"&a ", b"*a", b"- ", b"? ", b"! ", b"'",
    b"#", b"[" * 3000, b"{" * 3000, b"9" * 5000, b"1e999", b"nan", b"-", b"<<: ", b"PK\x01\x02", b"\x1f\x8b",
    b"\x93NUMPY", b"\xef\xbb\xbf", b";" * 2000, b"," * 2000,
)  # fmt: skip
"""Bytes to put into files."""


class Reader(NamedTuple):
    """How a kind of file is read, an unbroken one, and one with values changed by a generator."""

    read: Callable[[Path], Any]
    suffix: str
    whole: Callable[[], bytes]
    changed: Callable[[random.Random, Path], None] | None = None


def broken(content: bytes, rng: random.Random) -> bytes:
    """Some bytes cut, repeated, flipped or replaced."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(data) + 1)
        length = min(int(rng.expovariate(0.05)), 4000)
        match rng.randrange(5):
            case 0:
                del data[at : at + length]
            case 1:
                data[at:at] = data[at : at + length]
            case 2 if at < len(data):
                data[at] ^= 1 << rng.randrange(8)
            case 3:
                data[at : at + length * rng.randrange(2)] = rng.choice(PIECES)
            case _:
                data[at : at + length] = rng.randbytes(length)
    return bytes(data)


def with_changes(values: Any, rng: random.Random) -> Any:
    """Plain nested values, some of them weird, missing or under other names."""
    made = copy.deepcopy(values)
    for _ in range(rng.randint(1, 3)):
        place = made
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            if not keys:
                break
            key = rng.choice(keys)
            inner = place[key]
            if isinstance(inner, (dict, list)) and inner and rng.random() < 0.8:
                place = inner
                continue
            if rng.random() < 0.15:
                del place[key]
            elif rng.random() < 0.1 and isinstance(place, dict):
                place["unknown"] = place.pop(key)
            else:
                place[key] = copy.deepcopy(rng.choice(WEIRD))
            break
    return made


@cache
def _platform() -> dict[str, Any]:
    return to_dict(get_platform("paper"))


def _changed_platform(rng: random.Random, path: Path) -> None:
    path.write_text(yaml.safe_dump(with_changes(_platform(), rng)), encoding="utf-8", errors="replace")


@cache
def _agent() -> Agent:
    return get_agent("learned")


@cache
def _agent_file() -> bytes:
    return (FOLDER / f"learned{SUFFIX}").read_bytes()


def _changed_agent(rng: random.Random, path: Path) -> None:
    # With a right checksum, so that the contents themselves are read.
    arrays, contents = _agent()._contents()
    values = with_changes(to_dict(contents), rng)
    try:
        write_agent(path, arrays, values)
    except (ValueError, TypeError):
        path.write_bytes(b"")


@cache
def _cues() -> bytes:
    trace = CueTrace("a", 0.01 * np.arange(50), np.tile([0.0, 0.0, -9.81], (50, 1)), np.zeros((50, 3)))
    return _written(trace.to_csv, ".csv")


def _written(write: Callable[[Path], None], suffix: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"whole{suffix}"
        write(path)
        return path.read_bytes()


@cache
def _log() -> bytes:
    names = ("time", *FORCES, *RATES)
    rows = np.column_stack([0.01 * np.arange(300), *[np.sin(0.1 * np.arange(300))] * 6])
    return "\n".join([",".join(names), *(",".join(f"{x:.6g}" for x in row) for row in rows)]).encode()


def _read_log(path: Path) -> Any:
    return propose(read_recording(path))


@cache
def _trajectory() -> bytes:
    return _written(trajectory(20).save, ".npz")


def _changed_trajectory(rng: random.Random, path: Path) -> None:
    with np.load(io.BytesIO(_trajectory())) as file:
        arrays = {name: file[name] for name in file.files}
    about = with_changes(json.loads(str(arrays["about"])), rng)
    arrays["about"] = np.array(json.dumps(about))
    name = rng.choice(list(arrays))
    match rng.randrange(5):
        case 0:
            del arrays[name]
        case 1:
            with suppress(ValueError), np.errstate(all="ignore"):
                kind = rng.choice(["U3", "c16", "f2", "M8[s]", "?"])
                arrays[name] = arrays[name].astype(kind, casting="unsafe")
        case 2:
            arrays[name] = np.atleast_1d(arrays[name])[:-1]
        case _:
            pass
    with path.open("wb") as target:
        np.savez(target, **arrays)


READERS = {
    "platform": Reader(
        load_platform, ".yaml", lambda: yaml.safe_dump(_platform()).encode(), _changed_platform
    ),
    "cues": Reader(CueTrace.from_csv, ".csv", _cues),
    "packed cues": Reader(CueTrace.from_csv, ".csv.gz", lambda: gzip.compress(_cues(), mtime=0)),
    "log": Reader(_read_log, ".csv", _log),
    "trajectory": Reader(Trajectory.load, ".npz", _trajectory, _changed_trajectory),
    "agent": Reader(Agent.load, ".safetensors", _agent_file, _changed_agent),
}


def attack(name: str, seed: int, folder: Path) -> str:
    """Break a file by a seed and read it.

    Returns:
        The sentence that refuses it; empty where it was read.

    Raises:
        AssertionError: the sentence has several lines, or does not name the file.
        Exception: whatever else the reader raises: a defect.
    """
    rng, reader = random.Random(seed), READERS[name]
    path = folder / f"broken{reader.suffix}"
    if reader.changed is not None and rng.random() < 0.5:
        reader.changed(rng, path)
    else:
        path.write_bytes(broken(reader.whole(), rng))
    try:
        reader.read(path)
    except MotionCueingError as error:
        text = str(error)
        assert text.isprintable(), text
        return text
    return ""

"""Plans kept from one run to the next, by a hash of all that they follow from.

They lie in the folder ``optimum`` of :func:`~..cache.cache_folder`.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
import zlib
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from ...envs.settings import to_dict
from ...envs.storage import write_bytes
from ..cache import cache_folder
from .options import OptimumOptions
from .plan import Account, Plan

FORMULATION: Final = 3
"""Version of the program: what changes its solutions raises it."""


def plans_folder() -> Path:
    """Where plans are kept."""
    return cache_folder() / "optimum"


def key_of(
    platform: Platform,
    options: OptimumOptions,
    vestibular: VestibularModel,
    cues: CueTrace,
    start: NDArray[np.float64],
) -> str:
    """SHA-256 of everything that a plan follows from; names and descriptions do not count."""
    machine = to_dict(platform)
    for name in ("name", "description"):
        del machine[name]
    settings = [FORMULATION, machine, to_dict(options), to_dict(vestibular), round(cues.dt, 9)]
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for values in (cues.specific_force, cues.angular_velocity, cues.angular_acceleration, start):
        digest.update(np.ascontiguousarray(values, dtype=np.float64).tobytes())
    return digest.hexdigest()


def keep(key: str, plan: Plan) -> None:
    """Keep a plan; where the folder cannot be written, nothing is kept."""
    buffer = io.BytesIO()
    account = plan.account.to_json()
    np.savez_compressed(
        buffer,
        accelerations=plan.accelerations,
        start=plan.start,
        account=np.array(account),
        checksum=np.array(_checksum(plan.accelerations, plan.start, account)),
    )
    try:
        write_bytes(_path(key), buffer.getvalue())
    except OSError:
        return


def find(key: str, steps: int) -> Plan | None:
    """The plan kept under a key; None where there is none, or a damaged one.

    Args:
        key: Of :func:`key_of`.
        steps: Time steps it must have.
    """
    try:
        with np.load(_path(key), allow_pickle=False) as file:
            accelerations, start = np.array(file["accelerations"]), np.array(file["start"])
            account, checksum = str(file["account"]), str(file["checksum"])
        if checksum != _checksum(accelerations, start, account) or len(accelerations) != steps:
            return None
        return Plan(accelerations, start, Account.from_json(account))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, DataError):
        return None


def _path(key: str) -> Path:
    return plans_folder() / f"{key}.npz"


def _checksum(accelerations: NDArray[np.float64], start: NDArray[np.float64], account: str) -> str:
    return hashlib.sha256(accelerations.tobytes() + start.tobytes() + account.encode()).hexdigest()

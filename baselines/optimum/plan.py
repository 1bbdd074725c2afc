"""Plans of whole drives: their cache on disk, and their playback through the machine's own step.

Plans lie in the folder ``optimum`` of :func:`~motion_cueing.envs.storage.cache_folder`, by a hash of all they
depend on. Playback tells whether a plan keeps every limit, its J, and the state that it leads to.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.limits import read_arrays
from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from ...envs.platform.kernels.step import SINGULAR
from ...envs.platform.machines import UNITY
from ...envs.settings import to_dict
from ...envs.simulator.simulator import N_AXES, Simulator, Snapshot
from ...envs.storage import cache_folder, write_bytes
from .program import OptimumOptions

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PlanReport:
    """Report of a solve.

    Args:
        objective: "J" or "perceived".
        claimed: Objective over the drive, as the program has it.
        played: Objective over the drive, of the plan played through the machine's step.
        windows: Number of windows.
        iterations: IPOPT's iterations, of all windows and their repetitions.
        widened: Repetitions of a window, as its plan met a limit between nodes or a singular pose.
        unconverged: Windows that ended without a minimum.
        braked: Windows without a plan that keeps the limits, in which the machine came to a stop.
        seconds: Wall-clock time.
    """

    objective: str
    claimed: float
    played: float
    windows: int
    iterations: int
    widened: int
    unconverged: int
    braked: int
    seconds: float

    def notes(self) -> dict[str, str]:
        """As text, for a trajectory's metadata."""
        return {f"optimum_{name}": f"{value}" for name, value in asdict(self).items()}

    def to_json(self) -> str:
        """For :meth:`from_json`."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> PlanReport:
        """The report in a text.

        Raises:
            DataError: it is none.
        """
        try:
            return cls(**json.loads(text))
        except (TypeError, ValueError) as error:
            raise DataError(f"not the report of a plan ({error})") from None


@dataclass(frozen=True, eq=False)
class Plan:
    """Accelerations for a drive.

    Args:
        accelerations: (n, 9) of every time step, in the order of ``AXES``; k leads to sample k + 1.
        start: (9,) pose at the first sample.
        report: How they were found.
    """

    accelerations: NDArray[np.float64]
    start: NDArray[np.float64]
    report: PlanReport

    def __post_init__(self) -> None:
        shape = np.shape(self.accelerations)
        if len(shape) != 2 or shape[1] != N_AXES or not np.all(np.isfinite(self.accelerations)):
            raise DataError(f"a plan needs finite accelerations of shape (n, {N_AXES}), found {shape}")


FORMULATION: Final = 3
"""Version of the program: a change of its solutions raises it."""


def plans_folder() -> Path:
    """Folder of the stored plans."""
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
    if platform.braking.jerk is None:
        # Plans of before this option stay valid.
        del machine["braking"]
    settings = [FORMULATION, machine, to_dict(options), to_dict(vestibular), round(cues.dt, 9)]
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for values in (cues.specific_force, cues.angular_velocity, cues.angular_acceleration, start):
        digest.update(np.ascontiguousarray(values, dtype=np.float64).tobytes())
    return digest.hexdigest()


def store_plan(key: str, plan: Plan) -> None:
    """Store a plan; nothing happens where the folder cannot be written."""
    buffer = io.BytesIO()
    account = plan.report.to_json()
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


def load_plan(key: str, steps: int) -> Plan | None:
    """The plan of some time steps stored under a key; None where there is none, or a damaged one."""
    try:
        file = read_arrays(_path(key))
        accelerations, start = file["accelerations"], file["start"]
        account, checksum = str(file["account"]), str(file["checksum"])
        if checksum != _checksum(accelerations, start, account) or len(accelerations) != steps:
            return None
        return Plan(accelerations, start, PlanReport.from_json(account))
    except (KeyError, ValueError):
        return None


def _path(key: str) -> Path:
    return plans_folder() / f"{key}.npz"


def _checksum(accelerations: NDArray[np.float64], start: NDArray[np.float64], account: str) -> str:
    return hashlib.sha256(accelerations.tobytes() + start.tobytes() + account.encode()).hexdigest()


_LIMIT_SHARE: Final = 1.0 - 1e-4
"""Share of the limits of playback, so that braking, which uses them fully, meets none by round-off."""


@dataclass(frozen=True)
class Playback:
    """Accelerations played through the machine's step.

    Args:
        accelerations: (n, 9) that the machine followed.
        clean: Whether no limit was met, so that they are the plan's.
        states: (n,) rows of ``Simulator.state``.
    """

    accelerations: Floats
    clean: bool
    states: NDArray[Any]

    @property
    def singular(self) -> bool:
        """Whether the machine stopped before a singular pose."""
        return bool(np.any(self.states["limits"] & np.uint64(SINGULAR)))


class Player:
    """A machine without lag or dead time on its way through a drive, from a start pose (9,)."""

    def __init__(
        self, platform: Platform, cues: CueTrace, vestibular: VestibularModel, start: ArrayLike
    ) -> None:
        self._simulator = Simulator(_reduced(platform), cues, vestibular=vestibular, dt=cues.dt)
        self._simulator.reset(start)

    @property
    def state(self) -> Any:
        """A row of ``Simulator.state``."""
        return self._simulator.state[0]

    def snapshot(self) -> Snapshot:
        """For :meth:`restore`."""
        return self._simulator.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot."""
        self._simulator.restore(snapshot)

    def play(self, accelerations: Floats) -> Playback:
        """Follow accelerations (n, 9)."""
        states = np.zeros(len(accelerations), dtype=self._simulator.state.dtype)
        if np.all(np.isfinite(accelerations)):
            for k, acceleration in enumerate(accelerations):
                states[k] = self._simulator.step(acceleration)[0]
            return Playback(accelerations, not np.any(states["limits"]), states)
        return Playback(accelerations, False, states)

    def brake(self, steps: int) -> Playback:
        """Come to rest as fast as every actuator may, and stand."""
        states = np.zeros(steps, dtype=self._simulator.state.dtype)
        for k in range(steps):
            states[k] = self._simulator.step(-self.rates() / self._simulator.dt)[0]
        return Playback(np.array(states["acceleration"], dtype=np.float64), True, states)

    def positions(self) -> Floats:
        """(9,) in the order of ``AXES``."""
        return _axes(self.state["motion"], "position", "displacement", "beta")

    def rates(self) -> Floats:
        """(9,) in the order of ``AXES``."""
        return _axes(self.state["motion"], "rate", "velocity", "beta_rate")


def _axes(motion: Any, actuators: str, linear: str, angular: str) -> Floats:
    parts = (motion[actuators][:2], motion[linear], motion[angular], motion[actuators][8:])
    return np.concatenate(parts).astype(np.float64).reshape(N_AXES)


def _reduced(platform: Platform) -> Platform:
    parts: dict[str, Any] = {}
    for name in ("carriage", "hexapod", "turntable"):
        part = getattr(platform, name)
        if part is not None:
            speed, force = _LIMIT_SHARE * part.velocity, _LIMIT_SHARE * part.acceleration
            parts[name] = replace(part, velocity=speed, acceleration=force, dynamics=UNITY)
    return replace(platform, **parts)

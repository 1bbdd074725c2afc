"""How far the kernel's state lies from the reference's, field by field."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from motion_cueing.envs.cues import CueTrace

from .setpoint import MotionState
from .simulator import ReferenceSimulator, ReferenceState

Rows = NDArray[Any]
CUES = ("force", "rate", "head_force")


def motion_of(rows: Rows) -> MotionState:
    """The kernel's Motion rows as the reference keeps them, copied."""
    return MotionState(
        rows["position"].copy(),
        rows["rate"].copy(),
        np.concatenate([rows["displacement"], rows["beta"]], axis=1),
        np.concatenate([rows["velocity"], rows["beta_rate"]], axis=1),
    )


def bits(rows: Rows) -> bytes:
    """The bytes of all fields of structured rows, without the padding between them."""
    if rows.dtype.names is None:
        return np.ascontiguousarray(rows).tobytes()
    return b"".join(bits(rows[name]) for name in rows.dtype.names)


def adopt(reference: ReferenceSimulator, kernel: Rows) -> None:
    """Let the reference go on from where the kernel's machine is."""
    reference.state.setpoint = motion_of(kernel["setpoint"])
    reference.state.motion = motion_of(kernel["motion"])
    reference.history[0] = reference.state.setpoint


def differences(kernel: Rows, reference: ReferenceState) -> dict[str, float]:
    """Largest deviation of each field, SI units."""
    pairs: dict[str, tuple[Any, Any]] = {"acceleration": (kernel["acceleration"], reference.acceleration)}
    for name, motion in (("setpoint", reference.setpoint), ("motion", reference.motion)):
        found = motion_of(kernel[name])
        for field in ("position", "rate", "pose", "pose_rate"):
            pairs[f"{name}.{field}"] = getattr(found, field), getattr(motion, field)
    for name, cues in (
        ("reference_cue", reference.reference),
        ("simulator_cue", reference.simulated),
    ):
        for field, values in zip(CUES, cues, strict=True):
            pairs[f"{name}.{field}"] = kernel[name][field], values
    for name in ("perceived_reference", "perceived_simulator"):
        sensed = np.concatenate([kernel[name]["force"], kernel[name]["rate"]], axis=1)
        pairs[name] = sensed, getattr(reference, name)
    assert np.array_equal(kernel["sample"], reference.sample)
    return {name: float(np.abs(found - expected).max()) for name, (found, expected) in pairs.items()}


def restless_drive(samples: int, dt: float = 0.01, seed: int = 0) -> CueTrace:
    """A drive of smooth random cues."""
    rng = np.random.default_rng(seed)
    time = dt * np.arange(samples)
    tones = rng.uniform(0.3, 6.0, size=(12, 6))
    phases = rng.uniform(0.0, 2.0 * np.pi, size=(12, 6))
    signals = np.sin(time[:, None, None] * tones + phases).sum(axis=1) / 12.0
    force = 2.0 * signals[:, :3] + [0.0, 0.0, -9.81]
    return CueTrace("restless", time, force, 0.3 * signals[:, 3:])

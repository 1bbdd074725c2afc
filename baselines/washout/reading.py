"""What a washout reads: from observations, or straight from the simulator's state."""

from __future__ import annotations

import warp as wp

from ...envs.cues import GRAVITY
from ...envs.observation import SCALES, SLICES
from ...envs.precision import real, vec2, vec3
from ...envs.state import State
from .structs import Reading


@wp.func
def triple(row: wp.array2d(dtype=real), i: int, first: int, scale: real) -> vec3:
    """Three entries of an observation in SI units."""
    return vec3(row[i, first], row[i, first + 1], row[i, first + 2]) * scale


@wp.func
def pair(row: wp.array2d(dtype=real), i: int, first: int, scale: real) -> vec2:
    """Two entries of an observation in SI units."""
    return vec2(row[i, first], row[i, first + 1]) * scale


@wp.func
def read_observation(row: wp.array2d(dtype=real), i: int) -> Reading:
    """What the algorithm needs of an observation; see ``envs.observation``."""
    one = real(1.0)
    seen = Reading()
    seen.force = triple(
        row, i, wp.static(SLICES["wanted_force"].start), real(wp.static(SCALES["wanted_force"]))
    ) - vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    seen.rate = triple(row, i, wp.static(SLICES["wanted_rate"].start), one)
    seen.carriage = pair(row, i, wp.static(SLICES["carriage"].start), real(wp.static(SCALES["carriage"])))
    seen.carriage_rate = pair(
        row, i, wp.static(SLICES["carriage_rate"].start), real(wp.static(SCALES["carriage_rate"]))
    )
    seen.displacement = triple(row, i, wp.static(SLICES["displacement"].start), one)
    seen.velocity = triple(row, i, wp.static(SLICES["velocity"].start), one)
    seen.beta = triple(row, i, wp.static(SLICES["beta"].start), one)
    seen.beta_rate = triple(row, i, wp.static(SLICES["beta_rate"].start), one)
    angle = pair(row, i, wp.static(SLICES["turntable"].start), one)
    seen.psi_t = wp.atan2(angle[0], angle[1])
    seen.psi_t_rate = row[i, wp.static(SLICES["turntable_rate"].start)]
    return seen


@wp.func
def read_state(state: State) -> Reading:
    """The same straight from the simulator's state."""
    p = state.setpoint
    seen = Reading()
    seen.force = state.wanted.force
    seen.rate = state.wanted.rate
    seen.carriage = vec2(p.position[0], p.position[1])
    seen.carriage_rate = vec2(p.rate[0], p.rate[1])
    seen.displacement = p.displacement
    seen.velocity = p.velocity
    seen.beta = p.beta
    seen.beta_rate = p.beta_rate
    seen.psi_t = p.position[8]
    seen.psi_t_rate = p.rate[8]
    return seen

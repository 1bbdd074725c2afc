"""What the washout's kernels hold: parameters, filter states, and what goes from block to block."""

from __future__ import annotations

import warp as wp

from ...envs.precision import mat33, real, vec2, vec3, vec9
from .filters import HighPassParameters


@wp.struct
class Parameters:
    """The kernel's form of :class:`~.parameters.WashoutParameters`."""

    force_scale: vec3
    force_limit: vec3
    rate_scale: vec3
    rate_limit: vec3
    hpr_roll: HighPassParameters
    hpr_pitch: HighPassParameters
    hpr_yaw: HighPassParameters
    rate_bandwidth: real
    tilt_gain: real  # 0 switches tilt coordination off
    tilt_frequency: real
    tilt_damping: real
    tilt_rate: real
    tilt_acceleration: real
    tilt_approach: real
    turntable_share: real  # k_T
    turntable_gain: real  # k_yr
    hps_x: HighPassParameters
    hps_y: HighPassParameters
    hpi_x: HighPassParameters
    hpi_y: HighPassParameters
    hpi_z: HighPassParameters
    carriage_share: real  # 0 leaves all to the hexapod
    lpc_frequency: real
    lpc_damping: real
    follow_frequency: real
    return_frequency: real
    cab: vec3  # D_o


@wp.struct
class Memory:
    """The states of all filters."""

    hpr_position: vec3
    hpr_velocity: vec3
    beta_hp: vec3  # beta1HP
    beta_hp_rate: vec3
    low_force: vec2  # fL
    low_force_rate: vec2
    tilt: vec2  # betaSL
    tilt_rate: vec2
    hps_position: vec2
    hps_velocity: vec2
    displacement: vec3  # Q'
    velocity: vec3
    carriage: vec2  # C'
    carriage_rate: vec2
    home: vec3  # Q' when the episode began
    recovery: real  # from 1 when a limit has held the machine back to 0 when that is long past
    psi_t_start: real  # where the turntable stood when the episode began
    psi_h_start: real  # the same of the hexapod's yaw


@wp.struct
class Reading:
    """What the algorithm reads from an observation."""

    force: vec3  # f_AA
    rate: vec3  # omega_AA
    carriage: vec2
    carriage_rate: vec2
    displacement: vec3
    velocity: vec3
    beta: vec3
    beta_rate: vec3
    psi_t: real  # within +-pi
    psi_t_rate: real


@wp.struct
class Rotation:
    """The rotational half of a step: beta_H and psi_T with their rates and accelerations."""

    beta: vec3
    beta_rate: vec3
    beta_acceleration: vec3
    psi_t: real
    psi_t_rate: real
    psi_t_acceleration: real


@wp.struct
class Command:
    """The accelerations of one step, and the filters after it."""

    action: vec9
    memory: Memory


@wp.struct
class Gains:
    """Factors before the high-passes that feed an integrator: 1 in the classical washout."""

    force: vec3  # on what HPS lets pass, in F_S
    rate: vec3  # on the Euler rates


@wp.struct
class Inputs:
    """What the high-passes of a step are driven by, before the gains."""

    euler_rates: vec3  # T_S omega'_AA
    missing: vec3  # a2S: what the translations must add, in F_S
    passed: vec3  # what HPS lets pass of it
    l_is: mat33


@wp.struct
class Step:
    """A step, and what it was driven by."""

    command: Command
    inputs: Inputs
    q: vec3  # acceleration of Q'

"""The cab's heading: rows and actions in axes that turn with the driver.

Carriage and displacement turn by the heading psi_T + psi_H, the hexapod's tilt by psi_T: roll and pitch are
about axes that its own yaw turns already.
"""

from __future__ import annotations

import warp as wp

from ..platform.state import Motion
from ..precision import real, vec2, vec3, vec9


@wp.func
def turned(x: real, y: real, angle: real) -> vec2:
    """A horizontal vector in axes that are turned by ``angle``."""
    c = wp.cos(angle)
    s = wp.sin(angle)
    return vec2(c * x + s * y, c * y - s * x)


@wp.func
def heading(m: Motion) -> real:
    """psi_T + psi_H."""
    return m.position[8] + m.beta[2]


@wp.func
def turned_axes(v: vec9, psi: real, psi_t: real) -> vec9:
    """Nine values in the order of ``AXES``, carriage and displacement turned by psi, tilt by psi_T."""
    carriage = turned(v[0], v[1], psi)
    surge = turned(v[2], v[3], psi)
    tilt = turned(v[5], v[6], psi_t)
    return vec9(carriage[0], carriage[1], surge[0], surge[1], v[4], tilt[0], tilt[1], v[7], v[8])


@wp.func
def to_cab(m: Motion, v: vec9) -> vec9:
    """Values of the axes in the cab's frame."""
    return turned_axes(v, heading(m), m.position[8])


@wp.func
def to_machine(m: Motion, v: vec9) -> vec9:
    """Values of the axes in the machine's frame, from the cab's."""
    return turned_axes(v, -heading(m), -m.position[8])


@wp.func
def motion_in_cab(m: Motion) -> Motion:
    """A motion whose carriage, displacement and tilt are given in the cab's frame."""
    psi = heading(m)
    psi_t = m.position[8]
    p = m.position
    r = m.rate
    c = turned(p[0], p[1], psi)
    c_rate = turned(r[0], r[1], psi)
    s = turned(m.displacement[0], m.displacement[1], psi)
    v = turned(m.velocity[0], m.velocity[1], psi)
    b = turned(m.beta[0], m.beta[1], psi_t)
    b_rate = turned(m.beta_rate[0], m.beta_rate[1], psi_t)
    out = Motion()
    out.position = vec9(c[0], c[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8])
    out.rate = vec9(c_rate[0], c_rate[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    out.displacement = vec3(s[0], s[1], m.displacement[2])
    out.velocity = vec3(v[0], v[1], m.velocity[2])
    out.beta = vec3(b[0], b[1], m.beta[2])
    out.beta_rate = vec3(b_rate[0], b_rate[1], m.beta_rate[2])
    return out

"""Machines the tests of this folder share."""

from __future__ import annotations

from dataclasses import replace

from motion_cueing.envs.platform import Platform, get_platform, platform_names
from motion_cueing.envs.platform.kernels import ActuatorDynamics

PRESETS = {name: get_platform(name) for name in platform_names()}
DT = 0.01


def with_dynamics(
    platform: Platform,
    carriage: ActuatorDynamics | None = None,
    hexapod: ActuatorDynamics | None = None,
    turntable: ActuatorDynamics | None = None,
) -> Platform:
    """The same machine with actuator dynamics in the subsystems named (those it has)."""
    changed = platform
    if carriage and platform.carriage:
        changed = replace(changed, carriage=replace(platform.carriage, dynamics=carriage))
    if hexapod:
        changed = replace(changed, hexapod=replace(platform.hexapod, dynamics=hexapod))
    if turntable and platform.turntable:
        changed = replace(changed, turntable=replace(platform.turntable, dynamics=turntable))
    return changed


def sluggish(platform: Platform) -> Platform:
    """Lag and dead time in every subsystem, each with its own figures."""
    return with_dynamics(
        platform,
        carriage=ActuatorDynamics(natural_frequency=10.0, damping=1.3, dead_time=0.05),
        hexapod=ActuatorDynamics(natural_frequency=30.0, dead_time=0.02),
        turntable=ActuatorDynamics(dead_time=0.03),
    )

"""The 6-DOF subjective vertical conflict model through repeated drives, one thread a drive."""

from __future__ import annotations

import warp as wp

from ...envs.arrays import int_array, real, vec3


@wp.struct
class Model:
    """Coefficients of :class:`~.sickness.ConflictModel`."""

    of_acceleration: real  # Ka
    of_rate: real  # Kw
    rate_feedback: real  # Kwc
    vertical_feedback: real  # Kvc
    acceleration_feedback: real  # Kac
    canal_long: real  # td, s
    canal_adaptation: real  # ta, s
    vertical_time: real  # tau, s
    half_conflict: real  # b, m/s^2
    incidence_time: real  # tI, s
    largest: real  # P, %


@wp.kernel(enable_backward=False, module="unique")
def repeat_drives(
    model: Model,
    force: wp.array2d(dtype=vec3),
    rate: wp.array2d(dtype=vec3),
    length: int_array,
    vertical: wp.array(dtype=vec3),
    steps: int,
    dt: real,
    incidence: wp.array(dtype=real),
) -> None:
    """Motion sickness incidence (%) after ``steps`` Euler steps of each drive, repeated.

    Args:
        model: Coefficients.
        force: (k, n) specific force at the head, in its own axes, m/s^2.
        rate: (k, n) angular velocity of the head, rad/s.
        length: (k,) samples of each drive.
        vertical: (k,) specific force at rest in the attitude in which each drive begins.
        steps: Of each drive in all.
        dt: Time step, s.
        incidence: (k,) result.
    """
    k = wp.tid()
    one = real(1.0)
    start = vertical[k]
    gravity = wp.length(start)
    g = start
    sensed = start
    expected = start
    integral = start / model.vertical_feedback
    canal = vec3()
    canal_rate = vec3()
    expected_canal = vec3()
    sick = real(0.0)
    sick_rate = real(0.0)
    damping = one / model.canal_long + one / model.canal_adaptation
    stiffness = one / (model.canal_long * model.canal_adaptation)
    j = int(0)
    for _ in range(steps):
        if j == length[k]:
            # The drive begins anew, in its own attitude.
            j = int(0)
            g = start
        f = force[k, j]
        w = rate[k, j]
        sensed_rate = damping * canal_rate + stiffness * canal + w
        expected_force = (
            model.of_acceleration * (f - g)
            + model.vertical_feedback * integral
            + model.acceleration_feedback * (f - sensed + expected)
        ) / (one + model.acceleration_feedback)
        expected_rate = (expected_canal + model.of_rate * w + model.rate_feedback * sensed_rate) / (
            one + model.rate_feedback
        )
        conflict = sensed - expected
        ratio = wp.length_sq(conflict) / (model.half_conflict * model.half_conflict)

        canal_acceleration = -damping * canal_rate - stiffness * canal - w
        sensed_change = (f - sensed) / model.vertical_time - wp.cross(sensed_rate, sensed)
        expected_change = (expected_force - expected) / model.vertical_time - wp.cross(
            expected_rate, expected
        )
        expected_canal_change = (
            -(expected_canal + model.of_rate * w + model.rate_feedback * (sensed_rate - expected_rate))
            / model.canal_long
        )
        sick_change = (
            model.largest * ratio / (one + ratio) - real(2.0) * model.incidence_time * sick_rate - sick
        ) / (model.incidence_time * model.incidence_time)

        canal = canal + dt * canal_rate
        canal_rate = canal_rate + dt * canal_acceleration
        sensed = sensed + dt * sensed_change
        expected = expected + dt * expected_change
        integral = integral + dt * conflict
        expected_canal = expected_canal + dt * expected_canal_change
        g = g - dt * wp.cross(w, g)
        g = g * (gravity / wp.length(g))
        sick = sick + dt * sick_rate
        sick_rate = sick_rate + dt * sick_change
        j += 1
    incidence[k] = sick

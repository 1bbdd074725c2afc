"""Simulation of plans: a batch of cars driven by the kernel, as cue traces."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..arrays import FLOAT, vec6
from ..cues import CueTrace
from ..errors import DataError
from .kernels.driver import COLUMNS, SUBSTEPS, Driver, DriverParameters, Row, Task, drive_all, vec4
from .kernels.vehicle import CarParameters
from .plans import DT, Path, Schedule, clothoids
from .road_roughness import RoadRoughness, shaking
from .vehicles import Car

Floats = NDArray[np.float64]

ROBOT: Final = Driver(hand_lag=0.02)
"""A steering robot: keeps the speed as a driver does, and turns the wheel as told, within 20 ms."""

_SPEED: Final = COLUMNS.index("speed_m_s")


@dataclass(frozen=True, eq=False)
class Plan:
    """What a car is to do.

    Args:
        name: Of the trace that comes out.
        car: Which car.
        path: The line to follow.
        schedule: The speed over time.
        steering: (n,) steering-wheel angles, rad, instead of following the path; one a sample of the
            schedule.
        driver: Who drives; the default driver, or a :data:`ROBOT` where ``steering`` is given.
        roughness: Of the road; None for a smooth one.
        source: For reports.
    """

    name: str
    car: Car
    path: Path
    schedule: Schedule
    steering: Floats | None = None
    driver: Driver | None = None
    roughness: RoadRoughness | None = None
    source: str = field(default="")

    def __post_init__(self) -> None:
        if self.steering is None:
            return
        if self.steering.shape != self.schedule.speed.shape or not np.isfinite(self.steering).all():
            raise DataError(f"{self.name}: steering must be {len(self.schedule)} finite angles, one a sample")

    @property
    def chosen_driver(self) -> Driver:
        """The driver, or the default one for this kind of plan."""
        if self.driver is not None:
            return self.driver
        return Driver() if self.steering is None else ROBOT


def straight(length: float = 1.0) -> Path:
    """A straight, level path."""
    return Path.of_curvature(clothoids([(0.0, 0.0)], length))


def simulate(plans: Sequence[Plan], device: str = "cpu") -> list[CueTrace]:
    """Drive every plan, all in one kernel launch.

    Args:
        plans: One a drive.
        device: A Warp device.

    Returns:
        One trace a plan, sampled at 100 Hz, at the origin of F_A, with the channels
        :data:`~.drive_kernel.COLUMNS`: accelerations are those of the point of the roll axis under the c.g.,
        in the road's frame; ``path_offset_m`` is the distance to the right of the path; throttle and brake
        are shares. On a rough road its shaking is added to all three cues.

    Raises:
        DataError: the car left the range of the model (a plan no car can follow).
    """
    if not plans:
        return []
    rows = _launch(plans, device)
    starts = np.cumsum([0, *(len(plan.schedule) for plan in plans)])
    return [_trace(plan, rows[a:b]) for plan, a, b in zip(plans, starts[:-1], starts[1:], strict=True)]


def _launch(plans: Sequence[Plan], device: str) -> Floats:
    tasks = _tasks(plans)
    cars = [fill(CarParameters(), plan.car) for plan in plans]
    drivers = [fill(DriverParameters(), plan.chosen_driver) for plan in plans]
    schedule = np.concatenate([_schedule_rows(plan) for plan in plans])
    paths = np.concatenate([plan.path.table() for plan in plans])
    result = wp.zeros(len(schedule), dtype=Row, device=device)
    inputs = [
        wp.array(cars, dtype=CarParameters, device=device),
        wp.array(drivers, dtype=DriverParameters, device=device),
        wp.array(tasks, dtype=Task, device=device),
        wp.array(paths.astype(FLOAT), dtype=vec6, device=device),
        wp.array(schedule.astype(FLOAT), dtype=vec4, device=device),
    ]
    wp.launch(drive_all, len(plans), inputs=[*inputs, SUBSTEPS], outputs=[result], device=device)
    return np.asarray(result.numpy(), dtype=np.float64)


def _tasks(plans: Sequence[Plan]) -> list[Any]:
    tasks, path_start, first = [], 0, 0
    for plan in plans:
        task = Task()
        task.path_start, task.path_points = path_start, len(plan.path)
        task.first, task.samples = first, len(plan.schedule)
        task.open_loop = int(plan.steering is not None)
        tasks.append(task)
        path_start += len(plan.path)
        first += len(plan.schedule)
    return tasks


def _schedule_rows(plan: Plan) -> Floats:
    steering = np.zeros(len(plan.schedule)) if plan.steering is None else plan.steering
    schedule = plan.schedule
    return np.column_stack((schedule.speed, schedule.acceleration, schedule.distance, steering))


def fill(target: Any, source: Any) -> Any:
    """Copy the numbers of a configuration, and of those inside it, to the fields of a Warp struct by name."""
    for item in dataclasses.fields(source):
        value = getattr(source, item.name)
        if dataclasses.is_dataclass(value):
            fill(target, value)
        elif hasattr(target, item.name):
            setattr(target, item.name, value)
    return target


def _trace(plan: Plan, rows: Floats) -> CueTrace:
    if not np.isfinite(rows).all():
        raise DataError(
            f"{plan.name}: {plan.car.name} left the range of the vehicle model; ask for less speed or bend"
        )
    force, rate, rate_derivative = rows[:, 0:3], rows[:, 3:6], rows[:, 6:9]
    if plan.roughness is not None:
        distance = np.cumsum(DT * rows[:, 9 + _SPEED])
        added = shaking(plan.car, plan.roughness, distance, DT)
        force, rate = force + added.force, rate + added.rate
        rate_derivative = rate_derivative + added.rate_derivative
    return CueTrace(
        name=plan.name,
        time=np.asarray(DT * np.arange(len(rows)), dtype=np.float64),
        specific_force=force,
        angular_velocity=rate,
        angular_acceleration=rate_derivative,
        channels={name: rows[:, 9 + k] for k, name in enumerate(COLUMNS)},
        source=plan.source or f"{plan.car.name}, vehicle model",
    )

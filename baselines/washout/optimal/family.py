"""The optimal washout: kernel values, ranges of a search, and the family itself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

from ....envs.arrays import mat22
from ....envs.platform.machines import Cab
from ..classical.family import (
    CARRIAGE_SPEED,
    COORDINATES,
    HEAVE_TRAVEL,
    TRAVEL,
    HighPass,
    WashoutParameters,
    kernel_parameters,
)
from ..families import Coordinate, Family
from ..kernels.launch import make_kernels
from ..policy import WashoutPolicy
from .design import OptimalParameters, StateSpace, design, discrete
from .kernels import (
    Line,
    OptimalKernelParameters,
    OptimalMemory,
    Plane,
    initial_optimal_memory,
    mat55,
    mat1010,
    optimal_washout,
    vec5,
    vec10,
)


def _frame(p: OptimalParameters, cab: Cab) -> Any:
    """The classical washout around the filters: scales, limits and split."""
    shared = ("force_scale", "force_limit", "rate_scale", "rate_limit", "turntable_share", "turntable_gain")
    values = {name: getattr(p, name) for name in (*shared, "lpc", "follow_frequency")}
    open_ = HighPass()
    return kernel_parameters(
        WashoutParameters(
            p.name, hpr=(open_,) * 3, hps=(open_,) * 2, hpi=(open_,) * 3, tilt=None,
            return_frequency=0.0, **values,
        ),
        cab,
    )  # fmt: skip


def _plane_struct(s: StateSpace) -> Any:
    k: Any = Plane()
    k.a, k.d = mat1010(*s.a.ravel()), mat22(*s.d.ravel())
    k.b_rate, k.b_force = vec10(*s.b[:, 0]), vec10(*s.b[:, 1])
    k.c_tilt, k.c_move = vec10(*s.c[0]), vec10(*s.c[1])
    return k


def _line_struct(s: StateSpace) -> Any:
    k: Any = Line()
    k.a, k.b, k.c, k.d = mat55(*s.a.ravel()), vec5(*s.b[:, 0]), vec5(*s.c[0]), float(s.d[0, 0])
    return k


def _values(p: OptimalParameters, cab: Cab, dt: float) -> Any:
    """The kernels' form of a parameter set: here the filters are designed."""
    solved = design(p)
    k: Any = OptimalKernelParameters()
    k.frame = _frame(p, cab)
    k.surge, k.sway = (_plane_struct(discrete(s.filter, dt)) for s in (solved.surge, solved.sway))
    k.heave, k.yaw = (_line_struct(discrete(s.filter, dt)) for s in (solved.heave, solved.yaw))
    return k


_BANDWIDTH: Final = (0.03, 10.0)
"""rad/s; from a push that lasts half a minute to the noise of a road."""
_RATE_ERROR: Final = (math.radians(0.3), math.radians(30.0))
"""A tenth of and ten times the indifference zone, beside that of the force, which stays."""
_INTEGRAL: Final = (0.1, 10000.0)
_TILT_SPEED: Final = (math.radians(0.5), 10.0)
_ACCELERATION: Final = (0.3, 100.0)
_TILT_PUSH: Final = (0.03, 30.0)
_HEAVE_INTEGRAL: Final = (0.003, 10.0)
_YAW: Final = (0.3, 1000.0)


def _plane(channel: str) -> list[Coordinate]:
    ranges = {
        "sensed_rate": _RATE_ERROR,
        "integral": _INTEGRAL,
        "displacement": TRAVEL,
        "velocity": CARRIAGE_SPEED,
        "tilt_rate": _TILT_SPEED,
        "acceleration": _ACCELERATION,
        "tilt_acceleration": _TILT_PUSH,
    }
    return [Coordinate(f"{channel}.{name}", *bounds) for name, bounds in ranges.items()]


_COORDINATES: Final = (
    *(c for c in COORDINATES if c.path.startswith(("force_", "rate_scale", "rate_limit"))),
    Coordinate("force_bandwidth", *_BANDWIDTH),
    Coordinate("rate_bandwidth", *_BANDWIDTH),
    *_plane("surge"),
    *_plane("sway"),
    Coordinate("heave.integral", *_HEAVE_INTEGRAL),
    Coordinate("heave.displacement", *HEAVE_TRAVEL),
    Coordinate("heave.velocity", *HEAVE_TRAVEL),
    Coordinate("heave.acceleration", *_ACCELERATION),
    Coordinate("yaw.angle", *_YAW),
    Coordinate("yaw.rate", *_YAW),
    Coordinate("yaw.acceleration", *_ACCELERATION),
    *(c for c in COORDINATES if c.path.startswith(("turntable", "lpc"))),
)

FAMILY: Final = Family(
    name="optimal",
    title="the optimal washout",
    parameters=OptimalParameters,
    kernels=make_kernels(
        OptimalKernelParameters, OptimalMemory, initial_optimal_memory, optimal_washout, _values
    ),
    presets=Path(__file__).parent / "presets",
    start="optimal-washout",
    coordinates=_COORDINATES,
)


class OptimalWashout(WashoutPolicy[OptimalParameters]):
    """The optimal washout as a policy; arguments as of :class:`~..policy.WashoutPolicy`.

    Raises:
        ConfigurationError: no filter is optimal for these weights in floating point.
    """

    algorithm = "optimal"

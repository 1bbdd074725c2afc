"""The optimal washout as a policy."""

from __future__ import annotations

from typing import Any, Final

from ....envs.arrays import mat22
from ....envs.platform.machines import Cab
from .. import HighPass, WashoutParameters
from ..policy import Family, WashoutPolicy, kernel_parameters, make_family
from .design import OptimalParameters, StateSpace, design, discrete, load_optimal
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


def _plane(s: StateSpace) -> Any:
    k: Any = Plane()
    k.a, k.d = mat1010(*s.a.ravel()), mat22(*s.d.ravel())
    k.b_rate, k.b_force = vec10(*s.b[:, 0]), vec10(*s.b[:, 1])
    k.c_tilt, k.c_move = vec10(*s.c[0]), vec10(*s.c[1])
    return k


def _line(s: StateSpace) -> Any:
    k: Any = Line()
    k.a, k.b, k.c, k.d = mat55(*s.a.ravel()), vec5(*s.b[:, 0]), vec5(*s.c[0]), float(s.d[0, 0])
    return k


def _values(p: OptimalParameters, cab: Cab, dt: float) -> Any:
    """The kernels' form of a parameter set: here the filters are designed."""
    solved = design(p)
    k: Any = OptimalKernelParameters()
    k.frame = _frame(p, cab)
    k.surge, k.sway = (_plane(discrete(s.filter, dt)) for s in (solved.surge, solved.sway))
    k.heave, k.yaw = (_line(discrete(s.filter, dt)) for s in (solved.heave, solved.yaw))
    return k


OPTIMAL: Final[Family] = make_family(
    OptimalKernelParameters, OptimalMemory, initial_optimal_memory, optimal_washout, _values
)
"""Filters from the Riccati equation."""


class OptimalWashout(WashoutPolicy[OptimalParameters]):
    """The optimal washout as a policy; arguments as of :class:`WashoutPolicy`.

    Raises:
        ConfigurationError: no filter is optimal for these weights in floating point.
    """

    family = OPTIMAL
    kind = OptimalParameters
    load = staticmethod(load_optimal)
    by_hand = "optimal-washout"

"""Which solver for predictive control? Programs from drives, each solver's time and exactness.

    python -m benchmarks.qp_solvers

Times are processor time of one thread for one program, set-up included, in ms. "excess" is the largest
cost above the best known, over that cost's size; "violation" the largest of a limit, in shares of its range.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
from collections.abc import Callable
from typing import Any

import clarabel
import daqp
import numpy as np
import osqp
import piqp
import quadprog
from rich.console import Console
from rich.table import Table
from scipy import sparse

from motion_cueing.baselines.mpc.solver import solve

from .qp_programs import Matrices, Program, collect, condensed, with_states

Solver = Callable[[Matrices], np.ndarray]
MANEUVERS = ("slalom", "step-steer", "roundabout")
_EXACT = 1e-7
"""Violation up to which an answer counts as within the limits."""


def by_daqp(m: Matrices) -> np.ndarray:
    return np.asarray(daqp.solve(m.p, m.q, m.g, m.upper, m.lower)[0])


def by_quadprog(m: Matrices) -> np.ndarray:
    rows = np.vstack([m.g, -m.g])
    return np.asarray(quadprog.solve_qp(m.p, -m.q, rows.T, np.concatenate([m.lower, -m.upper]))[0])


def by_piqp_dense(m: Matrices) -> np.ndarray:
    solver = piqp.DenseSolver()
    solver.setup(m.p, m.q, None, None, m.g, m.lower, m.upper)
    solver.solve()
    return np.asarray(solver.result.x)


def by_piqp(m: Matrices, backend: Any = None) -> np.ndarray:
    solver = piqp.SparseSolver()
    if backend is not None:
        solver.settings.kkt_solver = backend
    solver.setup(m.p, m.q, m.a, m.b, m.g, m.lower, m.upper)
    solver.solve()
    return np.asarray(solver.result.x)


def by_piqp_stages(m: Matrices) -> np.ndarray:
    return by_piqp(m, piqp.KKTSolver.sparse_multistage)


def by_clarabel(m: Matrices) -> np.ndarray:
    rows = sparse.csc_matrix(sparse.vstack([m.a, m.g, -m.g]))
    bound = np.concatenate([m.b, m.upper, -m.lower])
    cones = [clarabel.ZeroConeT(len(m.b)), clarabel.NonnegativeConeT(2 * len(m.upper))]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    p = sparse.csc_matrix(sparse.triu(m.p))
    return np.asarray(clarabel.DefaultSolver(p, m.q, rows, bound, cones, settings).solve().x)


class ByOsqp:
    """OSQP, begun where the last program ended if ``warm``."""

    def __init__(self, warm: bool) -> None:
        self._warm, self._last = warm, None

    def __call__(self, m: Matrices) -> np.ndarray:
        solver = osqp.OSQP()
        rows = sparse.csc_matrix(sparse.vstack([m.a, m.g]))
        bounds = [np.concatenate([m.b, side]) for side in (m.lower, m.upper)]
        p = sparse.csc_matrix(sparse.triu(m.p))
        solver.setup(p, m.q, rows, *bounds, verbose=False, eps_abs=1e-5, eps_rel=1e-5, max_iter=20000)
        if self._warm and self._last is not None:
            solver.warm_start(x=self._last.x, y=self._last.y)
        self._last = solver.solve()
        return np.asarray(self._last.x)


CONDENSED: dict[str, Solver] = {
    "DAQP": by_daqp,
    "quadprog": by_quadprog,
    "PIQP, dense": by_piqp_dense,
    "Clarabel": by_clarabel,
    "OSQP, warm": ByOsqp(warm=True),
}
SPARSE: dict[str, Solver] = {
    "PIQP, stages": by_piqp_stages,
    "PIQP": by_piqp,
    "Clarabel": by_clarabel,
    "OSQP": ByOsqp(warm=False),
    "OSQP, warm": ByOsqp(warm=True),
}


def by_screening(program: Program) -> np.ndarray:
    """What the controllers use; its time includes the rows' condensing."""
    solution = solve(program.problem, program.cost, program.about, program.bounds, program.active, 20)
    return np.asarray(solution.change.acceleration[:, program.problem.axes].ravel())


def timed(function: Callable[[Any], np.ndarray], argument: Any) -> tuple[float, np.ndarray | None]:
    """Seconds, and the answer; None where the solver gives up."""
    began = time.thread_time()
    try:
        answer = function(argument)
    except ValueError:
        return time.thread_time() - began, None
    return time.thread_time() - began, answer


def judged(program: Program, dense: Matrices, answer: np.ndarray | None) -> tuple[float, float]:
    """Cost and largest violation of an answer; NaN without one."""
    if answer is None or not np.isfinite(answer).all():
        return np.nan, np.nan
    cost = 0.5 * answer @ dense.p @ answer + dense.q @ answer
    rows = dense.g @ answer
    return float(cost), float(max(np.max(rows - dense.upper), np.max(dense.lower - rows), 0.0))


def measure(programs: list[Program]) -> dict[str, np.ndarray]:
    """(programs, 3) seconds, cost and violation of every solver."""
    dense = [condensed(program) for program in programs]
    whole = [with_states(program) for program in programs]
    runs = {f"{name}, condensed": (solver, dense) for name, solver in CONDENSED.items()}
    runs |= {f"{name}, sparse": (solver, whole) for name, solver in SPARSE.items()}
    found = {}
    for name, (function, inputs) in [("DAQP, screened rows", (by_screening, programs)), *runs.items()]:
        unknowns = [slice(None)] * len(programs) if inputs is not whole else [m.unknowns for m in whole]
        results = []
        for program, matrices, argument, chosen in zip(programs, dense, inputs, unknowns, strict=True):
            seconds, answer = timed(function, argument)
            answer = None if answer is None else answer[chosen]
            results.append((seconds, *judged(program, matrices, answer)))
        found[name] = np.array(results)
    return found


def table(found: dict[str, np.ndarray]) -> Table:
    """For people."""
    best = np.nanmin(
        [np.where(results[:, 2] < _EXACT, results[:, 1], np.nan) for results in found.values()], axis=0
    )
    out = Table("solver", "median ms", "p99 ms", "excess", "violation", "unsolved")
    for name, results in sorted(found.items(), key=lambda item: float(np.median(item[1][:, 0]))):
        excess = np.nanmax((results[:, 1] - best) / np.maximum(np.abs(best), 1e-3))
        out.add_row(
            name,
            f"{1e3 * np.median(results[:, 0]):.2f}",
            f"{1e3 * np.percentile(results[:, 0], 99):.2f}",
            f"{excess:.0e}",
            f"{np.nanmax(results[:, 2]):.0e}",
            f"{np.isnan(results[:, 1]).sum()}",
        )
    return out


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=20, help="every so many time steps one program")
    programs = collect(MANEUVERS, parser.parse_args().each)
    rows = condensed(programs[0]).g.shape
    Console().print(
        f"{len(programs)} programs of {rows[1]} unknowns and {rows[0]} limits", table(measure(programs))
    )


if __name__ == "__main__":
    main()

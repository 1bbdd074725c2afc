"""The quadratic programs that predictive control meets in drives, condensed and sparse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from motion_cueing.baselines.mpc import MpcParameters, load_mpc
from motion_cueing.baselines.mpc.policy import PredictiveController
from motion_cueing.baselines.mpc.prediction import (
    N_CUES,
    Grid,
    Linearization,
    MachineModel,
    cue_scales,
    make_grid,
)
from motion_cueing.baselines.mpc.solver import Bounds, HorizonProgram, Motion, Plan, Planner, QuadraticCost
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import rollout


@dataclass(frozen=True)
class Program:
    """One program: minimize ``cost`` over the change of a plan, within ``bounds`` of the linearized rows.

    ``active`` are the rows that held in the plan before.
    """

    problem: HorizonProgram
    cost: QuadraticCost
    about: Linearization
    bounds: Bounds
    plan: Motion
    reference_cue: np.ndarray
    active: np.ndarray


@dataclass(frozen=True)
class Matrices:
    """min 1/2 x'Px + q'x, A x = b, lower <= G x <= upper; ``unknowns`` are the accelerations among x."""

    p: Any
    q: np.ndarray
    a: Any
    b: np.ndarray
    g: Any
    lower: np.ndarray
    upper: np.ndarray
    unknowns: np.ndarray


def collect(maneuvers: tuple[str, ...], each: int) -> list[Program]:
    """Every ``each``-th program of the policy mpc-preview in some maneuvers."""
    platform, parameters = get_platform("paper"), load_mpc("mpc-preview")
    kept: list[tuple[Any, ...]] = []
    planner = _Recorder(platform, parameters, kept)
    for name in maneuvers:
        cues = get_maneuver(name).drive()
        rollout(PredictiveController(platform, parameters, "mpc-preview", planner, cues), cues, platform)
    return [_program(parameters, *arguments) for arguments in kept[::each]]


class _Recorder(Planner):
    def __init__(self, platform: Any, parameters: MpcParameters, kept: list[tuple[Any, ...]]) -> None:
        super().__init__(platform, parameters)
        self._kept = kept

    def __call__(self, *arguments: Any) -> Plan:
        self._kept.append(arguments)
        return super().__call__(*arguments)


def _program(
    parameters: MpcParameters, position: Any, rate: Any, reference: Any, guess: Any, active: Any, sensed: Any
) -> Program:
    platform = get_platform("paper")
    grid = make_grid(parameters.nodes)
    linearized = MachineModel(platform, len(grid.times), parameters.margins)
    problem = HorizonProgram(platform, parameters, grid)
    plan = Motion(*grid.motion(position, rate, guess), guess)
    about = linearized(plan.position, plan.rate, plan.acceleration)
    bounds = problem.bounds(linearized.lower, linearized.upper, reference)
    cost = problem.cost(plan, about, reference, sensed)
    return Program(problem, cost, about, bounds, plan, reference, active)


def condensed(program: Program) -> Matrices:
    """Dense, the states eliminated, the machine's limits as they are."""
    rows = program.problem.condensed(program.about.slopes[:, N_CUES:])
    n, k, size = rows.shape
    values = program.about.values[:, N_CUES:]
    return Matrices(
        p=program.cost.hessian,
        q=program.cost.gradient,
        a=np.zeros((0, size)),
        b=np.zeros(0),
        g=rows.reshape(n * k, size),
        lower=(program.bounds.lower[:, N_CUES:] - values).ravel(),
        upper=(program.bounds.upper[:, N_CUES:] - values).ravel(),
        unknowns=np.arange(size),
    )


def with_states(program: Program) -> Matrices:
    """Sparse, with positions and rates at the nodes: [dq, dv, da] node by node, nine axes each."""
    grid, about = program.problem.grid, program.about
    n, k = len(grid.times), len(program.problem.axes)
    slopes = about.slopes
    error = about.values[:, :N_CUES] - program.reference_cue / cue_scales()
    w = grid.weights
    blocks = [w[j] * slopes[j, :N_CUES].T @ slopes[j, :N_CUES] for j in range(n)]
    gradient = np.concatenate([w[j] * slopes[j, :N_CUES].T @ error[j] for j in range(n)])
    motion = sparse.csc_matrix(_motion(program.problem, n, k))
    state = np.hstack([program.plan.position, program.plan.rate, program.plan.acceleration]).ravel()
    values = about.values[:, N_CUES:]
    return Matrices(
        p=sparse.csc_matrix(sparse.block_diag(blocks) + motion),
        q=gradient + motion @ state,
        a=_dynamics(grid, k),
        b=np.zeros(2 * n * k),
        g=sparse.csc_matrix(sparse.block_diag([slopes[j, N_CUES:] for j in range(n)])),
        lower=(program.bounds.lower[:, N_CUES:] - values).ravel(),
        upper=(program.bounds.upper[:, N_CUES:] - values).ravel(),
        unknowns=np.arange(3 * n * k).reshape(n, 3, k)[:, 2].ravel(),
    )


def _motion(problem: HorizonProgram, n: int, k: int) -> np.ndarray:
    """Weights of the motion on [q, v, a] node by node."""
    whole = np.zeros((n, 3, k, n, 3, k))
    for axis, terms in enumerate(problem.motion_weights):
        for part, matrix in enumerate(terms):
            whole[:, part, axis, :, part, axis] = matrix
    return whole.reshape(3 * n * k, 3 * n * k)


def _dynamics(grid: Grid, k: int) -> Any:
    """Rows 0 = dq_j - ..., 0 = dv_j - ... of the straight lines between nodes; constant before the first."""
    n, unit = len(grid.times), np.eye(k)
    steps = np.diff(grid.times, prepend=0.0)
    whole = np.zeros((n, 2, k, n, 3, k))
    for j, h in enumerate(steps):
        whole[j, 0, :, j, 0], whole[j, 1, :, j, 1] = unit, unit
        if j == 0:
            whole[j, 0, :, j, 2], whole[j, 1, :, j, 2] = -0.5 * h**2 * unit, -h * unit
            continue
        whole[j, 0, :, j - 1, 0], whole[j, 0, :, j - 1, 1] = -unit, -h * unit
        whole[j, 0, :, j - 1, 2], whole[j, 0, :, j, 2] = -(h**2) / 3.0 * unit, -(h**2) / 6.0 * unit
        whole[j, 1, :, j - 1, 1] = -unit
        whole[j, 1, :, j - 1, 2], whole[j, 1, :, j, 2] = -0.5 * h * unit, -0.5 * h * unit
    return sparse.csc_matrix(whole.reshape(2 * n * k, 3 * n * k))

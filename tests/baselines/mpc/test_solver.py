"""The solver, against least squares and the conditions of a minimum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from motion_cueing.baselines.mpc import solver as solver_module
from motion_cueing.baselines.mpc.prediction import N_CUES, Linearization, cue_scales, make_grid
from motion_cueing.baselines.mpc.solver import Bounds, HorizonProgram, Motion, QpSolution, solve

from .machines import PAPER, quick

NODES = (0.01, 0.2, 0.7)
N, K = len(NODES), N_CUES + 5
NONE = np.zeros(0, dtype=np.intp)


class Case:
    """A random program: slopes of cues and of five limit rows."""

    def __init__(self, seed: int, width: float, price: float = 1e6) -> None:
        rng = np.random.default_rng(seed)
        self.grid = make_grid(NODES)
        self.program = HorizonProgram(PAPER, quick(nodes=NODES), self.grid)
        self.about = Linearization(rng.normal(size=(N, K)), rng.normal(size=(N, K, 27)))
        self.motion = Motion(*(rng.normal(size=(N, 9)) for _ in range(3)))
        self.reference_cue = rng.normal(size=(N, 6))
        self.cost = self.program.cost(self.motion, self.about, self.reference_cue, None)
        self.bounds = bounds_of(width, price)
        # All rows as they depend on the unknowns, node by node, by hand.
        at = np.zeros((N, K, N, 9))
        for j in range(N):
            for i in range(N):
                parts = self.about.slopes[j].reshape(K, 3, 9)
                at[j, :, i] = parts[:, 0] * self.grid.position[j, i] + parts[:, 1] * self.grid.rate[j, i]
                at[j, :, i] += parts[:, 2] * (i == j)
        self.rows = at.reshape(N * K, N * 9)

    def solve(self, guess: np.ndarray = NONE) -> QpSolution:
        return solve(self.program, self.cost, self.about, self.bounds, guess, 30)

    def unknowns(self, solution: QpSolution) -> np.ndarray:
        return solution.change.acceleration.ravel()


def bounds_of(width: float, price: float) -> Bounds:
    free = np.full((N, K), np.inf)
    upper = free.copy()
    upper[:, N_CUES:] = width
    prices = free.copy()
    prices[:, N_CUES:] = price
    return Bounds(-upper, upper, prices, np.zeros((N, K)))


def test_without_limits_it_is_least_squares():
    case = Case(0, np.inf)
    solution = case.solve()
    weights = np.sqrt(np.repeat(case.grid.weights, N_CUES))
    cues = case.rows.reshape(N, K, -1)[:, :N_CUES].reshape(N * N_CUES, -1)
    error = (case.about.values[:, :N_CUES] - case.reference_cue / cue_scales()).ravel()
    blocks, targets = [weights[:, None] * cues], [-weights * error]
    for axis, terms in enumerate(case.program.motion_weights):
        pick = np.eye(9)[axis]
        for maps, values, weight in zip(
            (case.grid.position, case.grid.rate, np.eye(N)),
            (case.motion.position, case.motion.rate, case.motion.acceleration),
            terms,
            strict=True,
        ):
            root = np.sqrt(weight)  # diagonal
            blocks.append(root @ np.kron(maps, pick))
            targets.append(-root @ values[:, axis])
    expected = np.linalg.lstsq(np.vstack(blocks), np.concatenate(targets), rcond=None)[0]
    assert solution.solved
    assert len(solution.active) == 0
    assert np.abs(case.unknowns(solution) - expected).max() < 1e-7 * np.abs(expected).max()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.1, 1.0, 3.0]))
def test_limits_hold_and_the_gradient_lies_in_the_cone_of_those_that_do(seed, width):
    case = Case(seed, width)
    solution = case.solve()
    z = case.unknowns(solution)
    values = case.about.values.ravel() + case.rows @ z
    low, high = case.bounds.lower.ravel(), case.bounds.upper.ravel()
    assert solution.solved
    assert np.all(values <= high + 1e-5)
    assert np.all(values >= low - 1e-5)
    normals = [case.rows[values >= high - 1e-5], -case.rows[values <= low + 1e-5]]
    gradient = case.cost.hessian @ z + case.cost.gradient
    cone = np.vstack(normals).T
    residual = nnls(cone, -gradient)[1] if cone.size else np.linalg.norm(gradient)
    assert residual < 1e-4 * (1.0 + np.linalg.norm(case.cost.gradient))


def test_the_solution_does_not_depend_on_where_the_search_begins():
    case = Case(7, 0.3)
    first = case.solve()
    again = case.solve(first.active)
    other = case.solve(np.array([N_CUES, N * K + N_CUES + 1]))
    assert len(first.active) > 0
    assert again.rounds <= first.rounds
    for solution in (again, other):
        assert np.abs(case.unknowns(solution) - case.unknowns(first)).max() < 1e-4


def test_limits_that_contradict_each_other_are_priced():
    case = Case(3, -0.5, price=2.0)  # an upper bound below the lower one
    solution = case.solve()
    assert solution.solved
    assert solution.relaxed >= 0.5
    z = case.unknowns(solution)
    values = case.about.values.ravel() + case.rows @ z
    gradient = case.cost.hessian @ z + case.cost.gradient
    # Multipliers of rows that are violated are the price itself.
    above, below = values > case.bounds.upper.ravel() + 1e-5, values < case.bounds.lower.ravel() - 1e-5
    rest = gradient + 2.0 * (case.rows[above].sum(axis=0) - case.rows[below].sum(axis=0))
    held = case.rows[np.isclose(np.abs(values), 0.5, atol=1e-5)]
    residual = np.linalg.norm(rest - held.T @ np.linalg.lstsq(held.T, rest, rcond=None)[0])
    assert residual < 1e-4 * np.linalg.norm(gradient - rest)


def test_a_solver_that_gives_up_is_told(monkeypatch):
    class Failing:
        @staticmethod
        def solve(*arguments):
            return np.zeros(1), 0.0, -1, {}

    monkeypatch.setattr(solver_module, "daqp", Failing)
    solution = Case(7, 0.3).solve()
    assert not solution.solved
    assert solution.rounds == 1
    assert not np.any(solution.change.acceleration)


@pytest.mark.parametrize("rounds", [1, 2, 30])
def test_rounds_are_the_duals_that_were_solved_and_bounded(monkeypatch, rounds):
    class Counting:
        calls = 0

        @classmethod
        def solve(cls, *arguments):
            cls.calls += 1
            return daqp.solve(*arguments)

    daqp = solver_module.daqp
    monkeypatch.setattr(solver_module, "daqp", Counting)
    case = Case(7, 0.01)
    solution = solve(case.program, case.cost, case.about, case.bounds, NONE, rounds)
    assert solution.rounds == Counting.calls <= rounds
    assert solution.solved == (rounds == 30)
    assert solution.solved or Counting.calls == rounds

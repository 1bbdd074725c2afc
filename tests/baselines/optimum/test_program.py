"""The nonlinear program: its matrices against differences, its filter against the kernel's."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines.optimum.program import (
    OptimumOptions,
    interval,
    mean_accelerations,
    node_limits,
    perceived_error_filter,
)
from motion_cueing.baselines.optimum.transcription import SolveMonitor, Transcription, blocks_of
from motion_cueing.baselines.symbolic import SymbolicMachine
from motion_cueing.envs.perception import get_vestibular_model, vestibular_model_names
from motion_cueing.envs.platform import get_platform

pytestmark = pytest.mark.slow

INTERVALS = 3


def program(objective: str, effort: float = 0.3) -> Transcription:
    machine = SymbolicMachine(get_platform("24-inch"))
    options = OptimumOptions(objective=objective, steps=2, effort=effort)
    perceived = None if objective == "J" else perceived_error_filter(get_vestibular_model("telban"), 0.01)
    part = interval(machine, options, perceived, 0.01)
    limits = node_limits(machine, part.q, part.v, part.a, 0.02, 0.01)
    return Transcription(blocks_of(part, limits, options), INTERVALS, {}, SolveMonitor())


def point(made: Transcription, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x = 0.1 * rng.normal(size=made.blocks.node_size * (INTERVALS + 1))
    return x, rng.normal(size=7 * 2 * INTERVALS)


def differences(function, x: np.ndarray, step: float = 1e-5) -> np.ndarray:
    columns = [(function(x + step * e) - function(x - step * e)) / (2.0 * step) for e in np.eye(len(x))]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("objective", ["J", "perceived"])
def test_gradient_and_jacobian_are_the_derivatives(objective):
    made = program(objective)
    x, p = point(made)
    gradient, jacobian = (made.solver.get_function(name) for name in ("nlp_grad_f", "nlp_jac_g"))

    def cost(at: np.ndarray) -> np.ndarray:
        return np.array(gradient(at, p)[0])[0]

    def values(at: np.ndarray) -> np.ndarray:
        return np.array(jacobian(at, p)[0])[:, 0]

    assert np.allclose(np.array(gradient(x, p)[1])[:, 0], differences(cost, x)[0], rtol=1e-6, atol=1e-5)
    assert np.allclose(jacobian(x, p)[1].full(), differences(values, x), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("objective", ["J", "perceived"])
def test_the_hessian_is_gauss_and_newtons_for_the_cost_and_exact_for_the_limits(objective):
    made = program(objective)
    x, p = point(made, seed=1)
    multipliers = np.random.default_rng(2).normal(size=made.constraints)
    multipliers[: made.gaps] = 0.0
    hessian = made.solver.get_function("nlp_hess_l")

    def whole(scale: float, weights: np.ndarray) -> np.ndarray:
        upper = hessian(x, p, scale, weights).full()
        return upper + np.triu(upper, 1).T

    jacobian = made.solver.get_function("nlp_jac_g")
    curvature = differences(lambda at: jacobian(at, p)[1].full().T @ multipliers, x)
    assert np.allclose(whole(0.0, multipliers), curvature, rtol=1e-4, atol=1e-4)
    of_cost = whole(2.0, 0.0 * multipliers)
    assert np.linalg.eigvalsh(of_cost).min() > -1e-9 * np.abs(of_cost).max()
    assert np.allclose(whole(2.0, multipliers), of_cost + whole(0.0, multipliers))


def test_the_hessian_is_exact_where_all_errors_are_zero():
    made = program("J", effort=0.0)
    x = np.zeros(made.blocks.node_size * (INTERVALS + 1))
    p = np.tile([0.0, 0.0, -9.81, 0.0, 0.0, 0.0, 1.0], 2 * INTERVALS)
    gradient, hessian = (made.solver.get_function(name) for name in ("nlp_grad_f", "nlp_hess_l"))
    upper = hessian(x, p, 1.0, np.zeros(made.constraints)).full()
    exact = differences(lambda at: np.array(gradient(at, p)[1])[:, 0], x)
    assert np.allclose(upper + np.triu(upper, 1).T, exact, rtol=1e-4, atol=1e-4)


def test_means_of_straight_lines_integrate_to_their_area():
    nodes = np.random.default_rng(3).normal(size=(5, 9))
    means = mean_accelerations(nodes, 4)
    assert np.allclose(means.reshape(4, 4, 9).mean(axis=1), 0.5 * (nodes[:-1] + nodes[1:]))


@pytest.mark.parametrize("name", vestibular_model_names())
def test_the_perceived_error_is_that_of_the_published_transfer_functions(name):
    """Its response to an oscillating error against the transfer functions at that frequency."""
    model, dt, frequency = get_vestibular_model(name), 0.01, 2.0
    perceived = perceived_error_filter(model, dt)
    z = np.exp(1j * frequency * dt)
    states = np.linalg.solve(z * np.eye(len(perceived.a)) - perceived.a, perceived.b)
    found = np.diag(perceived.c @ states) + perceived.d
    rows = [model.otoliths.transfer_function()] * 3 + [model.canals.transfer_function(i) for i in range(3)]
    s = 1j * frequency
    wanted = np.array([np.polyval(top, s) / np.polyval(bottom, s) for top, bottom in rows])
    assert np.abs(found / wanted - 1.0).max() < 1e-3

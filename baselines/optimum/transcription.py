r"""Direct transcription: a window of a drive as a nonlinear program for IPOPT, with structured derivatives.

Variables are w = [q, v, x, a] of every node, one node behind another. Those of an interval are z = [w, b],
with b the a of the next node. Constraints are the gaps of all intervals, then the limits at all nodes.

CasADi functions of one interval (:class:`Blocks`) are mapped over all of them, and their nonzeros are placed
into sparse matrices of the window. So nothing has to be found by coloring. The Hessian of the cost is that of
Gauss and Newton, which keeps every step a descent; that of the limits is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.progress import Interrupt
from ...envs.simulator.simulator import N_AXES
from ..symbolic import Expression, cs
from .program import Interval, NodeLimits, OptimumOptions, effort

OnIteration = Callable[[int], None]


class SolveMonitor:
    """Counts the iterations of a solve, for ``on_iteration``, and ends it on Ctrl-C after the one at hand."""

    def __init__(self, on_iteration: OnIteration | None = None) -> None:
        self._on_iteration = on_iteration
        self._iterations, self._interrupt = 0, Interrupt()

    def count(self) -> bool:
        """Count an iteration; returns whether to stop."""
        self._iterations += 1
        if self._on_iteration is not None:
            self._on_iteration(self._iterations)
        return self._interrupt.asked

    @contextmanager
    def solving(self) -> Iterator[None]:
        """Context of a solve.

        CasADi would take a KeyboardInterrupt for a function that cannot be evaluated, and go on.

        Raises:
            KeyboardInterrupt: at the end of the solve, if Ctrl-C was pressed in it.
        """
        self._iterations, self._interrupt = 0, Interrupt()
        with self._interrupt.caught():
            yield
        if self._interrupt.asked:
            raise KeyboardInterrupt


def iteration_callback(
    variables: int, constraints: int, parameters: int, monitor: SolveMonitor
) -> Expression:
    """CasADi's callback after every iteration of a program of this size."""
    sizes = {"x": variables, "f": 1, "g": constraints, "lam_x": variables, "lam_g": constraints}

    class Callback(cs.Callback):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.construct("iteration", {})

        def get_n_in(self) -> int:
            return int(cs.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, i: int) -> Any:
            return cs.Sparsity.dense(sizes.get(cs.nlpsol_out(i), parameters), 1)

        def eval(self, arguments: Any) -> list[int]:
            return [int(monitor.count())]

    return Callback()


Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Blocks:
    """CasADi functions of one interval, and of its first node.

    The Hessian of the cost is Gauss and Newton's: errors are taken as linear. It has no negative curvature,
    and near a good plan it is as good as the exact one. That of the limits is exact.

    Args:
        cost: (z, reference) to [errors' part, effort's part] (2,).
        gradient: (z, reference) to the gradient of their sum.
        hessian: (z, reference, scale) to the upper triangle of its Hessian times a scale.
        end: (z, reference) to q, v, x at the next node.
        end_jacobian: (z, reference) to its Jacobian.
        limits: (w) to the values of the inequalities.
        limits_jacobian: (w) to their Jacobian.
        limits_hessian: (w, multipliers) to the upper triangle of the Hessian of their weighted sum.
        node_size: Length of w.
        state_size: Length of q, v, x.
    """

    cost: Expression
    gradient: Expression
    hessian: Expression
    end: Expression
    end_jacobian: Expression
    limits: Expression
    limits_jacobian: Expression
    limits_hessian: Expression
    node_size: int
    state_size: int


def blocks_of(part: Interval, limits: NodeLimits, options: OptimumOptions) -> Blocks:
    """The functions of an interval with its limits; the mean of squared errors counts 1 a sample."""
    w = cs.vertcat(part.q, part.v, part.x, part.a)
    z = cs.vertcat(w, part.b)
    errors = part.errors / np.sqrt(options.steps)
    own = effort(part.q, part.v, part.a, part.b) * np.sqrt(options.effort)
    residuals = cs.vertcat(errors, own)
    slope = cs.jacobian(residuals, z)

    scale, lam = cs.SX.sym("scale"), cs.SX.sym("lam", limits.value.numel())
    curvature = cs.hessian(cs.dot(lam, limits.value), w)[0]

    def function(name: str, arguments: list[Expression], value: Expression) -> Expression:
        return cs.Function(name, arguments, [value], {"cse": True})

    inputs = [z, part.reference]
    return Blocks(
        cost=function("cost", inputs, cs.vertcat(cs.sumsqr(errors), cs.sumsqr(own))),
        gradient=function("gradient", inputs, cs.gradient(cs.sumsqr(residuals), z)),
        hessian=function("hessian", [*inputs, scale], cs.triu(2.0 * scale * slope.T @ slope)),
        end=function("end", inputs, part.end),
        end_jacobian=function("end_jacobian", inputs, cs.jacobian(part.end, z)),
        limits=function("limits", [w], limits.value),
        limits_jacobian=function("limits_jacobian", [w], cs.jacobian(limits.value, w)),
        limits_hessian=function("limits_hessian", [w, lam], cs.triu(curvature)),
        node_size=w.numel(),
        state_size=w.numel() - N_AXES,
    )


def interval_variables(blocks: Blocks) -> Indices:
    """Indices of the first interval's z among the variables of all nodes; the k-th lies k nodes further."""
    w = np.arange(blocks.node_size)
    return np.concatenate([w, blocks.node_size + w[-N_AXES:]])


def triplets(function: Expression) -> tuple[Indices, Indices]:
    """Rows and columns of the nonzeros of a function's matrix, in CasADi's order."""
    sparsity = function.sparsity_out(0)
    rows, columns = sparsity.get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)


def assembled(shape: tuple[int, int], parts: list[tuple[Indices, Indices, Expression]]) -> Expression:
    """A sparse matrix of parts: rows, columns and values (a column of symbols), no place twice."""
    rows, columns = (np.concatenate([part[i] for part in parts]) for i in range(2))
    order = np.lexsort((rows, columns))
    sparsity = cs.Sparsity.triplet(*shape, rows[order].tolist(), columns[order].tolist())
    return cs.MX(sparsity, cs.vertcat(*(part[2] for part in parts))[order.tolist()])


def repeated(indices: Indices, step: int, which: Indices) -> Indices:
    """Indices of a block, repeated: shifted by ``step`` times each of ``which``."""
    return (indices[None, :] + step * which[:, None]).ravel()


def nonzeros(matrix: Expression) -> Expression:
    """The nonzeros of a matrix as a column."""
    return matrix.nz[:]


_QUIET: Final = {"print_level": 0, "sb": "yes"}


class Transcription:
    """The program of a window of some intervals; what the car does and where it starts are its inputs.

    Args:
        blocks: Functions of one interval.
        intervals: How many there are.
        ipopt: Options of IPOPT.
        monitor: Counts iterations.
    """

    def __init__(self, blocks: Blocks, intervals: int, ipopt: dict[str, Any], monitor: SolveMonitor) -> None:
        self.blocks, self.intervals = blocks, intervals
        n = blocks.node_size
        self._x = cs.MX.sym("x", n * (intervals + 1))
        self._p = cs.MX.sym("p", blocks.cost.numel_in(1) * intervals)
        nodes = cs.reshape(self._x, n, intervals + 1)
        self._z = cs.vertcat(nodes[:, :-1], nodes[n - N_AXES :, 1:])
        self._nodes = nodes
        self._reference = cs.reshape(self._p, blocks.cost.size1_in(1), -1)
        self.gaps = blocks.state_size * intervals
        self.constraints = self.gaps + blocks.limits.numel_out(0) * (intervals + 1)
        # An attribute: CasADi keeps no reference to it.
        self._callback = iteration_callback(self._x.numel(), self.constraints, self._p.numel(), monitor)
        problem = {"x": self._x, "p": self._p, "f": self._cost(), "g": self._values()}
        options = {
            "grad_f": self._gradient(),
            "jac_g": self._jacobian(),
            "hess_lag": self._hessian(),
            "iteration_callback": self._callback,
            "print_time": False,
            "calc_lam_p": False,
            "ipopt": _QUIET | ipopt,
        }
        self.solver: Expression = cs.nlpsol("optimum", "ipopt", problem, options)

    def _map(self, function: Expression, *inputs: Expression) -> Expression:
        """A function of every interval."""
        return function.map(self.intervals)(*inputs)

    def _at_nodes(self, function: Expression, *inputs: Expression) -> Expression:
        """A function of every node."""
        return function.map(self.intervals + 1)(self._nodes, *inputs)

    def _cost(self) -> Expression:
        return cs.sum1(cs.sum2(self._map(self.blocks.cost, self._z, self._reference)))

    def _values(self) -> Expression:
        """End of every interval less the next node's state, then the limits at every node."""
        ends = self._map(self.blocks.end, self._z, self._reference)
        gaps = ends - self._nodes[: self.blocks.state_size, 1:]
        return cs.vertcat(cs.vec(gaps), cs.vec(self._at_nodes(self.blocks.limits)))

    def _gradient(self) -> Expression:
        n = self.blocks.node_size
        parts = self._map(self.blocks.gradient, self._z, self._reference)
        next_node = cs.vertcat(cs.MX(n - N_AXES, self.intervals), parts[n:, :])
        total = cs.horzcat(parts[:n, :], cs.MX(n, 1)) + cs.horzcat(cs.MX(n, 1), next_node)
        return cs.Function(
            "nlp_grad_f",
            [self._x, self._p],
            [self._cost(), cs.densify(cs.vec(total))],
            ["x", "p"],
            ["f", "grad_f_x"],
        )

    def _jacobian(self) -> Expression:
        blocks = self.blocks
        n, states, checks = blocks.node_size, blocks.state_size, blocks.limits.numel_out(0)
        intervals, nodes = np.arange(self.intervals), np.arange(self.intervals + 1)
        end_rows, end_columns = triplets(blocks.end_jacobian)
        limit_rows, limit_columns = triplets(blocks.limits_jacobian)
        ends = self._map(blocks.end_jacobian, self._z, self._reference)
        place = interval_variables(blocks)[end_columns]
        state = np.arange(states)
        parts = [
            (repeated(end_rows, states, intervals), repeated(place, n, intervals), nonzeros(ends)),
            (
                repeated(state, states, intervals),
                repeated(n + state, n, intervals),
                -cs.MX.ones(states * self.intervals),
            ),
            (
                self.gaps + repeated(limit_rows, checks, nodes),
                repeated(limit_columns, n, nodes),
                nonzeros(self._at_nodes(blocks.limits_jacobian)),
            ),
        ]
        matrix = assembled((self.constraints, n * (self.intervals + 1)), parts)
        return cs.Function(
            "nlp_jac_g", [self._x, self._p], [self._values(), matrix], ["x", "p"], ["g", "jac_g_x"]
        )

    def _hessian(self) -> Expression:
        scale, multipliers = cs.MX.sym("scale"), cs.MX.sym("lam_g", self.constraints)
        total = self._cost_hessian(scale) + self._limits_hessian(multipliers[self.gaps :])
        inputs, names = [self._x, self._p, scale, multipliers], ["x", "p", "lam_f", "lam_g"]
        return cs.Function("nlp_hess_l", inputs, [total], names, ["triu_hess_gamma_x_x"])

    def _cost_hessian(self, scale: Expression) -> Expression:
        """Of every second interval, and of those between: neighbors overlap."""
        blocks, size = self.blocks, self._x.numel()
        rows, columns = (interval_variables(blocks)[part] for part in triplets(blocks.hessian))
        parts = self._map(blocks.hessian, self._z, self._reference, cs.repmat(scale, 1, self.intervals))
        values = cs.reshape(nonzeros(parts), len(rows), self.intervals)
        total = cs.MX(size, size)
        for first in range(min(2, self.intervals)):
            which = np.arange(first, self.intervals, 2)
            places = (repeated(part, blocks.node_size, which) for part in (rows, columns))
            total += assembled((size, size), [(*places, cs.vec(values[:, which.tolist()]))])
        return total

    def _limits_hessian(self, multipliers: Expression) -> Expression:
        blocks, size, nodes = self.blocks, self._x.numel(), np.arange(self.intervals + 1)
        values = self._at_nodes(blocks.limits_hessian, cs.reshape(multipliers, -1, self.intervals + 1))
        places = (repeated(part, blocks.node_size, nodes) for part in triplets(blocks.limits_hessian))
        return assembled((size, size), [(*places, nonzeros(values))])

    def errors(self, x: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        """(intervals,) cost of the errors in each interval, without that of effort."""
        nodes = x.reshape(-1, self.blocks.node_size).T
        z = np.vstack([nodes[:, :-1], nodes[-N_AXES:, 1:]])
        reference = p.reshape(-1, self.blocks.cost.size1_in(1)).T
        return np.asarray(np.array(self.blocks.cost.map(self.intervals)(z, reference))[0])

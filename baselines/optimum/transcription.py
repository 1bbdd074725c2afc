"""A window of a drive as a nonlinear program for IPOPT.

    minimise    sum of squared errors / steps + effort
    subject to  the motion from node to node, and the limits at every node.

Variables are [q, v, x, a] of every node, one node behind another; constraints for each interval its end
and the limits there. The matrices are given to IPOPT as they follow from the structure, so that nothing is
found out by colouring, and a Hessian of Gauss and Newton keeps every step a descent.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.simulator import N_AXES
from ..symbolic.library import Expression, cs
from .assembly import assembled, nonzeros, repeated, triplets
from .blocks import Blocks, interval_variables
from .listener import Watch, listener

_QUIET: Final = {"print_level": 0, "sb": "yes"}


class Transcription:
    """The program of a window of some intervals; what the car does and where it starts are its inputs.

    Args:
        blocks: Functions of one interval.
        intervals: How many there are.
        ipopt: Options of IPOPT.
        watch: Hears of iterations.
    """

    def __init__(
        self,
        blocks: Blocks,
        intervals: int,
        ipopt: dict[str, Any],
        watch: Watch,
    ) -> None:
        self.blocks, self.intervals = blocks, intervals
        n = blocks.node_size
        self._x = cs.MX.sym("x", n * (intervals + 1))
        self._p = cs.MX.sym("p", blocks.cost.numel_in(1) * intervals)
        nodes = cs.reshape(self._x, n, intervals + 1)
        self._z = cs.vertcat(nodes[:, :-1], nodes[n - N_AXES :, 1:])
        self._nodes = nodes
        self._wanted = cs.reshape(self._p, blocks.cost.size1_in(1), -1)
        self.gaps = blocks.state_size * intervals
        self.constraints = self.gaps + blocks.limits.numel_out(0) * (intervals + 1)
        # An attribute: CasADi does not keep it.
        self._listener = listener(self._x.numel(), self.constraints, self._p.numel(), watch)
        problem = {"x": self._x, "p": self._p, "f": self._cost(), "g": self._values()}
        options = {
            "grad_f": self._gradient(),
            "jac_g": self._jacobian(),
            "hess_lag": self._hessian(),
            "iteration_callback": self._listener,
            "print_time": False,
            "calc_lam_p": False,
            "ipopt": _QUIET | ipopt,
        }
        self.solver: Expression = cs.nlpsol("optimum", "ipopt", problem, options)

    def _map(self, function: Expression, *given: Expression) -> Expression:
        """A function of every interval."""
        return function.map(self.intervals)(*given)

    def _at_nodes(self, function: Expression, *given: Expression) -> Expression:
        """A function of every node."""
        return function.map(self.intervals + 1)(self._nodes, *given)

    def _cost(self) -> Expression:
        return cs.sum1(cs.sum2(self._map(self.blocks.cost, self._z, self._wanted)))

    def _values(self) -> Expression:
        """End of every interval less the next node's state, then the limits at every node."""
        ends = self._map(self.blocks.end, self._z, self._wanted)
        gaps = ends - self._nodes[: self.blocks.state_size, 1:]
        return cs.vertcat(cs.vec(gaps), cs.vec(self._at_nodes(self.blocks.limits)))

    def _gradient(self) -> Expression:
        n = self.blocks.node_size
        parts = self._map(self.blocks.gradient, self._z, self._wanted)
        ahead = cs.vertcat(cs.MX(n - N_AXES, self.intervals), parts[n:, :])
        total = cs.horzcat(parts[:n, :], cs.MX(n, 1)) + cs.horzcat(cs.MX(n, 1), ahead)
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
        ends = self._map(blocks.end_jacobian, self._z, self._wanted)
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
        """Of every second interval, and of those between: neighbours overlap."""
        blocks, size = self.blocks, self._x.numel()
        rows, columns = (interval_variables(blocks)[part] for part in triplets(blocks.hessian))
        parts = self._map(blocks.hessian, self._z, self._wanted, cs.repmat(scale, 1, self.intervals))
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
        wanted = p.reshape(-1, self.blocks.cost.size1_in(1)).T
        return np.asarray(np.array(self.blocks.cost.map(self.intervals)(z, wanted))[0])

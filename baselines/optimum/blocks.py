"""Functions of one interval, made of its expressions, and where their parts lie among all nodes' variables.

A node's variables are w = [q, v, x, a]; an interval's are z = [w, b], b being the a of the next node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...envs.simulator import N_AXES
from ..symbolic.library import Expression, cs
from .effort import effort
from .interval import Interval
from .limits import NodeLimits
from .options import OptimumOptions

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Blocks:
    """CasADi functions of one interval, and of its first node.

    The Hessian of the cost is Gauss and Newton's, that of the sum of squares with errors taken as linear:
    it has no negative curvature, and near a good plan it is as good as the exact one. That of the limits
    is exact.

    Args:
        cost: (z, wanted) to [errors' part, effort's part] (2,).
        gradient: (z, wanted) to the gradient of their sum.
        hessian: (z, wanted, scale) to the upper triangle of its Hessian times a scale.
        end: (z, wanted) to q, v, x at the next node.
        end_jacobian: (z, wanted) to its Jacobian.
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

    def function(name: str, inputs: list[Expression], value: Expression) -> Expression:
        return cs.Function(name, inputs, [value], {"cse": True})

    given = [z, part.wanted]
    return Blocks(
        cost=function("cost", given, cs.vertcat(cs.sumsqr(errors), cs.sumsqr(own))),
        gradient=function("gradient", given, cs.gradient(cs.sumsqr(residuals), z)),
        hessian=function("hessian", [*given, scale], cs.triu(2.0 * scale * slope.T @ slope)),
        end=function("end", given, part.end),
        end_jacobian=function("end_jacobian", given, cs.jacobian(part.end, z)),
        limits=function("limits", [w], limits.value),
        limits_jacobian=function("limits_jacobian", [w], cs.jacobian(limits.value, w)),
        limits_hessian=function("limits_hessian", [w, lam], cs.triu(curvature)),
        node_size=w.numel(),
        state_size=w.numel() - N_AXES,
    )


def interval_variables(blocks: Blocks) -> Indices:
    """Where z of the first interval lies among the variables of all nodes; the k-th lies k nodes further."""
    w = np.arange(blocks.node_size)
    return np.concatenate([w, blocks.node_size + w[-N_AXES:]])

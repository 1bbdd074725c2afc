"""Sparse matrices of a whole window, put together of one small matrix an interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..symbolic.library import Expression, cs

Indices = NDArray[np.int64]


def triplets(function: Expression) -> tuple[Indices, Indices]:
    """Rows and columns of the nonzeros of a function's matrix, in CasADi's order."""
    sparsity = function.sparsity_out(0)
    rows, columns = sparsity.get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)


def assembled(shape: tuple[int, int], parts: list[tuple[Indices, Indices, Expression]]) -> Expression:
    """A sparse matrix of nonzeros at rows and columns, no place twice.

    Args:
        shape: Of the matrix.
        parts: Rows, columns and values (a column of symbols) of each part.
    """
    rows, columns = (np.concatenate([part[i] for part in parts]) for i in range(2))
    order = np.lexsort((rows, columns))
    sparsity = cs.Sparsity.triplet(*shape, rows[order].tolist(), columns[order].tolist())
    return cs.MX(sparsity, cs.vertcat(*(part[2] for part in parts))[order.tolist()])


def repeated(indices: Indices, step: int, which: Indices) -> Indices:
    """Indices of a block for each of its places: shifted by ``step`` times each of ``which``."""
    return (indices[None, :] + step * which[:, None]).ravel()


def nonzeros(matrix: Expression) -> Expression:
    """The nonzeros of a matrix as a column."""
    return matrix.nz[:]

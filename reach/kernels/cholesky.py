"""Small linear systems, compiled: without LAPACK, and so the same on any machine."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled


@compiled
def solve_definite(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a symmetric positive definite system by Cholesky's factors.

    Args:
        matrix: its lower triangle is read, shape (n, n).
        right: shape (n,).

    Returns:
        The solution, shape (n,).
    """
    n = len(right)
    lower = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            s = matrix[i, j]
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = max(s, 1e-18) ** 0.5
            else:
                lower[i, j] = s / lower[j, j]
    x = right.copy()
    for i in range(n):
        for k in range(i):
            x[i] -= lower[i, k] * x[k]
        x[i] /= lower[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= lower[k, i] * x[k]
        x[i] /= lower[i, i]
    return x

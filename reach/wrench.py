"""The set of wrenches that contacts can apply, and whether it holds gravity ([Danielczuk2019] 4.2).

Lambda = {G alpha, alpha in F}: every triangle applies (f_x, f_y, f_z, tau_z) in its frame, tau_x =
tau_y = 0; each contact's normal forces share one scale s between zero and one, f_z,i = s f_z,i,max,
because the pressure has one constant k. So the unknowns are s of every contact, and of every triangle
phi = (f_x / f_t,max, f_y / f_t,max, tau_z / tau_z,max), which keeps them all of the order of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.limit_surface import DIRECTIONS, TriangleContacts
from reach.transforms import skew


@dataclass(frozen=True, slots=True, eq=False)
class WrenchSet:
    """Lambda with linearized limit surfaces: {G alpha, A alpha <= b, lower <= alpha <= upper}.

    Attributes:
        G: grasp map of phi and s, shape (6, n), to (force [N], torque over the torque scale [N]).
        A: shape (m, n).
        b: shape (m,).
        lower: shape (n,).
        upper: shape (n,).
    """

    G: FloatArray
    A: FloatArray
    b: FloatArray
    lower: FloatArray
    upper: FloatArray


def grasp_map(contacts: TriangleContacts, torque_length: float) -> FloatArray:
    """Map (f_x, f_y, f_z, tau_z) of each triangle to wrenches about the frame's origin.

    Returns:
        Shape (M, 6, 4): force [N], torque over the torque scale [N].
    """
    axes = contacts.T_frame_triangle[:, :3, :3]
    centers = contacts.T_frame_triangle[:, :3, 3]
    G = np.zeros((len(contacts), 6, 4))
    G[:, :3, :3] = axes
    G[:, 3:, :3] = skew(centers) @ axes / torque_length
    G[:, 3:, 3] = axes[:, :, 2] / torque_length
    return G


def wrench_set(contacts: Sequence[TriangleContacts], torque_length: float) -> WrenchSet:
    """Assemble Lambda of all contacts; every triangle's 18 half-spaces, every contact's scale."""
    triangles = sum(len(contact) for contact in contacts)
    n = 3 * triangles + len(contacts)
    G = np.zeros((6, n))
    on_scale = np.zeros((triangles, len(contacts)))
    first = 0
    for index, contact in enumerate(contacts):
        last = first + len(contact)
        maps = grasp_map(contact, torque_length)
        limits = np.column_stack([contact.tangential, contact.tangential, contact.torsion])
        per_phi = maps[:, :, [0, 1, 3]] * limits[:, None, :]
        G[:, 3 * first : 3 * last] = np.moveaxis(per_phi, 0, 1).reshape(6, -1)
        G[:, 3 * triangles + index] = maps[:, :, 2].T @ contact.normal_force
        on_scale[first:last, index] = -1.0
        first = last
    A = np.hstack(
        [
            np.kron(np.eye(triangles), DIRECTIONS),
            np.repeat(on_scale, len(DIRECTIONS), axis=0),
        ]
    )  # u . phi - s <= 0
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    lower[3 * triangles :], upper[3 * triangles :] = 0.0, 1.0
    return WrenchSet(G, A, np.zeros(len(A)), lower, upper)


def distance_to(
    lam: WrenchSet, wrench: FloatArray, *, regularization: float = 1e-9, solver: str = "daqp"
) -> float:
    """Distance of a wrench from Lambda by the paper's quadratic program: min |G alpha - w|.

    Args:
        lam: the set.
        wrench: shape (6,), torque over the torque scale.
        regularization: weight of |alpha|^2, which makes the solution unique.
        solver: any of qpsolvers.

    Raises:
        ArithmeticError: the solver gave up.
    """
    from qpsolvers import solve_qp
    from scipy.sparse import csc_matrix

    n = lam.G.shape[1]
    P = lam.G.T @ lam.G + regularization * np.eye(n)
    q = -lam.G.T @ wrench
    sparse = solver in ("clarabel", "osqp", "scs", "piqp")
    matrix = csc_matrix if sparse else np.asarray
    alpha = solve_qp(matrix(P), q, matrix(lam.A), lam.b, lb=lam.lower, ub=lam.upper, solver=solver)
    if alpha is None:
        raise ArithmeticError(f"solver {solver!r} found no solution of a program that has one")
    return float(np.linalg.norm(lam.G @ alpha - wrench))


def linearized_margin(lam: WrenchSet, wrench: FloatArray, cap: float) -> float:
    """Largest t <= cap with t * wrench in Lambda, by a linear program."""
    from scipy.optimize import linprog
    from scipy.sparse import csc_matrix

    n = lam.G.shape[1]
    bounds = np.column_stack([np.append(lam.lower, 0.0), np.append(lam.upper, cap)])
    cost = np.zeros(n + 1)
    cost[-1] = -1.0
    inequalities: Any = csc_matrix(np.column_stack([lam.A, np.zeros(len(lam.A))]))
    solution: Any = linprog(
        cost,
        inequalities,
        lam.b,
        np.column_stack([lam.G, -wrench]),
        np.zeros(6),
        bounds.tolist(),
        method="highs",
    )
    if solution.x is None:
        raise ArithmeticError(f"linear program: {solution.message}")
    return float(solution.x[-1])


def friction_columns(
    contacts: Sequence[TriangleContacts], torque_length: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Describe contacts with exact ellipsoids for the compiled solver, triangle by triangle.

    Returns:
        Normal wrenches (J, 6), friction points (POINT, P), and the first point of each contact and
        the end (J + 1,), as [exit_of_ray][reach.kernels.min_norm.exit_of_ray] takes them.
    """
    normals, columns = [], []
    for contact in contacts:
        normals.append(grasp_map(contact, torque_length)[:, :, 2].T @ contact.normal_force)
        axis = contact.T_frame_triangle[:, :3, 2]
        M = np.eye(3) - axis[:, :, None] * axis[:, None, :]
        safe = np.where(contact.tangential > 0, contact.tangential, 1.0)
        lever = np.where(contact.tangential > 0, contact.torsion / safe, 0.0)
        columns.append(
            np.vstack(
                [
                    contact.T_frame_triangle[:, :3, 3].T / torque_length,
                    M[:, (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)].T,
                    axis.T * lever / torque_length,
                    contact.tangential,
                ]
            )
        )
    starts = np.cumsum([0] + [len(contact) for contact in contacts]).astype(np.int64)
    return np.array(normals), np.ascontiguousarray(np.hstack(columns)), starts

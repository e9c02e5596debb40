"""Small symmetric systems of planes, by Cholesky's decomposition without roots.

A matrix is L D L^T: L with 1 on its diagonal, D diagonal. Roots and quotients take ten times as
long as products, and this takes one quotient an unknown.
"""

from transientcam_moments.arrays import Bank, Length, larger, least


def decompose(unknowns: Length, a: Bank) -> None:
    """Put L in the place of the lower half of `a`, and the inverse of D in that of its diagonal.

    `a` is a bank of n x n planes, positive definite; a pivot that rounding made negative becomes
    as good as 0.
    """
    n = len(unknowns)
    for i in range(n):
        pivot = a[i * n + i]
        for k in range(i):
            total = a[i * n + k]
            for inner in range(k):
                total = total - a[i * n + inner] * a[k * n + inner]
            a[i * n + k] = total  # times D, until the row is done
        for k in range(i):
            total = a[i * n + k]
            a[i * n + k] = total * a[k * n + k]
            pivot = pivot - total * a[i * n + k]
        a[i * n + i] = 1.0 / larger(pivot, least(pivot))


def solve(unknowns: Length, a: Bank, g: Bank, first: int) -> None:
    """Put the solution of the system in the place of `g`, from unknown `first` on.

    `a` is from `decompose`.
    """
    n = len(unknowns)
    for i in range(1, n):
        total = g[i]
        for k in range(i):
            total = total - a[i * n + k] * g[k]
        g[i] = total
    for i in range(n - 1, first - 1, -1):
        total = g[i] * a[i * n + i]
        for k in range(i + 1, n):
            total = total - a[k * n + i] * g[k]
        g[i] = total


def variances(unknowns: Length, a: Bank, out: Bank) -> None:
    """Put the diagonal of the inverse in `out`; `a` is from `decompose` and is overwritten.

    Column by column of L^-1: its sums of squares over D are that diagonal.
    """
    n = len(unknowns)
    for k in range(n):
        out[k] = a[k * n + k]
        for i in range(k + 1, n):
            # (L^-1)_ik, kept in the upper half, which `decompose` leaves unused
            total = a[i * n + k]
            for inner in range(k + 1, i):
                total = total + a[i * n + inner] * a[k * n + inner]
            a[k * n + i] = -total
            out[k] = out[k] + total * total * a[i * n + i]

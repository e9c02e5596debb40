"""Small symmetric systems of planes, by Cholesky's decomposition."""

from transientcam_moments.likelihood.arithmetic import Bank, Length, larger, least, root


def decompose(unknowns: Length, a: Bank) -> None:
    """Put Cholesky's factor in the place of the lower half of `a`, with inverted diagonal.

    `a` is a bank of n x n planes, positive definite; a pivot that rounding made negative becomes
    as good as 0.
    """
    n = len(unknowns)
    for i in range(n):
        for k in range(i + 1):
            total = a[i * n + k]
            for inner in range(k):
                total = total - a[i * n + inner] * a[k * n + inner]
            if k < i:
                a[i * n + k] = total * a[k * n + k]
            else:
                a[i * n + i] = 1.0 / root(larger(total, least(total)))


def solve(unknowns: Length, a: Bank, g: Bank) -> None:
    """Put the solution of the system in the place of `g`; `a` is from `decompose`."""
    n = len(unknowns)
    for i in range(n):
        total = g[i]
        for k in range(i):
            total = total - a[i * n + k] * g[k]
        g[i] = total * a[i * n + i]
    for i in range(n - 1, -1, -1):
        total = g[i]
        for k in range(i + 1, n):
            total = total - a[k * n + i] * g[k]
        g[i] = total * a[i * n + i]


def variances(unknowns: Length, a: Bank, out: Bank) -> None:
    """Put the diagonal of the inverse in `out`; `a` is from `decompose` and is overwritten.

    Column by column of the factor's inverse: its sums of squares are that diagonal.
    """
    n = len(unknowns)
    for k in range(n):
        out[k] = a[k * n + k] * a[k * n + k]
        for i in range(k + 1, n):
            # (L^-1)_ik, kept in the upper half, which `decompose` leaves unused
            total = a[i * n + k] * a[k * n + k]
            for inner in range(k + 1, i):
                total = total + a[i * n + inner] * a[k * n + inner]
            inverse = -total * a[i * n + i]
            a[k * n + i] = inverse
            out[k] = out[k] + inverse * inverse

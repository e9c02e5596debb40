"""Moments of higher order than those that were measured, and harmonics that mix them in."""

from transientcam_moments.arrays import Bank, Length, Pair, Plane


def extend(order: Length, highest: int, ar: Bank, ai: Bank, re: Bank, im: Bank) -> None:
    """Put b_{m+1} up to the highest behind b_1 .. b_m, as the density of Eq. (2) has them.

    b_k = -sum_j a_j b_{k-j}: that density is one of an autoregressive process of order m.
    """
    for n in range(len(order) + 1, highest + 1):
        x, y = 0.0 * ar[1], 0.0 * ar[1]
        for j in range(1, len(order) + 1):
            x = x + (ar[j] * re[n - j] - ai[j] * im[n - j])
            y = y + (ar[j] * im[n - j] + ai[j] * re[n - j])
        re[n], im[n] = -x, -y


def without_harmonic(
    k: int, dr: Plane, di: Plane, hr: Plane, hi: Plane, x: Plane, y: Plane
) -> Pair:
    """Subtract from b_j = x + i y what harmonic k mixes in: d b_kj, or d conj(b_kj).

    The latter for k = 3, 7, 11 ..., see `transientcam_moments.images._harmonics`.
    """
    if k % 4 == 3:
        hi = -hi
    return x - (dr * hr - di * hi), y - (dr * hi + di * hr)

"""The covariance of as many returns as there are harmonics, by trigonometric interpolation.

db_j = sum_k (dw_k + i j w_k dphi_k) exp(i j phi_k). With p(phi) = Re sum_j conj(c_j) exp(i j phi)
it follows that Re sum_j conj(c_j) db_j = sum_k p(phi_k) dw_k + p'(phi_k) w_k dphi_k: the polynomial
that is 1 at phi_k, 0 at the other phases and without slope at all of them gives dw_k, and the one
that is 0 at all of them with a slope of 1 at phi_k alone gives w_k dphi_k. Neither has a constant
term, as there is none for b_0. Both exist in closed form, so that nothing is lost where returns
come close, as it is by inverting Fisher's information.

With q_k(phi) = prod_{l != k} sin^2((phi - phi_l) / 2) / sin^2((phi_k - phi_l) / 2) they are
q_k sin(phi - phi_k) and q_k (1 - q_k'(phi_k) sin(phi - phi_k)), each less the multiple of
prod_l sin^2((phi - phi_l) / 2), which vanishes doubly at all phases, that takes the mean away.
"""

import numpy as np

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    Plane,
    bank,
    multiply_rows,
    root,
    square_bank,
)


def half_turned(phase: Array) -> Array:
    """Return cos and sin (2m, P) of half the phases (m, P)."""
    half = 0.5 * phase
    return np.concatenate([np.cos(half), np.sin(half)])


def basis(m: int) -> Array:
    """Return, for each of 2m + 1 nodes around the turn, a row (2m + 3) of numbers.

    They take the value at the node to the mean of a polynomial of order m, to its cosines and its
    sines; the last two are cos and sin of the node.
    """
    nodes = 2 * m + 1
    node = 2 * np.pi / nodes * np.arange(nodes)
    harmonic = np.outer(node, np.arange(1, m + 1))
    polynomial = np.concatenate([np.full((nodes, 1), 0.5), np.cos(harmonic), np.sin(harmonic)], 1)
    return np.column_stack([polynomial * (2 / nodes), np.cos(node), np.sin(node)])


def covariance(
    order: Length,
    both: Length,
    table: Array,
    one: Plane,
    x: Bank,
    y: Bank,
    variance: Bank,
    out: Bank,
) -> None:
    """Fill the lower half of a matrix of planes with the covariance of m returns.

    Of the m weights, then of the m phases times their weights. ``both`` is a tuple of length 2m,
    ``table`` is from `basis`, and ``one`` is 1 everywhere. ``x`` and ``y`` hold cos and sin of half
    the phases, no two of a pixel alike, and are overwritten; ``variance`` is that of the real part
    of b_1 .. b_m, and of the imaginary part.
    """
    m, nodes = len(order), len(both) + 1
    scale, slope, std = bank(one, order, 0), bank(one, order, 0), bank(one, order, 0)
    zero, before = bank(one, order, 0), bank(one, order, 0)
    values, spectrum = square_bank(one, both, 1), square_bank(one, both, 1)
    for k in range(m):  # what makes each q_k 1 at its phase, and its slope there
        others, total = one, one * 0.0
        for other in range(m):
            if other != k:
                cosine = x[k] * x[other] + y[k] * y[other]
                sine = y[k] * x[other] - x[k] * y[other]
                others = others * (2.0 * sine * sine)
                total = total + cosine / sine
        scale[k], slope[k], std[k] = 1.0 / others, total, root(variance[k])
    for k in range(m):
        x[k], y[k] = x[k] * x[k] - y[k] * y[k], 2.0 * x[k] * y[k]
    for i in range(nodes):
        c, s = table[i, nodes], table[i, nodes + 1]
        product = one
        for k in range(m):
            zero[k] = 1.0 - (x[k] * c + y[k] * s)  # 2 sin^2 of half the angle to the phase
            before[k] = product
            product = product * zero[k]
        values[2 * m * nodes + i] = product
        after = one
        for k in range(m - 1, -1, -1):
            away = before[k] * after * scale[k]
            after = after * zero[k]
            sloping = away * (x[k] * s - y[k] * c)
            values[k * nodes + i] = away - slope[k] * sloping
            values[(m + k) * nodes + i] = sloping
    multiply_rows(values, both, table, spectrum)
    for row in range(2 * m):
        share = spectrum[row * nodes] / spectrum[2 * m * nodes]
        for j in range(2 * m):
            at = row * nodes + 1 + j
            rest = spectrum[at] - share * spectrum[2 * m * nodes + 1 + j]
            spectrum[at] = rest * std[j % m]
        for column in range(row + 1):
            total = one * 0.0
            for j in range(1, nodes):
                total = total + spectrum[row * nodes + j] * spectrum[column * nodes + j]
            out[2 * m * row + column] = total

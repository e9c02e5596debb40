"""Where first order describes the noise of m returns, and the deviation of the direct one."""

import numpy as np

from transientcam_moments.arrays import (
    Bank,
    Length,
    Mask,
    Plane,
    larger,
    largest,
    magnitude,
    not_a_number,
    root,
    select,
    smaller,
)


def resolved(order: Length, coincide_rad: float, phase: Bank, weight: Bank) -> Mask:
    """Say where there are m returns, none of them closer to another than so much."""
    there = weight[0] > 0.0
    for k in range(len(order)):
        there = there & (weight[k] > 0.0) & (magnitude(phase[k]) <= largest(phase[k]))  # or NaN
        for other in range(k):
            apart = magnitude(phase[k] - phase[other])
            there = there & (smaller(apart, 2.0 * np.pi - apart) > coincide_rad)
    return there


def direct_noise(
    order: Length,
    threshold: float,
    clear: float,
    phase: Bank,
    weight: Bank,
    phase_std: Bank,
    weight_std: Bank,
    mixed: Bank,
) -> tuple[Plane, Mask]:
    """Return the deviation of the direct return's phase, NaN without one, and where it holds.

    Returns ascend; ``mixed`` holds the covariance of the phases of each and the one before times
    their weights, and anything for the first. ``threshold`` is as of `separate`, ``clear`` how many
    deviations count as enough. See `return_noise`.
    """
    m = len(order)
    strongest, spread = weight[0], 0.0 * weight[0]
    for k in range(1, m):
        strongest = larger(weight[k], strongest)
    for k in range(m):  # of the strongest, by which it is decided which return is direct
        spread = larger(select(weight[k] == strongest, threshold * weight_std[k], 0.0), spread)
    searched = strongest > 0.0
    holds, std = searched, not_a_number(strongest)
    edge = threshold * strongest
    for k in range(m):
        w = weight[k]
        margin = clear * phase_std[k]
        holds = holds & (w > 0.0) & (w > clear * weight_std[k])
        holds = holds & (phase[k] > margin) & (2.0 * np.pi - phase[k] > margin)
        if k > 0:
            variance = phase_std[k - 1] * phase_std[k - 1] + phase_std[k] * phase_std[k]
            variance = variance - 2.0 * mixed[k] / (weight[k - 1] * w)
            holds = holds & (phase[k] - phase[k - 1] > clear * root(larger(variance, 0.0)))
        decided = magnitude(w - edge) > clear * (weight_std[k] + spread)
        holds = holds & (decided | (w == strongest) | ~searched)
        direct = searched & (w > 0.0) & (w >= edge)
        std = select(direct, phase_std[k], std)
        searched = searched & ~direct
    return std, holds

"""What is fitted of a pixel's moments, and what is said of it in their unit."""

from typing import Any

import numpy as np

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    bank,
    eps,
    infinity,
    larger,
    largest,
    logarithm,
    magnitude,
    namespace,
    not_a_number,
    root,
    select,
    smaller,
    tiny,
)
from transientcam_moments.likelihood import _choice as choice
from transientcam_moments.moment_problem import phase_of


def prepare(
    order: Length, error: float, one: Array, data_r: Bank, data_i: Bank, weight: Bank
) -> tuple[Array, Array, Array, Any]:
    """Make moments and their variances, in `weight`, data whose largest moment is 1.

    `one` is 1 everywhere. Returns what they were divided by, how many numbers were measured, what
    an unknown has to lower chi-square by, and where there is light. A pixel that cannot be used is
    fitted to one return, which comes to nothing.
    """
    zero = 0.0 * one
    size, poison, numbers, waves = zero, zero, zero, zero
    for j in range(len(order) + 1):
        seen = (weight[j] > 0.0) & (weight[j] < infinity(one))
        x = select(seen, data_r[j], zero)
        y = select(seen, data_i[j], zero) if j > 0 else zero
        size = larger(size, larger(magnitude(x), magnitude(y)))
        poison = poison + x * 0.0 + y * 0.0
        numbers = numbers + select(seen, one * (2.0 if j > 0 else 1.0), zero)
        waves = waves + select(seen, one * (1.0 if j > 0 else 0.0), zero)
        data_r[j], data_i[j] = x, y
        weight[j] = select(seen, weight[j], zero)
    # the squares of deviations over it must neither over- nor underflow
    usable = (poison >= 0.0) & (size > 16.0 * tiny(one)) & (size < (largest(one) * eps(one)))
    usable = usable & (waves > 0.0) & ~((weight[0] > 0.0) & ~(data_r[0] > 0.0))
    scale = select(usable, size, one)
    inverse = select(usable, 1.0 / scale, zero)
    rounding = 4.0 * eps(one)
    for j in range(len(order) + 1):
        data_r[j] = select(usable, data_r[j] * inverse, one)
        data_i[j] = select(usable, data_i[j] * inverse, zero)
        seen = weight[j] > 0.0
        std = root(select(seen, weight[j], one)) * inverse
        std = smaller(larger(std, rounding), 1.0 / rounding)
        each = 1.0 / (std * std + error * error)
        weight[j] = select(usable, select(seen, each, zero), one)
    numbers = select(usable, numbers, one)
    return scale, numbers, logarithm(numbers) + choice.MARGIN, usable


def rows(slots: int) -> int:
    """Return how many planes `attributes` gives."""
    return 4 * slots + 10


def attributes(
    slots: Length, found: Bank, scale: Array, numbers: Array, usable: Any, out: Bank
) -> None:
    """Put the attributes of `Likelihood` in `out`, its returns sorted by phase.

    They are phases, weights and the deviations of both, as many each as there are slots; tail,
    its deviation, delay, its deviation, chi-square, average, its deviation, shape, degrees of
    freedom and count.
    """
    one = 1.0 + 0.0 * scale
    nan, far, zero = not_a_number(one), infinity(one), 0.0 * one
    size = len(slots)
    keys = bank(one, slots, 0)
    with_tail = found[choice.LENGTH] > 0.0
    there = zero
    for k in range(size):
        # a return that was driven to 0 is none; that of a tail stays, its phase is the tail's
        used = (
            usable
            & (found[choice.COUNT] > float(k))
            & ((found[choice.WEIGHT + k] > 0.0) | with_tail)
        )
        keys[k] = select(used, phase_of(found[choice.X + k], found[choice.Y + k]), far)
        out[size + k] = select(used, found[choice.WEIGHT + k] * scale, zero)
        out[2 * size + k] = select(used, root(found[choice.PHASE_VARIANCE + k]), nan)
        out[3 * size + k] = select(used, root(found[choice.WEIGHT_VARIANCE + k]) * scale, nan)
        there = there + select(used, one, zero)
    for i in range(size - 1):
        for k in range(size - 1 - i):
            swap = keys[k] > keys[k + 1]
            low, high = smaller(keys[k], keys[k + 1]), larger(keys[k], keys[k + 1])
            keys[k], keys[k + 1] = low, high
            for row in range(size, 4 * size, size):
                before, behind = out[row + k], out[row + k + 1]
                out[row + k] = select(swap, behind, before)
                out[row + k + 1] = select(swap, before, behind)
    for k in range(size):
        out[k] = select(keys[k] < far, keys[k], nan)
    tailed = usable & with_tail & (found[choice.TAIL] > 0.0)
    delay = found[choice.SHAPE] * found[choice.LENGTH]
    rest = 4 * size
    out[rest] = select(tailed, found[choice.TAIL] * scale, zero)
    out[rest + 1] = select(tailed, root(found[choice.TAIL_VARIANCE]) * scale, nan)
    out[rest + 2] = select(tailed, delay, nan)
    out[rest + 3] = select(tailed, delay * root(found[choice.LENGTH_VARIANCE]), nan)
    out[rest + 4] = select(usable, found[choice.CHI_SQUARE], nan)
    std = root(choice.average_variance(numbers, found))
    out[rest + 5] = select(keys[0] < far, found[choice.MEAN], nan)
    out[rest + 6] = select(keys[0] < far, std, nan)
    out[rest + 7] = select(tailed, found[choice.SHAPE], zero)
    unknowns = select(with_tail, 4.0 * one, 2.0 * found[choice.COUNT])
    out[rest + 8] = select(usable, numbers - unknowns, zero)
    out[rest + 9] = there


def arranged(out: list[Array], slots: int) -> tuple[Array, ...]:
    """Return attributes of `Likelihood` of the planes of `attributes`, but for the last two."""
    xp = namespace(out[0])
    four = (xp.stack(out[k * slots : (k + 1) * slots]) for k in range(4))
    *rest, mean, std, shape, free, count = out[4 * slots :]
    free, count, shape = (part.astype(np.int32) for part in (free, count, shape))
    return (*four, *rest, free, count, mean, std, shape)

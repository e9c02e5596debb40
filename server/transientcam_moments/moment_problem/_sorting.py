"""Banks in order, pixel by pixel."""

from transientcam_moments.arrays import Bank, Length, larger, select, smaller


def sort(order: Length, keys: Bank, values: Bank) -> None:
    """Sort two banks by the first, ascending; no key is NaN."""
    m = len(order)
    for i in range(m - 1):
        for k in range(m - 1 - i):
            swap = keys[k] > keys[k + 1]
            low, high = smaller(keys[k], keys[k + 1]), larger(keys[k], keys[k + 1])
            first = select(swap, values[k + 1], values[k])
            second = select(swap, values[k], values[k + 1])
            keys[k], keys[k + 1], values[k], values[k + 1] = low, high, first, second

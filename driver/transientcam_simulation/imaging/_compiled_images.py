"""Electrons of an image, and their codes: compiled arithmetic, the same bytes as in NumPy."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import CODES, LINE, WHOLE, float32, inner, lane

Plane = NDArray[np.float32]
Codes = NDArray[np.uint16]
Noise = tuple[np.float32, np.float32, np.float32, np.float32, np.float32]
_ZERO = np.float32(0)
_WHOLE = np.float32(3 << 22)
"""Added and taken away, it rounds what is between 0 and 2^22 to whole numbers, as `rint` does."""
_BLOCK = 4096
"""Pixels at a time."""


@inner
def _turn(
    offset: Plane, in_phase: Plane, quadrature: Plane, of: tuple[np.float32, np.float32],
    electrons: Plane,
) -> None:  # fmt: skip
    cosine, sine = of
    for i in range(len(offset)):
        light = offset[i] + in_phase[i] * cosine
        light = light + quadrature[i] * sine
        electrons[i] = max(light, _ZERO)


@lane(WHOLE, WHOLE, WHOLE, float32, float32)
def at_phase(
    offset: Plane, in_phase: Plane, quadrature: Plane, cosine: np.float32, sine: np.float32
) -> Plane:
    """Return the electrons of an image at a phase, given its cosine and sine."""
    electrons = np.empty(offset.shape, np.float32)
    for row in range(len(offset)):
        _turn(offset[row], in_phase[row], quadrature[row], (cosine, sine), electrons[row])
    return electrons


@inner
def _code(
    signal: Plane, bins: Codes, quantiles: Plane, of: Noise, noise: Plane, codes: Codes
) -> int:  # fmt: skip
    """Put the codes of a block of pixels; return how many have one of the outermost bins."""
    light, variance_e2, dn_per_e, dark_dn, highest_dn = of
    outermost = 0
    for i in range(len(bins)):
        noise[i] = quantiles[bins[i]]
    for i in range(len(bins)):
        outermost += (bins[i] == 0) | (bins[i] == 65535)
    for i in range(len(signal)):
        electrons = signal[i] + noise[i] * np.sqrt(signal[i] * light + variance_e2)
        code = min(max(electrons * dn_per_e + dark_dn, _ZERO), highest_dn)
        codes[i] = np.uint16(np.int32((code + _WHOLE) - _WHOLE))
    return outermost


@lane(LINE, CODES, LINE, float32, float32, float32, float32, float32)
def coded(
    signal: Plane, bins: Codes, quantiles: Plane, light: np.float32, variance_e2: np.float32,
    dn_per_e: np.float32, dark_dn: np.float32, highest_dn: np.float32,
) -> tuple[Codes, NDArray[np.int64]]:  # fmt: skip
    """Return codes of pixels with noise, and the places of those with one of the outermost bins.

    The variance of the noise is the signal times ``light``, and the same everywhere.
    """
    count, noise = len(signal), np.empty(_BLOCK, np.float32)
    codes, outermost, found = np.empty(count, np.uint16), np.empty(count, np.int64), 0
    of = light, variance_e2, dn_per_e, dark_dn, highest_dn
    for start in range(0, count, _BLOCK):
        stop = min(start + _BLOCK, count)
        if not _code(signal[start:stop], bins[start:stop], quantiles, of, noise, codes[start:stop]):
            continue
        for i in range(start, stop):
            if bins[i] == 0 or bins[i] == 65535:
                outermost[found] = i
                found += 1
    return codes, outermost[:found].copy()

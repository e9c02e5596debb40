"""A base of which any frequencies are multiples, as near as a range can tell."""

from collections.abc import Iterable

import numpy as np

from transientcam_driver.camera import require
from transientcam_driver.sequence import MAX_HARMONICS, MAX_MULTIPLE, SPEED_OF_LIGHT_M_S

_PHASE_RAD = 1e-4
"""By how much the phase of the farthest target may be off: 0.02 mm at 100 MHz."""


def common_base(
    frequencies_hz: Iterable[float], max_range_m: float | None
) -> tuple[float, tuple[int, ...]]:
    """Return a base frequency in Hz and the multiples of it that frequencies are, ascending.

    Incommensurable ones are rounded, by less than shows in phases up to the largest range.
    Raises ProtocolError where they have no base.
    """
    wanted = np.unique(np.asarray(tuple(frequencies_hz), dtype=np.float64))
    most = MAX_HARMONICS if max_range_m is None else MAX_MULTIPLE
    parts = np.arange(1, most + 1)
    base_hz = wanted[0] / parts
    multiples = np.rint(wanted[:, None] / base_hz)
    error_hz = abs(wanted[:, None] - multiples * base_hz).max(axis=0)
    # the way there and back, to the largest range or as far as the base tells ranges apart
    delay_s = 1 / base_hz
    if max_range_m is not None:
        delay_s = np.minimum(delay_s, 2 * max_range_m / SPEED_OF_LIGHT_M_S)
    suited = (2 * np.pi * error_hz * delay_s < _PHASE_RAD) & (multiples[-1] <= most)
    limit = f"multiples up to {most} of one frequency" + (
        ", or max_range_m stated" if max_range_m is None else ""
    )
    require("frequency_hz", suited.any(), limit, wanted.tolist())
    found = multiples[:, np.argmax(suited)]
    return float(wanted @ found / (found @ found)), tuple(int(each) for each in found)

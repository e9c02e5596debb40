"""Which frequencies a camera measures, and at which phases, where that is not the usual choice."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral
from typing import Any

from transientcam_driver.errors import SequenceError
from transientcam_driver.sequence._fields import known_keys, positive

MAX_HARMONICS = 32
"""The highest multiple of the base frequency, and so the most frequencies."""
MAX_MULTIPLE = 1 << 16
"""The highest one where the largest range is stated: any frequencies have a base then."""
FOUR_PHASES_RAD = (0.0, math.pi / 2, math.pi, 3 * math.pi / 2)
"""Four-bucket sampling."""
MAX_PHASES = 16
_MAX_PHASE_RAD = 1e3  # beyond, turns are lost in rounding
_SAME_PHASE_RAD = 1e-6


@dataclass(frozen=True, slots=True)
class Sampling:
    """Multiples of the base frequency that are measured, and the phases of each of them.

    ``Sampling()`` is the paper's: the multiples 1 to m at four phases. A camera with fixed
    frequencies states its own: 16, 80 and 120 MHz at three phases are the multiples 2, 10 and 15
    of 8 MHz, ``Sampling((2, 10, 15), (0, 2 pi / 3, 4 pi / 3))``.

    Attributes
    ----------
    multiples
        From 1 to 32, ascending, without a common factor; empty for 1 to m. To 65536 with
        ``max_range_m``: then few measure the range of one return, and no more.
    phases_rad
        From 3 to 16 different ones: enough to solve for a moment and the offset of a pixel.
    max_range_m
        No target is taken to be beyond it; None for what the frequencies tell apart.

    Raises
    ------
    SequenceError
        Naming the field, its value and the limit.
    """

    multiples: tuple[int, ...] = ()
    phases_rad: tuple[float, ...] = FOUR_PHASES_RAD
    max_range_m: float | None = None

    def __post_init__(self) -> None:
        if self.max_range_m is not None:
            positive("sampling.max_range_m", self.max_range_m, "a number of metres above 0")
        most = MAX_HARMONICS if self.max_range_m is None else MAX_MULTIPLE
        _require_multiples(self.multiples, most)
        _require_phases(self.phases_rad)
        object.__setattr__(self, "multiples", tuple(int(each) for each in self.multiples))
        object.__setattr__(self, "phases_rad", tuple(float(each) for each in self.phases_rad))

    def multiples_of(self, harmonics: int) -> tuple[int, ...]:
        """Return the multiples that a sequence with so many frequencies measures."""
        return self.multiples or tuple(range(1, harmonics + 1))

    @property
    def consecutive(self) -> bool:
        """Whether the multiples are 1 to m: what the trigonometric moment problem is solved for."""
        return self.multiples == tuple(range(1, len(self.multiples) + 1))

    def to_document(self) -> dict[str, Any]:
        """Return ``{"multiples", "phases_rad"}``, with ``max_range_m`` where that is stated."""
        limit = {} if self.max_range_m is None else {"max_range_m": self.max_range_m}
        return {"multiples": list(self.multiples), "phases_rad": list(self.phases_rad)} | limit

    @classmethod
    def from_document(cls, document: Mapping[str, Any] | None) -> "Sampling":
        """Build from what `to_document` returns; what is absent is the usual."""
        if document is None:
            return cls()
        known_keys("sampling", document, {"multiples", "phases_rad", "max_range_m"})
        return cls(**document)


def _require_multiples(multiples: object, most: int) -> None:
    limit = f"different integers from 1 to {most}, ascending, without a common factor"
    if not isinstance(multiples, tuple | list) or not all(
        _is_multiple(each, most) for each in multiples
    ):
        raise SequenceError("sampling.multiples", multiples, limit)
    ascending = list(multiples) == sorted(set(multiples))
    if not ascending or (multiples and math.gcd(*multiples) != 1):
        raise SequenceError("sampling.multiples", multiples, limit)


def _is_multiple(value: object, most: int) -> bool:
    if isinstance(value, bool) or not isinstance(value, Integral):
        return False
    return 1 <= int(value) <= most


def _require_phases(phases_rad: object) -> None:
    limit = f"3 to {MAX_PHASES} different phases in radian"
    if not isinstance(phases_rad, tuple | list) or not 3 <= len(phases_rad) <= MAX_PHASES:
        raise SequenceError("sampling.phases_rad", phases_rad, limit)
    for each in phases_rad:
        real = isinstance(each, int | float) and not isinstance(each, bool)
        if not real or not abs(each) <= _MAX_PHASE_RAD:
            raise SequenceError("sampling.phases_rad", phases_rad, limit)
    turns = sorted(float(each) % (2 * math.pi) for each in phases_rad)
    gaps = [after - before for before, after in pairwise(turns)]
    if min(*gaps, turns[0] + 2 * math.pi - turns[-1]) < _SAME_PHASE_RAD:
        raise SequenceError("sampling.phases_rad", phases_rad, limit)

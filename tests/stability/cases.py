"""The hard cases: signals that are written down exactly, for every order and precision."""

from collections.abc import Iterator
from dataclasses import dataclass

import mpmath as mp
import numpy as np

from tests.stability import exact

ORDERS = (1, 2, 3, 4, 8, 16, 32)
PRECISIONS = {"float32": np.complex64, "float64": np.complex128}


NONE = mp.mpf(0)


@dataclass(frozen=True)
class Signal:
    """Returns and a uniform part."""

    name: str
    phase: tuple[mp.mpf, ...]
    weight: tuple[mp.mpf, ...]
    uniform: mp.mpf = NONE

    def moments(self, m: int) -> list[mp.mpc]:
        """b_0 .. b_m in 60 digits."""
        return exact.moments(self.phase, self.weight, self.uniform, m)


def _spread(count: int) -> tuple[mp.mpf, ...]:
    """Phases all around the turn, none of them regular."""
    step = 2 * mp.pi / count
    places = (k + mp.mpf("0.3") * mp.sin(3 * k + 1) for k in range(count))
    return tuple(sorted((step * place + mp.mpf("0.7")) % (2 * mp.pi) for place in places))


def _uneven(count: int) -> tuple[mp.mpf, ...]:
    return tuple(mp.mpf(1) + mp.mpf("0.8") * mp.cos(5 * k) for k in range(count))


def sparse_signals(m: int) -> Iterator[Signal]:
    """At most m returns: Theorem 2 gives them back."""
    one = (mp.mpf(1),)
    yield Signal("one return", (mp.mpf("1.25"),), one)
    yield Signal("one return at phase 0", (mp.mpf(0),), one)
    yield Signal("one return at 2 pi - 1e-6", (2 * mp.pi - mp.mpf("1e-6"),), one)
    yield Signal("one return, uniform 0.5", (mp.mpf("1.25"),), one, mp.mpf("0.5"))
    yield Signal("m returns", _spread(m), _uneven(m))
    if m >= 2:
        for exponent in (1, 2, 3, 4, 5, 6):
            apart = mp.mpf(10) ** -exponent
            phase = (mp.mpf(2), mp.mpf(2) + apart)
            yield Signal(f"two returns 1e-{exponent} apart", phase, (mp.mpf(1), mp.mpf("0.6")))
        yield Signal("weights 1 : 1e-4", (mp.mpf(1), mp.mpf(3)), (mp.mpf(1), mp.mpf("1e-4")))


def dense_signals(m: int) -> Iterator[Signal]:
    """More returns than m, or a uniform part: the matrix is positive definite."""
    yield Signal("uniform", (), (), mp.mpf(1))
    yield Signal("m + 1 returns", _spread(m + 1), _uneven(m + 1))
    for share in ("0.3", "4.2e-3", "1.1e-6"):
        yield Signal(f"m returns, uniform {share}", _spread(m), _uneven(m), m * mp.mpf(share))
    close = (mp.mpf(2), mp.mpf("2.05"))
    yield Signal("two close returns, uniform 0.01", close, (mp.mpf(1),) * 2, mp.mpf("0.02"))

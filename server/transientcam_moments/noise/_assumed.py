"""The noise of moments of which none is known, whatever their unit."""

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import numpy as np

from transientcam_moments.arrays import Array, moment_planes, namespace
from transientcam_moments.noise._moments import MomentNoise

ASSUMED_NOISE: Final = 0.01
"""Standard deviation over the largest moment, where none is given."""
_WITH_UNIT: Final = ("weight", "weight_std", "tail", "tail_std")
_LARGEST_POWER: Final = 126
"""Of 2, that is a normal number in single precision, as its inverse is."""
_P = ParamSpec("_P")
_T = TypeVar("_T", bound=Any)


def assumed_noise(b: Array) -> MomentNoise:
    """Return `ASSUMED_NOISE` for moments (m + 1, ...), whose squares are in range."""
    xp = namespace(b)
    size = _size(b)
    return MomentNoise(xp.broadcast_to((ASSUMED_NOISE * size) ** 2, b.shape).astype(b.real.dtype))


def free_of_scale(
    estimate: Callable[Concatenate[Array, MomentNoise, _P], _T],
) -> Callable[Concatenate[Array, MomentNoise | None, _P], _T]:
    """Let an estimate of moments ``b`` assume a ``noise`` of None, at any scale of each pixel.

    The moments are brought to about 1 by a power of 2, so that neither their squares nor those of
    the noise over- or underflow, and what has their unit is brought back.
    """

    @wraps(estimate)
    def scaled(b: Array, noise: MomentNoise | None, *others: _P.args, **options: _P.kwargs) -> _T:
        if noise is not None:
            return estimate(b, noise, *others, **options)
        planes, trailing = moment_planes(b)
        xp = namespace(planes)
        with np.errstate(invalid="ignore"):  # of pixels that are not finite
            size = _size(planes)
            power = xp.where(xp.isfinite(size), xp.frexp(size)[1], 0)
            power = xp.clip(power, -_LARGEST_POWER, _LARGEST_POWER)
            near = planes * xp.ldexp(xp.ones_like(size), -power)
            noise = MomentNoise(assumed_noise(near).variance.reshape((-1, *trailing)))
            found = estimate(near.reshape((-1, *trailing)), noise, *others, **options)
        unit = xp.ldexp(xp.ones_like(size), power).reshape(trailing)
        named = {name: getattr(found, name) * unit for name in _WITH_UNIT if hasattr(found, name)}
        whole: _T = found._replace(**named)
        return whole

    return scaled


def _size(b: Array) -> Array:
    xp = namespace(b)
    return xp.maximum(abs(b.real), abs(b.imag)).max(axis=0)

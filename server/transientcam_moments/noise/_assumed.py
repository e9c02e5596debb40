"""The noise of moments of which none is known, whatever their unit."""

from collections.abc import Callable
from functools import update_wrapper
from typing import Any, Concatenate, Final, ParamSpec, TypeVar, cast

import numpy as np

from transientcam_moments.arrays import Array, moment_planes, namespace
from transientcam_moments.noise._moments import MomentNoise

ASSUMED_NOISE: Final = 0.01
"""Standard deviation over the largest moment, where none is given."""
_WITH_UNIT: Final = ("weight", "weight_std", "tail", "tail_std")
_LARGEST_POWER: Final = 126  # of 2, that is a normal number in single precision, as its inverse
_P = ParamSpec("_P")
_T = TypeVar("_T", bound=Any)


def free_of_scale(
    estimate: Callable[Concatenate[Array, MomentNoise, _P], _T],
) -> Callable[Concatenate[Array, MomentNoise | None, _P], _T]:
    """Let an estimate of moments ``b`` assume a ``noise`` of None, at any scale of each pixel.

    The moments are brought to about 1 by a power of 2, so that neither their squares nor those of
    the noise over- or underflow, and what has their unit is brought back.
    """

    def scaled(b: Array, noise: MomentNoise | None, *others: _P.args, **options: _P.kwargs) -> _T:
        if noise is not None:
            return estimate(b, noise, *others, **options)
        planes, trailing = moment_planes(b)
        xp = namespace(planes)
        with np.errstate(invalid="ignore"):  # of pixels that are not finite
            size = xp.maximum(abs(planes.real), abs(planes.imag)).max(axis=0)
            power = xp.where(xp.isfinite(size), xp.frexp(size)[1], 0)
            power = xp.clip(power, -_LARGEST_POWER, _LARGEST_POWER)
            down = xp.ldexp(xp.ones_like(size), -power)
            near = (planes * down).reshape((-1, *trailing))
            variance = (ASSUMED_NOISE * size * down).reshape(trailing) ** 2
            noise = MomentNoise(xp.broadcast_to(variance, near.shape))
            found = estimate(near, noise, *others, **options)
        unit = xp.ldexp(xp.ones_like(size), power).reshape(trailing)
        named = {name: getattr(found, name) * unit for name in _WITH_UNIT if hasattr(found, name)}
        whole: _T = found._replace(**named)
        return whole

    return cast(
        "Callable[Concatenate[Array, MomentNoise | None, _P], _T]", update_wrapper(scaled, estimate)
    )

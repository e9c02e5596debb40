"""Everything about one pixel: what a click on the dashboard shows."""

import math
from typing import Any, Final

import numpy as np
import transientcam_moments as tm
from transientcam_driver import Truth

from transientcam_server.products import Moments, Recipe

_TRUE_RETURNS: Final = 16


def describe_pixel(
    recipe: Recipe, moments: Moments, truth: Truth | None, x: int, y: int, bins: int
) -> dict[str, Any]:
    """Return range, returns, moments and impulse response of pixel (y, x) as plain values.

    The impulse response is given at ``bins`` times of flight, evenly spaced over one period of the
    base frequency, its start included.
    """
    b = moments.b[:, y, x, np.newaxis]
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    phase_rad = 2.0 * np.pi * np.arange(bins) / bins
    coefficients = tm.levinson(b)
    returns = tm.pisarenko(b)
    separation = tm.separate(returns, threshold=recipe.settings.return_threshold)
    flags = tm.Flags(int(moments.flags[y, x]))
    return {
        "x": x,
        "y": y,
        "range_m": _number(tm.range_m(separation.phase_rad, recipe.base_frequency_hz)[0]),
        "direct": _number(separation.direct[0]) or 0.0,
        "indirect": _number(separation.indirect[0]) or 0.0,
        "brightness": _number(b[0, 0].real) or 0.0,
        "uniform": _number(returns.uniform[0]) or 0.0,
        "validity": _number(moments.validity[y, x]),
        "flags": [str(flag.name).lower() for flag in tm.Flags if flag and flag in flags],
        "moments": [
            {"re": _number(each.real) or 0.0, "im": _number(each.imag) or 0.0} for each in b[:, 0]
        ],
        "returns": [
            {"time_s": float(phase) / rad_s, "weight": float(weight)}
            for phase, weight in zip(returns.phase_rad[:, 0], returns.weight[:, 0], strict=True)
            if weight > 0.0 and math.isfinite(phase)
        ],
        "time_s": [float(phase) / rad_s for phase in phase_rad],
        "density_per_s": [
            _number(rad_s * each) for each in tm.density(coefficients, phase_rad)[:, 0]
        ],
        "cumulative": [_number(each) for each in tm.cumulative(coefficients, phase_rad)[:, 0]],
        "truth": None if truth is None else _describe_truth(truth, x, y),
    }


def _describe_truth(truth: Truth, x: int, y: int) -> dict[str, Any]:
    delay_s, weight = truth.delay_s[:, y, x], truth.weight[:, y, x]
    present = np.flatnonzero(np.isfinite(delay_s) & (weight > 0.0))
    strongest = present[np.argsort(-weight[present])[:_TRUE_RETURNS]]
    return {
        "kind": truth.kind,
        "range_m": _number(truth.range_m[y, x]),
        "direct": _number(truth.direct[y, x]) or 0.0,
        "brightness": _number(truth.brightness[y, x]) or 0.0,
        "returns": [
            {"time_s": float(delay_s[k]), "weight": float(weight[k])} for k in sorted(strongest)
        ],
    }


def _number(value: Any) -> float | None:
    """Return a value as JSON can carry it: None where there is none."""
    number = float(value)
    return number if math.isfinite(number) else None

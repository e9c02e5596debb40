"""Everything about one pixel: what a click on the dashboard shows."""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Truth
from transientcam_server.imaging._products.products import BOUNDS_RADIUS
from transientcam_server.imaging._recipe.recipe import Recipe

_TRUE_RETURNS: Final = 16


def pixel_json(
    recipe: Recipe,
    image: tm.Reconstruction,
    meta: Mapping[str, Any],
    truth: Truth | None,
    x: int,
    y: int,
    bins: int,
) -> bytes:
    """Return the description of a pixel and the frame's metadata as JSON."""
    document = {"meta": meta} | describe_pixel(recipe, image, truth, x, y, bins)
    return json.dumps(document, allow_nan=False, separators=(",", ":")).encode()


def pixel_csv(
    recipe: Recipe,
    image: tm.Reconstruction,
    meta: Mapping[str, Any],
    truth: Truth | None,
    x: int,
    y: int,
    bins: int,
) -> bytes:
    """Return what of a pixel is over time of flight, as CSV under a line of names."""
    document = describe_pixel(recipe, image, truth, x, y, bins)
    columns = {name: document[name] for name in ("time_s", "density_per_s", "cumulative")}
    columns |= {name: document["bounds"][name] for name in ("lower_per_s", "upper_per_s")}
    lines = [",".join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(",".join("nan" if each is None else f"{each:.9g}" for each in row))
    return ("\n".join(lines) + "\n").encode("ascii")


def describe_pixel(
    recipe: Recipe, image: tm.Reconstruction, truth: Truth | None, x: int, y: int, bins: int
) -> dict[str, Any]:
    """Return range, returns, moments and impulse response of pixel (y, x) as plain values.

    The impulse response is given at ``bins`` times of flight, evenly spaced over one period of the
    base frequency, its start included. Moments of multiples with gaps give none: it is then empty.
    """
    flags = tm.Flags(int(image.flags[y, x]))
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    at: tuple[Any, ...] = (..., y, x)
    density: dict[str, Any] = {"time_s": [], "density_per_s": [], "cumulative": []}
    lower, upper = np.empty((2, 0))
    if recipe.applied.sequence.sampling.consecutive:
        moments = image.moments[:, y, x, np.newaxis]
        coefficients = tm.levinson(moments)
        phase_rad = 2.0 * np.pi * np.arange(bins) / bins
        per_s = rad_s * tm.density(coefficients, phase_rad)[:, 0]
        cumulative = tm.cumulative(coefficients, phase_rad)[:, 0]
        bounds = tm.bounds(moments, phase_rad, BOUNDS_RADIUS)
        lower, upper = (rad_s * bound[:, 0] for bound in bounds)
        density = {
            "time_s": [float(phase) / rad_s for phase in phase_rad],
            "density_per_s": [_number(each) for each in per_s],
            "cumulative": [_number(each) for each in cumulative],
        }
    return {
        "x": x,
        "y": y,
        **_separated(image, at, flags),
        "brightness": _number(image.brightness[at]) or 0.0,
        "validity": _number(image.validity[y, x]),
        "flags": [str(flag.name).lower() for flag in tm.Flags if flag and flag in flags],
        "moments": [
            {"re": _number(each.real) or 0.0, "im": _number(each.imag) or 0.0}
            for each in image.moments[at]
        ],
        "returns": [
            {"time_s": float(phase) / rad_s, "weight": float(weight)}
            for phase, weight in zip(
                image.returns.phase_rad[at], image.returns.weight[at], strict=True
            )
            if weight > 0.0 and math.isfinite(phase) and not flags & tm.INVALID
        ],
        **density,
        "bounds": {
            "radius": BOUNDS_RADIUS,
            "lower_per_s": [_number(each) for each in lower],
            "upper_per_s": [_number(each) for each in upper],
        },
        "truth": None if truth is None else _describe_truth(truth, x, y),
    }


def _separated(image: tm.Reconstruction, at: tuple[Any, ...], flags: tm.Flags) -> dict[str, Any]:
    """Return what the estimator finds; as of a pixel without a range where it fails."""
    light = ("direct", "indirect", "uniform")
    try:
        found: dict[str, Any] = {each: _number(getattr(image, each)[at]) or 0.0 for each in light}
        range_m = None if flags & tm.INVALID else _number(image.range_m[at])
    except tm.PluginFailed:
        return {"range_m": None, **dict.fromkeys(light, 0.0)}
    return {"range_m": range_m, **found}


def _describe_truth(truth: Truth, x: int, y: int) -> dict[str, Any]:
    delay_s, weight = truth.delay_s[:, y, x], truth.weight[:, y, x]
    present = np.flatnonzero(np.isfinite(delay_s) & (weight > 0.0))
    strongest = present[np.argsort(-weight[present])[:_TRUE_RETURNS]]
    return {
        "kind": truth.kind,
        "range_m": _number(truth.range_m[y, x]),
        "direct_share": _number(truth.direct_share[y, x]),
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

"""The pass over a frame as a shader in WGSL: two entries, ``measure`` and ``analyse``.

What is written here loads, stores and goes through neighbours; all that is computed of numbers is
traced from the functions that state it (`_tracing`). One thread does one pixel.
"""

from functools import lru_cache
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from transientcam_moments._gpu._tracing import Traced, Writer, literal
from transientcam_moments.arrays import larger
from transientcam_moments.images import phasors
from transientcam_moments.moment_problem import eigenvalue, half_turns, sparse, toeplitz

GROUP: Final = 64
"""Pixels of a workgroup."""
ROW: Final = GROUP * 65535
"""Pixels of a row of workgroups, of which WGSL allows no more."""
STEPS: Final = 24
"""Towards the roots at most, as kernels give to pixels that need more than others."""
EPS: Final = float(np.finfo(np.float32).eps)
PLANES: Final = (
    "brightness", "validity", "uniform", "direct", "indirect", "range", "residual", "packed",
)  # fmt: skip
"""Rows of the results, before phases, weights and moments; the last holds flags and count."""
ZEROTH: Final = {"low-frequency": 4, "on-off": 2, "estimated": 0}
NON_FINITE: Final = 8


def _written(part: str, /, **words: object) -> str:
    """Return what is written by hand, with words put in."""
    text = Path(__file__).with_name(f"{part}.wgsl").read_text("utf-8")
    return Template(text).substitute(words)


def entry(name: str, lines: str) -> str:
    """Return an entry that runs lines for each pixel."""
    return _written("entry", name=name, lines=lines, group=GROUP, row=ROW)


def head(*, hostile: bool) -> str:
    """Return what all shaders begin with: bindings, and words that stand for no operator."""
    return _written("head") + _written("hostile" if hostile else "plain")


@lru_cache(maxsize=32)
def shader(m: int, zeroth: str | None, *, images: bool, hostile: bool = False) -> str:
    """Return the shader of an order.

    ``zeroth``: how b_0 was measured; None for moments that are.
    ``images``: for raw images; else for moments, which are not among the results.
    ``hostile``: with each quotient and root wrong by up to two units in the last place, as WGSL
    allows a device to have them.
    """
    found = head(hostile=hostile)
    if images and zeroth is not None:
        found += entry("measure", _measured(m, zeroth))
    estimated = zeroth == "estimated"
    here = _smoothed(m, estimated=estimated, kept=images) + _analysed(m, estimated=estimated)
    return found + entry("analyse", here)


def rows(m: int, *, images: bool) -> int:
    """Return how many rows of a number a pixel the results have, those of moments at the end."""
    return len(PLANES) + 2 * m + (2 * (m + 1) if images else 0)


def _measured(m: int, zeroth: str) -> str:
    """Return what makes calibrated moments of raw images, and their flag."""
    writer = Writer()
    first = ZEROTH[zeroth]
    image = [writer.put(f"image({i}u, p, pixels)") for i in range(first + 4 * m)]
    zero = 0.0 * image[0]
    found: list[Any] = [(zero, zero)]
    largest: Any = zero
    if zeroth == "low-frequency":
        x, y, largest = phasors.bucket(*image[:4])
        found = [(phasors.low_frequency(x, y), zero)]
    elif zeroth == "on-off":
        x, largest = phasors.on_off(*image[:2])
        found = [(x, zero)]
    for j in range(first, len(image), 4):
        x, y, here = phasors.bucket(*image[j : j + 4])
        found.append((x, y))
        largest = larger(largest, here)
    saturated: Any = largest >= writer.put("params.full_scale")
    writer.lines.append("let place = places[min(p, arrayLength(&places) - 1u)];")
    for j, (x, y) in enumerate(found):
        at = f"{j}u * select(1u, pixels, params.stride == 1u) + p * params.stride"
        writer.lines += [
            f"var z{j} = vec2<f32>({literal(x)}, {literal(y)});",
            f"if (place > 0u) {{ z{j} = replaced[{j}u * params.bad + place - 1u]; }}",
            f"let g{j} = inverse[{at}];",
        ]
        parts: Any = [Traced(writer, f"{name}{j}.{part}") for name in "zg" for part in "xy"]
        u, v = phasors.calibrated(*parts)
        moment = f"vec2<f32>({literal(u)}, {literal(v)})"
        writer.lines.append(f"moments[{j}u * pixels + p] = {moment};")
    flag = f"select(0u, 4u, {literal(saturated)} && place == 0u)"
    writer.lines.append(f"out[{len(PLANES) - 1}u * pixels + p] = {flag};")
    return "\n".join(writer.lines)


def _smoothed(m: int, *, estimated: bool, kept: bool) -> str:
    """Return what smooths the moments of a pixel into re and im, and whether they are finite."""
    lines = ["let norm = weights[p];", "var sound = finite(norm);"]
    lines += [f"var b{j} = vec2<f32>(0.0, 0.0);" for j in range(m + 1)]
    sums = "\n".join(f"b{j} += weight * moments[{j}u * pixels + at];" for j in range(m + 1))
    lines.append(_written("smoothing", sums=sums))
    if estimated:
        lines.append("b0 = vec2<f32>(0.0, 0.0);")
    for j in range(m + 1):
        lines.append(f"b{j} *= norm;")
        lines.append(f"sound = sound && finite(b{j}.x) && finite(b{j}.y);")
        at = f"({rows(m, images=False) + 2 * j}u * pixels + 2u * p)"
        if kept:
            lines += [
                f"out[{at}] = bitcast<u32>(b{j}.x);",
                f"out[{at} + 1u] = bitcast<u32>(b{j}.y);",
            ]
    lines += [f"b{j} = select(vec2<f32>(0.0, 0.0), b{j}, sound);" for j in range(m + 1)]
    return "\n".join([*lines, ""])


def _analysed(m: int, *, estimated: bool) -> str:
    """Return what makes everything else of moments b0 .. bm, which are zero where unsound."""
    writer, order = Writer(), (0,) * m
    one = writer.put("1.0")
    re: Any = [writer.put(f"b{j}.x") for j in range(m + 1)]
    im: Any = [0.0 * one, *(writer.put(f"b{j}.y") for j in range(1, m + 1))]
    epsilon, least = writer.put("params.epsilon"), writer.put("params.least")
    if estimated:
        re[0] = 0.0 * one
    unit = list(re), list(im)
    scale = toeplitz.relative(order, *unit)
    smallest = scale * eigenvalue.smallest_eigenvalue(order, *unit)
    if estimated:
        re[0], smallest = eigenvalue.least_zeroth(smallest, epsilon)
    finite, dark, biased, validity, brightness, uniform = eigenvalue.margin(
        order, re, im, smallest, epsilon, least
    )
    re[0] = brightness
    phases: Any = [one] * m
    weights: Any = [one] * m
    turns = half_turns(m, np.float32)
    count, residual = sparse.returns(
        order, turns, STEPS, EPS, one, uniform, re, im, phases, weights
    )
    threshold: Any = writer.put("params.threshold")
    direct, indirect, angle = sparse.separate(order, threshold, one, phases, weights)
    range_m: Any = angle * writer.put("params.metres")
    sound = writer.put("sound", "bool")
    valid: Any = sound & finite & ~dark
    for row, value in enumerate((brightness, validity, uniform)):
        writer.store(f"{row}u", value, "sound")
    writer.store("5u", range_m, valid.name)
    others = {3: direct, 4: indirect, 6: residual}
    others |= dict(enumerate([*phases, *weights], len(PLANES)))
    for row, value in others.items():
        writer.store(f"{row}u", value)
    packed = f"out[{len(PLANES) - 1}u * pixels + p]"
    flags = [f"({packed} & 4u)", f"select({NON_FINITE}u, 0u, sound && {literal(finite)})"]
    flags += [
        f"select(0u, 2u, sound && {literal(dark)})",
        f"select(0u, 1u, sound && {literal(biased)})",
    ]
    packing = f"{packed} = {' | '.join(flags)} | (u32({literal(count)}) << 8u);"
    return "\n".join([*writer.lines, packing])

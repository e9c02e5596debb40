"""The likelihood of few returns as a shader, and frames of it on a device."""

from functools import lru_cache
from typing import Any

import numpy as np

from transientcam_compiled import empty
from transientcam_moments._gpu._passes import KEYS
from transientcam_moments._gpu._shader import ENTRY, head
from transientcam_moments._gpu._tracing import Writer, literal
from transientcam_moments.arrays import Array
from transientcam_moments.likelihood import planar, scaled


@lru_cache(maxsize=16)
def likelihood_shader(
    m: int, returns: int, shapes: tuple[int, ...], *, hostile: bool = False
) -> str:
    """Return the shader that estimates the returns of pixels from m + 1 moments."""
    writer = Writer()
    lines = [f"let variances = {m + 1}u * pixels;", "var sound = true;"]
    for j in range(m + 1):
        lines += [
            f"let at{j} = {j}u * pixels + p;",
            f"let b{j} = moments[at{j}];",
            f"let v{j} = moments[variances + (at{j} >> 1u)][at{j} & 1u];",
            f"sound = sound && (v{j} <= 0.0 || !finite(v{j}) || finite(b{j}.x) && finite(b{j}.y));",
        ]
    one: Any = writer.put("1.0")
    re: list[Any] = [writer.put(f"b{j}.x") for j in range(m + 1)]
    im: list[Any] = [writer.put(f"b{j}.y") for j in range(m + 1)]
    weight: list[Any] = [writer.put(f"select(0.0, v{j}, sound)") for j in range(m + 1)]
    error, threshold = writer.put("params.epsilon"), writer.put("params.threshold")
    order, slots = (0,) * m, min(returns, m)
    scale, numbers, penalty, usable = scaled.prepare(order, error, one, re, im, weight)
    data = planar.Data(re, im, weight, penalty, numbers)
    found = planar.fit(data, returns, shapes, threshold)
    out = [one] * scaled.rows(slots)
    scaled.attributes((0,) * slots, found, scale, numbers, usable, out)
    lines += writer.lines
    lines += [
        f"out[{row}u * pixels + p] = bitcast<u32>({literal(each)});" for row, each in enumerate(out)
    ]
    return head(hostile=hostile) + ENTRY % ("estimate", "\n".join(lines))


class DeviceFits:
    """Estimates the returns of frames of one order and size on a device, as a kernel does."""

    def __init__(
        self, m: int, pixels: int, returns: int, shapes: tuple[int, ...], error: float,
        threshold: float, *, hostile: bool = False,
    ) -> None:  # fmt: skip
        self._slots, self._pixels = min(returns, m), pixels
        self.code = likelihood_shader(m, returns, shapes, hostile=hostile)
        size = 4 * pixels * (m + 1)
        self.sizes = (0, 0, (3 * size + 7) // 8 * 8, 4 * pixels * scaled.rows(self._slots))
        self.key = next(KEYS)
        params = np.zeros(12, np.uint32)
        params[:2] = pixels, 1
        params[6:].view(np.float32)[[0, 3, 5]] = error, threshold, np.nan
        self.inputs: tuple[Array, ...] = (params, *[np.zeros(4, np.float32)] * 3)

    def given(self, b: Array, variance: Array) -> list[Array]:
        """Return what goes to the device of a frame."""
        parts = [np.ascontiguousarray(b, np.complex64).view(np.float32).reshape(-1)]
        parts.append(np.ascontiguousarray(variance, np.float32).reshape(-1))
        return [np.concatenate([*parts, np.zeros(parts[1].size % 2, np.float32)])]

    def rows_of(self, room: Any) -> tuple[Any, ...]:
        """Return the attributes of `Likelihood` that the device left in memory."""
        values = np.frombuffer(room, np.float32, self.sizes[3] // 4).reshape(-1, self._pixels)
        out = empty(values.shape, np.float32)
        out[...] = values
        return scaled.arranged(list(out), self._slots)

"""What devices compute in the place of kernels: likelihoods, films and integrals of densities."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from transientcam_moments._dispatch import PLANAR
from transientcam_moments._gpu._passes import KEYS
from transientcam_moments._gpu._shader import entry, head
from transientcam_moments._gpu._tracing import VECTOR, Complex, Planes, Writer
from transientcam_moments.arrays import Array, parts
from transientcam_moments.likelihood import planar, scaled
from transientcam_moments.moment_problem import Coefficients, evaluation, integrals, toeplitz

_MOST_ERROR: Final = 1e-5
"""Of the closed form of an integral, of b_0; other pixels are redone in double."""


class _Text(Writer):
    """The text of a shader whose pixels have so many complex numbers."""

    def __init__(self, rows: int) -> None:
        super().__init__()
        self._table = f"{rows}u * pixels + t"
        self.q = Planes(Complex(self, f"q{row}", VECTOR) for row in range(rows))
        self.lines = [f"var q{row} = moments[{row}u * pixels + p];" for row in range(rows)]

    def sound(self) -> Planes:
        """Return the pixel's numbers, all 0 where one of them is not finite."""
        finite = (f"finite({z.name}.x) && finite({z.name}.y)" for z in self.q)
        self.lines.append(f"let sound = {' && '.join(finite)};")
        self.lines += [f"{z.name} = select({VECTOR}(), {z.name}, sound);" for z in self.q]
        return self.q

    @contextmanager
    def phases(self, width: int) -> Iterator[Planes]:
        """Write a loop over phases; inside, what the table has of each."""
        with self.loop("for (var t = 0u; t < params.radius; t++)"):
            at = (f"moments[{self._table} * {width}u + {k}u]" for k in range(width))
            yield Planes(self.put(each, VECTOR) for each in at)


def _likelihood(m: int, returns: int, shapes: tuple[int, ...]) -> _Text:
    text = _Text(m + 1 + (m + 2) // 2)
    one: Any = text.put("1.0")
    (re, im), rest = parts(Planes(text.q[: m + 1])), text.q[m + 1 :]
    variances = [each for z in rest for each in (z.real, z.imag)][: m + 1]
    text.lines.append("var sound = true;")
    for x, y, v in zip(re, im, variances, strict=True):
        known = f"{v.name} <= 0.0 || !finite({v.name}) || finite({x.name}) && finite({y.name})"
        text.lines.append(f"sound = sound && ({known});")
    weight: Any = [text.put(f"select(0.0, {v.name}, sound)") for v in variances]
    error, threshold = text.put("params.epsilon"), text.put("params.threshold")
    scale, numbers, penalty, usable = scaled.prepare((0,) * m, error, one, re, im, weight)
    found = planar.fit(planar.Data(re, im, weight, penalty, numbers), returns, shapes, threshold)
    slots = min(returns, m)
    out = [one] * scaled.rows(slots)
    scaled.attributes((0,) * slots, found, scale, numbers, usable, out)
    for row, each in enumerate(out):
        text.store(f"{row}u", each)
    return text


def _opened(m: int) -> tuple[_Text, Planes, Planes, Any]:
    """Return a text whose pixels have Eq. (2)'s a_1 .. a_m, reflection coefficients and E."""
    text = _Text(2 * m + 1)
    q = text.sound()
    return text, Planes(q[:m]), Planes(q[m : 2 * m]), q[2 * m].real


def _density(m: int) -> _Text:
    order, (text, a, g, error) = (0,) * m, _opened(m)
    given = order, error * (0.5 / np.pi), toeplitz.least_modulus(order, *parts(g)), *parts(a)
    with text.phases(m) as table:
        height, _ = evaluation.any_two(*given, *parts(table), *parts(table))
        text.store("t", height, "sound")
    return text


def _cumulative(m: int) -> _Text:
    text, a, g, scale = _opened(m)
    polynomial = Planes([text.put(f"{VECTOR}(1.0, 0.0)", VECTOR), *a])
    b0, terms, error = integrals.expansion(Coefficients(scale, polynomial, g))
    text.store("params.radius", error)
    with text.phases(2) as (turns, backwards):
        text.store("t", integrals.until(b0, terms, turns.real, turns.imag, backwards), "sound")
    return text


@lru_cache(maxsize=32)
def kernel_shader(name: str, m: int, *variant: Any, hostile: bool = False) -> str:
    """Return the shader of a kernel of an order; of a likelihood, for returns and shapes."""
    text: _Text = globals()[f"_{name}"](m, *variant)
    return head(hostile=hostile) + entry("estimate", "\n".join(text.lines))


class Asked(NamedTuple):
    """What goes to a device: planes (n, P), then a table (T, k) of phases; and what comes back."""

    data: Array
    phases: int
    rows: int
    numbers: tuple[float, float] = (0.0, 0.0)
    variant: tuple[Any, ...] = ()


def asked(name: str, given: tuple[Any, ...]) -> Asked:
    """Return what the arguments of a kernel ask for."""
    if name == "likelihood":
        b, variance, returns, _, *numbers = given
        pairs = np.zeros(((len(b) + 1) // 2, b.shape[1], 2), np.float32)
        for j, each in enumerate(variance):
            pairs[j // 2, :, j % 2] = each
        rows = scaled.rows(min(returns, len(b) - 1))
        return Asked(_joined(b, pairs.view(np.complex64)), 0, rows, (*numbers,), given[2:4])
    a, reflection, error, phase = given
    turns, rest = np.divmod(phase, 2 * np.pi)
    table, rows = np.stack([turns + 1j * rest, np.exp(-1j * rest)], 1), len(phase) + 1
    if name == "density":
        table, rows = np.exp(1j * phase[:, None] * np.arange(1, len(a))), len(phase)
    return Asked(_joined(a[1:], reflection, error, table), len(phase), rows)


def _joined(*parts: Array) -> Array:
    return np.concatenate([each.reshape(-1) for each in parts], dtype=np.complex64)


def _redone(out: Array, a: Array, reflection: Array, error: Array, phase: Array) -> Array:
    ill = np.flatnonzero(~(out[-1] <= _MOST_ERROR) & (error > 0))
    planes = (each[..., ill] for each in (a, reflection, error))
    out[:-1, ill] = PLANAR["cumulative"](*planes, phase)
    return out[:-1]


ARRANGED: Final[dict[str, Callable[..., Any]]] = {
    "likelihood": lambda out, b, _, most, *rest: scaled.arranged([*out], min(most, len(b) - 1)),
    "density": lambda out, *_: out,
    "cumulative": _redone,
}
"""By the name of a kernel: of rows of results and the kernel's arguments, what it returns."""


class DeviceKernel:
    """Computes what a kernel does of so many pixels and phases on a device."""

    def __init__(self, name: str, m: int, pixels: int, one: Asked, *, hostile: bool) -> None:
        self.code = kernel_shader(name, m, *one.variant, hostile=hostile)
        self.key, self.pixels = next(KEYS), pixels
        self.sizes = (0, 0, one.data.nbytes, 4 * one.rows * pixels)
        params = np.zeros(12, np.uint32)
        params[:3] = pixels, 1, one.phases
        params[6:].view(np.float32)[[0, 3, 5]] = *one.numbers, np.nan
        self.inputs: tuple[Array, ...] = (params, *[np.zeros(4, np.float32)] * 3)

"""Statements of algorithms, called with planes that write down in WGSL what is done to them.

`arrays` has the words of which algorithms are stated once; here they get a third meaning. A traced
plane is one pixel's number in a shader. Straight-line arithmetic becomes one ``let`` an operation,
the same one twice only one, and `repeat` a loop. What `some` would leave out is always there.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import numpy as np

from transientcam_moments.moment_problem import phase_of

VECTOR: Final = "vec2<f32>"


class Writer:
    """The text of a shader's function, as far as it is written."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._known: dict[str, str] = {}
        self._names = 0

    def put(self, text: str, kind: str = "f32") -> Any:  # it stands for a Plane, or a Mask
        """Return the value of an expression, computed here unless it is known."""
        name = self._known.get(text)
        if name is None:
            name = self._known[text] = self._name()
            self.lines.append(f"let {name}: {kind} = {text};")
        return (Complex if kind == VECTOR else Traced)(self, name, kind)

    def variable(self, value: Any) -> str:
        """Return the name of a new variable that begins as a plane or a number."""
        name = self._name()
        kind = value.kind if isinstance(value, Traced) else "f32"
        self.lines.append(f"var {name}: {kind} = {literal(value)};")
        return name

    def values_of(self, names: list[str], state: Any, when: str) -> list[Any]:
        """Return what variables of the planes of a state have now."""
        kinds = [getattr(plane, "kind", "f32") for plane in _planes(state)]
        named = zip(names, kinds, strict=True)
        return [self.put(f"{name} /* {when} */", kind) for name, kind in named]

    def assign(self, names: list[str], state: Any) -> None:
        """Give variables the values of the planes of a state."""
        for name, plane in zip(names, _planes(state), strict=True):
            self.lines.append(f"{name} = {literal(plane)};")

    def store(self, row: str, value: Any, when: str = "true") -> None:
        """Put a number in a row of the results; NaN where it is none."""
        number = f"select(params.nan, {literal(value)}, {when})"
        self.lines.append(f"out[({row}) * pixels + p] = bitcast<u32>({number});")

    @contextmanager
    def loop(self, head: str) -> Iterator[None]:
        """Write a loop; what is computed inside is not known behind it."""
        known = dict(self._known)
        self.lines.append(f"{head} {{")
        yield
        self.lines.append("}")
        self._known = known

    def _name(self) -> str:
        self._names += 1
        return f"t{self._names}"


def _operator(text: str, kind: str = "f32") -> Callable[..., Any]:
    def put(self: "Traced", *other: Any) -> Any:
        others = map(_vector if kind == VECTOR else literal, other)
        return self.writer.put(text.format(self.name, *others), kind)

    return put


class Traced:
    """A pixel's number, or truth value (``kind`` "bool"), by its name in the shader."""

    __array_ufunc__ = None  # NumPy's numbers leave operations to this class
    dtype = np.dtype(np.float32)
    real = property(lambda self: self)
    __hash__ = None  # type: ignore[assignment]  # as planes

    def __init__(self, writer: Writer, name: str, kind: str = "f32") -> None:
        self.writer, self.name, self.kind = writer, name, kind

    def __array_namespace__(self) -> Any:
        return Words

    def __truediv__(self, other: Any) -> Any:
        if not isinstance(other, Traced):  # rounded to no more than half a unit
            return self * (1.0 / float(other))
        return self.writer.put(f"quotient({self.name}, {other.name})")

    __add__, __radd__ = _operator("{0} + {1}"), _operator("{1} + {0}")
    __sub__, __rsub__ = _operator("{0} - {1}"), _operator("{1} - {0}")
    __mul__, __rmul__ = _operator("{0} * {1}"), _operator("{1} * {0}")
    __rtruediv__ = _operator("quotient({1}, {0})")
    __neg__, __abs__, __invert__ = (
        _operator("-{0}"),
        _operator("abs({0})"),
        _operator("!{0}", "bool"),
    )
    __lt__, __le__ = _operator("{0} < {1}", "bool"), _operator("{0} <= {1}", "bool")
    __gt__, __ge__ = _operator("{0} > {1}", "bool"), _operator("{0} >= {1}", "bool")
    __and__, __or__ = _operator("{0} & {1}", "bool"), _operator("{0} | {1}", "bool")


class Complex(Traced):
    """A pixel's complex number."""

    real, imag = property(_operator("{0}.x")), property(_operator("{0}.y"))
    conj, __neg__ = _operator("conjugate({0})", VECTOR), _operator("-{0}", VECTOR)
    __add__ = __radd__ = _operator("{0} + {1}", VECTOR)
    __sub__, __rsub__ = _operator("{0} - {1}", VECTOR), _operator("{1} - {0}", VECTOR)

    def __mul__(self, other: Any) -> Any:
        text = "times({}, {})" if isinstance(other, Complex) else "{} * {}"
        return self.writer.put(text.format(self.name, literal(other)), VECTOR)

    def __truediv__(self, other: Any) -> Any:
        return self * (1.0 / other)

    __rmul__ = __mul__


def _vector(value: Any) -> str:
    return value.name if isinstance(value, Complex) else f"{VECTOR}({literal(value)}, 0.0)"


class Planes(list[Any]):
    """Planes of a pixel, as an array of them."""

    shape = property(lambda self: (len(self),))
    __array_namespace__ = Traced.__array_namespace__


def literal(value: Any) -> str:
    """Return how a plane or a number is written; WGSL has neither NaN nor infinity."""
    if isinstance(value, Traced):
        return value.name
    number = float(value)
    if math.isnan(number):
        return "params.nan"
    return repr(
        math.copysign(float(np.finfo(np.float32).max), number) if math.isinf(number) else number
    )


class Words:
    """The words of `arrays` that are no operators, by the names that it asks a namespace for."""

    stack = Planes
    ones_like = staticmethod(lambda x: 0.0 * x + 1.0)
    log, log1p = staticmethod(_operator("log_of({0})")), staticmethod(_operator("log_1p({0})"))
    to_complex = staticmethod(
        lambda x, y: x.writer.put(f"{VECTOR}({literal(x)}, {literal(y)})", VECTOR)
    )
    where = staticmethod(
        lambda mask, yes, no: mask.writer.put(
            f"select({literal(no)}, {literal(yes)}, {mask.name})", getattr(yes, "kind", "f32")
        )
    )

    @staticmethod
    def arctan2(y: Any, x: Any) -> Any:
        """Return the angle of a point, from -pi to pi."""
        inverse = 1.0 / Words.sqrt(x * x + y * y)
        angle = phase_of(x * inverse, abs(y) * inverse)
        return Words.where(y < 0.0, -angle, angle)

    maximum = staticmethod(_operator("max({0}, {1})"))
    minimum = staticmethod(_operator("min({0}, {1})"))
    sqrt = staticmethod(_operator("root_of({0})"))

    @staticmethod
    def lost_by_squaring(x: Traced, square: Traced) -> Any:
        """Do as the word does, where products and sums may be fused, or not.

        The square is what it was rounded to, here and in all that comes after.
        """
        square.name = x.writer.put(f"rounded({square.name})").name
        return x.writer.put(f"lost_by_squaring({x.name}, {square.name})")

    @staticmethod
    def asarray(values: Any) -> Any:
        """Return numbers as they are: they stand in the shader."""
        return values

    @staticmethod
    def iterate(
        body: Any,
        steps: int,
        fixed: tuple[Any, ...],
        given: tuple[Any, ...],
        state: Any,
        *,
        alike: bool,
    ) -> Any:
        """As `repeat`: a loop, before which the first step stands unless all are alike."""
        writer: Writer = state[0].writer
        if not alike:
            state = body(True, fixed, given, state)
        names = [writer.variable(plane) for plane in _planes(state)]
        step = f"i{names[0]}"
        head = f"for (var {step} = {int(not alike)}; {step} < {steps} && {names[0]}; {step}++)"
        with writer.loop(head):
            # once a step: names of variables stand for other values in each
            inside = _formed(state, writer.values_of(names, state, f"in {step}"))
            writer.assign(names, body(False, fixed, given, inside))
        return _formed(state, writer.values_of(names, state, f"behind {step}"))

    @staticmethod
    def branch(mask: Traced, function: Callable[[], Any], otherwise: Any) -> Any:
        """Return what a function gives where a mask is true, whose work is left out elsewhere."""
        writer = mask.writer
        names = [writer.variable(plane) for plane in otherwise]
        with writer.loop(f"if ({mask.name})"):
            writer.assign(names, (function(),))
        return writer.values_of(names, otherwise, f"behind {mask.name}")


def _planes(state: Any) -> list[Any]:
    return [
        plane for part in state for plane in (part if isinstance(part, list | tuple) else [part])
    ]


def _formed(state: Any, planes: list[Any]) -> tuple[Any, ...]:
    """Return other planes in the form of a state."""
    rest = iter(planes)
    return tuple(
        [next(rest) for _ in part] if isinstance(part, list) else next(rest) for part in state
    )

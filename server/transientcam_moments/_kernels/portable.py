"""The words of `arrays`, and all that is stated with them, for vectors of pixels.

Statements are compiled as they stand: kernels take words and statements alike from here or from
where they are stated, once this module has been imported.
"""

# llvmlite declares neither a value's type nor all arguments
# pyright: reportAttributeAccessIssue=false, reportCallIssue=false

import inspect
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it has no annotations
from numba import types as numba_types
from numba.core import cgutils as numba_cgutils

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.simd import (
    Lanes,
    Mask,
    Operands,
    Registers,
    extending,
    templates,
)
from transientcam_moments.arrays import (
    arctangent_ratio,
    arithmetic,
    bank,
    close,
    eps,
    infinity,
    large,
    larger,
    largest,
    least,
    logarithm,
    lost_by_squaring,
    magnitude,
    multiply_rows,
    not_a_number,
    product_bank,
    repeat,
    root,
    root_eps,
    rounding,
    select,
    small,
    smaller,
    some,
    square_bank,
    tiny,
)
from transientcam_moments.images import phasors
from transientcam_moments.likelihood import choice, linear, pair_fit, scaled, sharp, start, tail
from transientcam_moments.moment_problem import (
    circle,
    eigenvalue,
    evaluation,
    extension,
    maxima,
    sorting,
    sparse,
    toeplitz,
)
from transientcam_moments.noise import first_order, interpolation

types: Any = numba_types
cgutils: Any = numba_cgutils


def _room(function: Callable[..., Any], size: Callable[[int, Any], int | None]) -> None:
    """Give a function that makes room its meaning; it lasts until the calling function returns."""

    @templates.infer_global(function)
    class _Template(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
        def generic(self, args: Any, kws: Any) -> Any:
            like, length, further = args
            count = size(len(length), further) if isinstance(like, Lanes) else None
            if count is None:
                return None
            return templates.signature(Registers(like, count), like, length, further)

    @extending.lower_builtin(function, Lanes, types.Any, types.Any)
    def _lower(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        item = context.get_value_type(sig.return_type.item)
        return cgutils.alloca_once(builder, item, size=sig.return_type.size)


def _more(length: int, number: Any) -> int | None:
    return length + number.literal_value if isinstance(number, types.IntegerLiteral) else None


def _squared(length: int, number: Any) -> int | None:
    total = _more(length, number)
    return None if total is None else total**2


_room(bank, _more)
_room(square_bank, _squared)
_room(product_bank, lambda length, other: length * len(other))


class _LengthUpTo(types.Type):  # type: ignore[misc]  # numba is untyped
    """A `Length` that is known when a kernel is called; rooms are made for the most it can be."""

    def __init__(self, most: int) -> None:
        self.most = most
        super().__init__(name=f"LengthUpTo({most})")

    def __len__(self) -> int:
        return self.most


@extending.register_model(_LengthUpTo)
class _LengthModel(extending.models.PrimitiveModel):  # type: ignore[misc]  # numba is untyped
    def __init__(self, dmm: Any, fe_type: _LengthUpTo) -> None:
        super().__init__(dmm, fe_type, ir.IntType(64))


@extending.intrinsic
def length_up_to(context: Any, length: Any, most: Any) -> Any:
    """Return what has a length, which is no more than ``most``."""
    if not isinstance(most, types.IntegerLiteral):
        return None
    made = _LengthUpTo(most.literal_value)(length, most)
    return made, lambda context, builder, sig, args: args[0]


@templates.infer_global(len)
class _Len(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
    def generic(self, args: Any, kws: Any) -> Any:
        known = not isinstance(args[0], _LengthUpTo)
        return None if known else templates.signature(types.intp, *args)


@extending.lower_builtin(len, _LengthUpTo)
def _lower_len(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
    return args[0]


def _limits(x: ir.Value) -> Any:
    return np.finfo(np.float32 if isinstance(x.type.element, ir.FloatType) else np.float64)


def _vector(x: ir.Value, value: float) -> ir.Constant:
    """Return a number in every pixel of a vector of the type of `x`."""
    return ir.Constant(x.type, [value] * x.type.count)


def _word(
    word: Callable[..., Any],
    operands: int,
    emit: Callable[..., ir.Value],
    result: Callable[[Lanes], Any] = lambda lanes: lanes,
    of: type = Lanes,
) -> None:
    simd.define(word, of, operands, emit, result)


def _constant(word: Callable[[Any], Any]) -> None:
    """Give a number that depends on the precision of a plane its meaning."""

    def emit(builder: ir.IRBuilder, x: ir.Value) -> ir.Value:
        return _vector(x, float(word(np.empty(0, _limits(x).dtype))))

    _word(word, 1, emit)


def _llvm(name: str) -> Callable[..., ir.Value]:
    """Return what calls LLVM's vector intrinsic ``name``."""

    def emit(builder: ir.IRBuilder, *operands: ir.Value) -> ir.Value:
        vector = operands[0].type
        kind = ir.FunctionType(vector, [vector] * len(operands))
        full = f"llvm.{name}.v{vector.count}f{_limits(operands[0]).bits}"
        callee = cgutils.get_or_insert_function(builder.module, kind, full)
        return builder.call(callee, operands)

    return emit


def _of_two(code: str) -> Callable[..., ir.Value]:
    return lambda builder, x, y: builder.select(builder.fcmp_ordered(code, x, y), x, y)


def _lost_by_squaring(builder: ir.IRBuilder, x: ir.Value, square: ir.Value) -> ir.Value:
    return _llvm("fma")(builder, x, x, builder.fneg(square))


def _some(builder: ir.IRBuilder, mask: ir.Value) -> ir.Value:
    bits = ir.IntType(mask.type.count)
    return builder.icmp_unsigned("!=", builder.bitcast(mask, bits), bits(0))


# Of a NaN and a number both return their second argument.
_word(larger, 2, _of_two(">"))
_word(smaller, 2, _of_two("<"))
_word(root, 1, _llvm("sqrt"))
_word(magnitude, 1, _llvm("fabs"))
_word(lost_by_squaring, 2, _lost_by_squaring)
_word(some, 1, _some, lambda mask: types.boolean, Mask)
for _number in (
    rounding, least, eps, root_eps, close, tiny, largest, infinity, not_a_number, large,
    small,
):  # fmt: skip
    _constant(_number)


@templates.infer_global(select)
class _Select(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
    def generic(self, args: Any, kws: Any) -> Any:
        lanes = args[1] if isinstance(args[1], Lanes) else args[2]
        fits = isinstance(args[0], Mask) and isinstance(lanes, Lanes)
        return templates.signature(lanes, args[0], lanes, lanes) if fits else None


@extending.lower_builtin(select, Mask, Lanes, Lanes)
def _select(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
    return builder.select(*args)


def _arctangent_ratio(builder: ir.IRBuilder, square: ir.Value) -> ir.Value:
    terms = arithmetic.arctangent_terms(_limits(square).dtype)
    total = _vector(square, terms[-1])
    for term in reversed(terms[:-1]):
        product = builder.fmul(total, square, flags=simd.FUSE)
        total = builder.fadd(product, _vector(square, term), flags=simd.FUSE)
    return total


_word(arctangent_ratio, 1, _arctangent_ratio)


@extending.overload(repeat, jit_options={"error_model": "numpy", "forceinline": True})
def _repeat(body: Any, steps: Any, fixed: Any, given: Any, state: Any) -> Callable[..., Any]:
    def run(body: Any, steps: Any, fixed: Any, given: Any, state: Any) -> Any:
        for step in range(steps):
            state = body(step == 0, fixed, given, state)
            if not some(state[0]):
                break
        return state

    return run


@extending.overload(multiply_rows, jit_options={"error_model": "numpy", "forceinline": True})
def _multiply_rows(values: Any, length: Any, table: Any, out: Any) -> Callable[..., Any]:
    def run(values: Any, length: Any, table: Any, out: Any) -> Any:
        n = len(length) + 1
        for row in range(n):
            for j in range(n):
                total = simd.spread(values[0], 0.0)
                for i in range(n):
                    total = total + values[row * n + i] * table[i, j]
                out[row * n + j] = total

    return run


# without the two entries of each function that Python and C would call it by
_CALLED_BY_KERNELS: dict[str, Any] = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


def _compile_statements(module: ModuleType, *, inline: bool) -> None:
    """Let kernels call what a module states."""
    for function in vars(module).values():
        if inspect.isfunction(function) and function.__module__ == module.__name__:
            extending.register_jitable(**_CALLED_BY_KERNELS, forceinline=inline)(function)


extending.register_jitable(**_CALLED_BY_KERNELS)(logarithm)
for _module in (choice, linear, pair_fit, scaled, sharp, start, tail):
    _compile_statements(_module, inline=False)
for _module in (
    toeplitz,
    eigenvalue,
    circle,
    evaluation,
    extension,
    maxima,
    sorting,
    sparse,
    interpolation,
    first_order,
    phasors,
):
    _compile_statements(_module, inline=True)

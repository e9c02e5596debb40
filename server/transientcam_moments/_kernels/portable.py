"""What the fits of `likelihood` need beyond + - * /, for vectors of pixels.

The functions of `transientcam_moments.likelihood` are compiled as they stand there: the arithmetic
that they call has its meaning for lanes here.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it has no annotations
from numba import types as numba_types
from numba.core import cgutils as numba_cgutils

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.simd import Lanes, Mask, Registers, extending, templates
from transientcam_moments.likelihood import arithmetic, choice, linear, pair_fit, sharp, tail

types: Any = numba_types
cgutils: Any = numba_cgutils


def _room(function: Callable[..., Any], size: Callable[[int, Any], int | None]) -> None:
    """Give a function that makes room its meaning; the room is the calling function's."""

    @templates.infer_global(function)
    class _Template(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
        def generic(self, args: Any, kws: Any) -> Any:
            like, length, further = args
            count = size(len(length), further) if isinstance(like, Lanes) else None
            if count is None:
                return None
            return templates.signature(Registers(like, count), like, length, further)

    @extending.lower_builtin(function, Lanes, types.Any, types.Any)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        item = context.get_value_type(sig.return_type.item)
        return cgutils.alloca_once(builder, item, size=sig.return_type.size)


def _more(length: int, number: Any) -> int | None:
    return length + number.literal_value if isinstance(number, types.IntegerLiteral) else None


def _squared(length: int, number: Any) -> int | None:
    total = _more(length, number)
    return None if total is None else total**2


_room(arithmetic.bank, _more)
_room(arithmetic.square_bank, _squared)
_room(arithmetic.product_bank, lambda length, other: length * len(other))


def _same(vector: Any) -> Any:
    return vector


def _root(builder: Any, x: Any) -> Any:
    kind = ir.FunctionType(x.type, [x.type])
    name = f"llvm.sqrt.v{x.type.count}f{32 if isinstance(x.type.element, ir.FloatType) else 64}"
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [x])


def _constant(value: Callable[[Any], float]) -> Callable[[Any, Any], Any]:
    """Return what gives a number depending on the precision of its argument."""

    def emit(builder: Any, x: Any) -> Any:
        limits = np.finfo(np.float32 if isinstance(x.type.element, ir.FloatType) else np.float64)
        return ir.Constant(x.type, [value(limits)] * x.type.count)

    return emit


simd.define(
    arithmetic.larger, Lanes, 2, lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y), _same
)
simd.define(
    arithmetic.smaller, Lanes, 2, lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y), _same
)
simd.define(arithmetic.root, Lanes, 1, _root, _same)
simd.define(arithmetic.least, Lanes, 1, _constant(lambda limits: float(limits.tiny) ** 0.5), _same)
simd.define(arithmetic.rounding, Lanes, 1, _constant(lambda limits: 8 * float(limits.eps)), _same)


@templates.infer_global(arithmetic.select)
class _Select(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
    def generic(self, args: Any, kws: Any) -> Any:
        lanes = args[1] if isinstance(args[1], Lanes) else args[2]
        fits = isinstance(args[0], Mask) and isinstance(lanes, Lanes)
        return templates.signature(lanes, args[0], lanes, lanes) if fits else None


@extending.lower_builtin(arithmetic.select, Mask, Lanes, Lanes)
def _select(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(*args)


for _function in (
    arithmetic.logarithm,
    linear.decompose,
    linear.solve,
    linear.variances,
    sharp.chi_square,
    sharp.powers,
    sharp.remains,
    sharp.weigh_what_is_left,
    sharp.judge,
    sharp.overlaps,
    sharp.four_sums,
    sharp.kept,
    sharp.try_phases,
    sharp.information,
    sharp.gradient,
    sharp.weigh,
    sharp.turned,
    sharp.step,
    pair_fit.powers,
    pair_fit.weigh,
    pair_fit.chi_square,
    pair_fit.turns,
    pair_fit.begin,
    pair_fit.step,
    pair_fit.first_damping,
    pair_fit.direct,
    sharp.deviations,
    tail.shape,
    tail.turn_back,
    tail.weigh,
    tail.remains,
    tail.information,
    tail.step,
    tail.deviations,
    choice.nothing,
    choice.offer_returns,
    choice.start_of_tail,
    choice.offer_tail,
    choice.chosen,
    choice.has_tail,
    choice.vary_returns,
    choice.vary_tail,
):
    extending.register_jitable(error_model="numpy")(_function)

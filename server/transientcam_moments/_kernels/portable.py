"""What the fits of `likelihood` need beyond + - * /, for vectors of pixels.

The functions of `transientcam_moments.likelihood` are compiled as they stand there: the arithmetic
that they call has its meaning for lanes here.
"""

from collections.abc import Callable
from typing import Any

from numba import types as numba_types
from numba.core import cgutils as numba_cgutils

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.simd import Lanes, Registers, extending, templates
from transientcam_moments.likelihood import arithmetic, choice, linear, sharp, tail

types: Any = numba_types
cgutils: Any = numba_cgutils


def _room(function: Callable[..., Any], size: Callable[[int, int], int]) -> None:
    """Give a function that makes room its meaning; the room is the calling function's."""

    @templates.infer_global(function)
    class _Template(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
        def generic(self, args: Any, kws: Any) -> Any:
            like, length, extra = args
            if not isinstance(like, Lanes) or not isinstance(extra, types.IntegerLiteral):
                return None
            room = Registers(like, size(len(length), extra.literal_value))
            return templates.signature(room, like, length, extra)

    @extending.lower_builtin(function, Lanes, types.Any, types.Any)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        item = context.get_value_type(sig.return_type.item)
        return cgutils.alloca_once(builder, item, size=sig.return_type.size)


_room(arithmetic.bank, lambda length, extra: length + extra)
_room(arithmetic.square_bank, lambda length, extra: (length + extra) ** 2)


def _meaning(function: Callable[..., Any], compiled: Callable[..., Any]) -> None:
    """Have a function of planes mean a function of lanes."""

    options = {"forceinline": True, "error_model": "numpy"}

    @extending.overload(function, jit_options=options, strict=False)
    def _overload(*args: Any) -> Any:
        return compiled if any(isinstance(arg, Lanes) for arg in args) else None


_meaning(arithmetic.select, lambda mask, yes, no: simd.select(mask, yes, no))
_meaning(arithmetic.larger, lambda x, y: simd.maximum(x, y))
_meaning(arithmetic.smaller, lambda x, y: simd.minimum(x, y))
_meaning(arithmetic.root, lambda x: simd.sqrt(x))
_meaning(arithmetic.least, lambda x: simd.root_of_tiny(x))
_meaning(arithmetic.rounding, lambda x: 8.0 * simd.eps(x))

for _function in (
    arithmetic.logarithm,
    linear.decompose,
    linear.solve,
    linear.variances,
    sharp.chi_square,
    sharp.take_away,
    sharp.weigh_what_is_left,
    sharp.try_phase,
    sharp.information,
    sharp.weigh,
    sharp.step,
    sharp.deviations,
    tail.shape,
    tail.weigh,
    tail.remains,
    tail.information,
    tail.step,
    tail.deviations,
    choice.nothing,
    choice.offer_returns,
    choice.start_of_tail,
    choice.offer_tail,
    choice.phases_of,
):
    extending.register_jitable(error_model="numpy")(_function)

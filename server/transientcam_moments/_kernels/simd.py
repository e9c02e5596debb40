"""Short vectors of pixels as a numba type: a kernel reads like the scalar algorithm.

A ``Lanes`` value holds the same quantity for as many pixels as one register of this machine takes
(16 in float32 with AVX-512, 8 with AVX, 4 with SSE or NEON), so vectorisation doesn't depend on
what an optimiser can prove about a loop, and a group of pixels may leave an iteration as soon as
all of them have converged.

Arithmetic is IEEE: the only freedom given to the compiler is ``contract``, to fuse a product and a
sum into one rounding, so NaN and infinities behave as in NumPy. Comparisons with NaN are False.
"""

# llvmlite declares neither a value's type nor all arguments
# pyright: reportAttributeAccessIssue=false

import operator
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import binding, ir  # type: ignore[import-untyped]  # it has no annotations
from numba import extending as numba_extending, types as numba_types
from numba.core import cgutils as numba_cgutils
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing import templates as numba_templates

# numba is only partly annotated, and what its decorators return isn't what they decorate
cgutils: Any = numba_cgutils
extending: Any = numba_extending
templates: Any = numba_templates
types: Any = numba_types
intrinsic = extending.intrinsic

_INDEX = ir.IntType(32)
FUSE = ("contract",)
Operands = Sequence[ir.Value]


_FEATURES = binding.get_host_cpu_features()


def _register_bytes() -> int:
    return 64 if _FEATURES.get("avx512f") else 32 if _FEATURES.get("avx") else 16


REGISTER_BYTES = _register_bytes()
REGISTERS = 16 if _FEATURES.get("sse2") and not _FEATURES.get("avx512f") else 32
"""What a kernel may hold before it has to put lanes aside into memory."""
LINE_BYTES = min(64, 2 * REGISTER_BYTES)
"""Of a line of memory, or the most of it that two registers fill."""


class Lanes(types.Type):  # type: ignore[misc]  # numba is untyped
    """``count`` numbers of type ``element``, one a pixel."""

    def __init__(self, element: Any, count: int) -> None:
        self.element, self.count = element, count
        super().__init__(name=f"Lanes({element}x{count})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Conversion | None:
        """Numbers spread over all lanes."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None


class Mask(types.Type):  # type: ignore[misc]  # numba is untyped
    """``count`` truth values, one a pixel."""

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(name=f"Mask({count})")


class Registers(types.Type):  # type: ignore[misc]  # numba is untyped
    """``size`` lanes addressed by index: a small array that lives in registers or on the stack."""

    def __init__(self, item: Lanes, size: int) -> None:
        self.item, self.size = item, size
        super().__init__(name=f"Registers({item}x{size})")


@extending.register_model(Lanes)
class _LanesModel(extending.models.PrimitiveModel):  # type: ignore[misc]  # numba is untyped
    def __init__(self, dmm: Any, fe_type: Lanes) -> None:
        element = dmm.lookup(fe_type.element).get_value_type()
        super().__init__(dmm, fe_type, ir.VectorType(element, fe_type.count))


@extending.register_model(Mask)
class _MaskModel(extending.models.PrimitiveModel):  # type: ignore[misc]  # numba is untyped
    def __init__(self, dmm: Any, fe_type: Mask) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(ir.IntType(1), fe_type.count))


@extending.register_model(Registers)
class _RegistersModel(extending.models.PrimitiveModel):  # type: ignore[misc]  # numba is untyped
    def __init__(self, dmm: Any, fe_type: Registers) -> None:
        item = dmm.lookup(fe_type.item).get_value_type()
        super().__init__(dmm, fe_type, item.as_pointer())


def _spread(builder: ir.IRBuilder, vector: Any, scalar: Any) -> Any:
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, _INDEX(0))
    zeros = ir.Constant(ir.VectorType(_INDEX, vector.count), [0] * vector.count)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), zeros)


@extending.lower_cast(types.Float, Lanes)
@extending.lower_cast(types.Integer, Lanes)
def _cast(context: Any, builder: ir.IRBuilder, fromty: Any, toty: Any, val: Any) -> Any:
    scalar = context.cast(builder, val, fromty, toty.element)
    return _spread(builder, context.get_value_type(toty), scalar)


def define(op: Any, kind: type, count: int, emit: Callable[..., Any], result: Any) -> None:
    """Give ``op`` a meaning for ``count`` operands of ``kind``, or of numbers spread to match."""

    @templates.infer_global(op)
    class _Template(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
        def generic(self, args: Any, kws: Any) -> Any:
            vectors = {arg for arg in args if isinstance(arg, kind)}
            others = [arg for arg in args if not isinstance(arg, kind)]
            numbers = kind is Lanes and all(
                isinstance(arg, types.Float | types.Integer) for arg in others
            )
            if len(args) != count or len(vectors) != 1 or not (numbers or not others):
                return None
            vector = vectors.pop()
            return templates.signature(result(vector), *(vector,) * count)

    @extending.lower_builtin(op, *(kind,) * count)
    def _lower(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        return emit(builder, *args)


def _same(vector: Any) -> Any:
    return vector


def _truth(vector: Any) -> Mask:
    return Mask(vector.count)


def _compare(code: str) -> Callable[..., Any]:
    return lambda builder, x, y: builder.fcmp_ordered(code, x, y)


define(operator.add, Lanes, 2, lambda b, x, y: b.fadd(x, y, flags=FUSE), _same)
define(operator.sub, Lanes, 2, lambda b, x, y: b.fsub(x, y, flags=FUSE), _same)
define(operator.mul, Lanes, 2, lambda b, x, y: b.fmul(x, y, flags=FUSE), _same)
define(operator.truediv, Lanes, 2, lambda b, x, y: b.fdiv(x, y), _same)
define(operator.neg, Lanes, 1, lambda b, x: b.fneg(x), _same)
define(operator.lt, Lanes, 2, _compare("<"), _truth)
define(operator.le, Lanes, 2, _compare("<="), _truth)
define(operator.gt, Lanes, 2, _compare(">"), _truth)
define(operator.ge, Lanes, 2, _compare(">="), _truth)
define(operator.eq, Lanes, 2, _compare("=="), _truth)
define(operator.and_, Mask, 2, lambda b, x, y: b.and_(x, y), _same)
define(operator.or_, Mask, 2, lambda b, x, y: b.or_(x, y), _same)
define(operator.invert, Mask, 1, lambda b, x: b.not_(x), _same)


@templates.infer_global(operator.getitem)
class _Get(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
    def generic(self, args: Any, kws: Any) -> Any:
        if isinstance(args[0], Registers) and isinstance(args[1], types.Integer):
            return templates.signature(args[0].item, args[0], types.intp)
        return None


@templates.infer_global(operator.setitem)
class _Set(templates.AbstractTemplate):  # type: ignore[misc]  # numba is untyped
    def generic(self, args: Any, kws: Any) -> Any:
        if isinstance(args[0], Registers) and isinstance(args[1], types.Integer):
            return templates.signature(types.void, args[0], types.intp, args[0].item)
        return None


@extending.lower_builtin(operator.getitem, Registers, types.Integer)
def _getitem(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
    return builder.load(builder.gep(args[0], [args[1]]))


@extending.lower_builtin(operator.setitem, Registers, types.Integer, types.Any)
def _setitem(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
    builder.store(args[2], builder.gep(args[0], [args[1]]))
    return context.get_dummy_value()


@intrinsic
def ones(typingctx: Any, array: Any, interleave: Any) -> Any:
    """Return lanes of 1 in the real type of ``array``: ``interleave`` registers taken as one.

    Several registers hide the latency of long chains of dependent operations.
    """
    if not isinstance(interleave, types.IntegerLiteral):
        return None
    real = getattr(array.dtype, "underlying_float", array.dtype)
    lanes = Lanes(real, interleave.literal_value * REGISTER_BYTES // (real.bitwidth // 8))

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        return ir.Constant(context.get_value_type(lanes), [1.0] * lanes.count)

    return lanes(array, interleave), codegen


@intrinsic
def width(typingctx: Any, like: Any) -> Any:
    """Return how many pixels there are in lanes of the type of ``like``."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        return context.get_constant(types.intp, like.count)

    return types.intp(like), codegen


@intrinsic
def spread(typingctx: Any, like: Any, value: Any) -> Any:
    """Return a number in every lane."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        return args[1]

    return like(like, like), codegen


def _pointer(
    context: Any, builder: ir.IRBuilder, array_type: Any, array: Any, index: Any, vector: Any
) -> Any:
    """Address of element ``index`` of the contiguous array ``array``, as vectors."""
    struct = cgutils.create_struct_proxy(array_type)(context, builder, array)
    return builder.bitcast(builder.gep(struct.data, [index]), vector.as_pointer())


@intrinsic
def load(typingctx: Any, like: Any, array: Any, index: Any) -> Any:
    """Return the pixels from ``index`` on, converted to the type of ``like``."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        stored = context.get_value_type(array.dtype)
        vector = ir.VectorType(stored, like.count)
        pointer = _pointer(context, builder, array, args[1], args[2], vector)
        value = builder.load(pointer, align=array.dtype.bitwidth // 8)
        if isinstance(stored, ir.IntType):
            return builder.uitofp(value, context.get_value_type(like))
        return value

    return like(like, array, types.intp), codegen


@intrinsic
def store(typingctx: Any, array: Any, index: Any, value: Any) -> Any:
    """Write the pixels from ``index`` on; into an array of integers, truncated."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        stored = context.get_value_type(array.dtype)
        vector = ir.VectorType(stored, value.count)
        pointer = _pointer(context, builder, array, args[0], args[1], vector)
        lanes = args[2]
        if isinstance(stored, ir.IntType):
            lanes = builder.fptoui(lanes, vector)
        builder.store(lanes, pointer, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, value), codegen


@intrinsic
def pack(typingctx: Any, array: Any, index: Any, mask: Any, value: Any) -> Any:
    """Write the pixels of a mask, without gaps, from ``index`` on; return how many there are.

    What lies behind them, as far as all pixels would have reached, may be overwritten.
    """

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        element = context.get_value_type(value.element)
        pointer = _pointer(context, builder, array, args[0], args[1], args[3].type)
        pointer = builder.bitcast(pointer, element.as_pointer())
        # a register at a time: some processors take a hundred cycles to write gapless to memory
        whole = "+avx512f" in context.codegen().magic_tuple()[2]  # users can turn it off
        size = 512 // value.element.bitwidth if whole else value.count
        written = ir.IntType(64)(0)
        for first in range(0, value.count, size):
            order = list(range(first, first + size))
            part = _shuffle(builder, args[3], args[3], order)
            chosen = _shuffle(builder, args[2], args[2], order)
            target = builder.gep(pointer, [written])
            emit = _pack_register if whole else _pack_in_memory
            emit(builder, part, chosen, target)
            bits = builder.ctpop(builder.bitcast(chosen, ir.IntType(size)))
            written = builder.add(written, builder.zext(bits, ir.IntType(64)))
        return written

    return types.int64(array, types.intp, mask, value), codegen


def _pack_register(builder: ir.IRBuilder, part: Any, chosen: Any, target: Any) -> None:
    name = f"llvm.x86.avx512.mask.compress.{_suffix(part.type)}"
    kind = ir.FunctionType(part.type, [part.type, part.type, chosen.type])
    callee = cgutils.get_or_insert_function(builder.module, kind, name)
    packed = builder.call(callee, [part, ir.Constant(part.type, None), chosen])
    where = builder.bitcast(target, part.type.as_pointer())
    builder.store(packed, where, align=64 // part.type.count)


def _pack_in_memory(builder: ir.IRBuilder, part: Any, chosen: Any, target: Any) -> None:
    name = f"llvm.masked.compressstore.{_suffix(part.type)}"
    kind = ir.FunctionType(ir.VoidType(), [part.type, target.type, chosen.type])
    builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [part, target, chosen])


def _suffix(vector: Any) -> str:
    return f"v{vector.count}f{32 if isinstance(vector.element, ir.FloatType) else 64}"


@intrinsic
def unpack(typingctx: Any, array: Any, index: Any, mask: Any, value: Any) -> Any:
    """Return lanes whose pixels of a mask are those that `pack` wrote; the others are as before."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        vector = args[3].type
        pointer = _pointer(context, builder, array, args[0], args[1], vector)
        pointer = builder.bitcast(pointer, vector.element.as_pointer())
        kind = ir.FunctionType(vector, [pointer.type, args[2].type, vector])
        name = f"llvm.masked.expandload.{_suffix(vector)}"
        callee = cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(callee, [pointer, args[2], args[3]])

    return value(array, types.intp, mask, value), codegen


@intrinsic
def stream(typingctx: Any, array: Any, index: Any, value: Any) -> Any:
    """Write pixels past the caches, for results larger than these; aligned to a register."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        vector = context.get_value_type(value)
        pointer = _pointer(context, builder, array, args[0], args[1], vector)
        instruction = builder.store(args[2], pointer, align=REGISTER_BYTES)
        instruction.set_metadata("nontemporal", builder.module.add_metadata([_INDEX(1)]))
        return context.get_dummy_value()

    return types.void(array, types.intp, value), codegen


@intrinsic
def load_within(typingctx: Any, bank: Any, index: Any) -> Any:
    """Return the lanes from element ``index`` of a bank of registers on."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        vector = context.get_value_type(bank.item)
        elements = builder.bitcast(args[0], vector.element.as_pointer())
        pointer = builder.bitcast(builder.gep(elements, [args[1]]), vector.as_pointer())
        return builder.load(pointer, align=bank.item.element.bitwidth // 8)

    return bank.item(bank, types.intp), codegen


@intrinsic
def store_within(typingctx: Any, bank: Any, index: Any, value: Any) -> Any:
    """Write lanes from element ``index`` of a bank of registers on."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        vector = context.get_value_type(bank.item)
        elements = builder.bitcast(args[0], vector.element.as_pointer())
        pointer = builder.bitcast(builder.gep(elements, [args[1]]), vector.as_pointer())
        builder.store(args[2], pointer, align=bank.item.element.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(bank, types.intp, bank.item), codegen


@intrinsic
def before_boundary(typingctx: Any, array: Any, index: Any) -> Any:
    """Return how many elements from ``index`` on lie before the next line of memory."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        size = array.dtype.bitwidth // 8
        struct = cgutils.create_struct_proxy(array)(context, builder, args[0])
        word = ir.IntType(64)
        address = builder.ptrtoint(builder.gep(struct.data, [args[1]]), word)
        short = builder.and_(builder.neg(address), word(LINE_BYTES - 1))
        return builder.udiv(short, word(size))

    return types.intp(array, types.intp), codegen


@intrinsic
def fence(typingctx: Any) -> Any:
    """Wait until what was written past the caches is seen by other threads."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), codegen


def _shuffle(builder: ir.IRBuilder, x: Any, y: Any, order: list[int]) -> Any:
    return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(_INDEX, len(order)), order))


@intrinsic
def load_complex(typingctx: Any, like: Any, array: Any, index: Any) -> Any:
    """Return real and imaginary lanes of the complex pixels from ``index`` on."""
    pair = types.UniTuple(like, 2)

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        vector = context.get_value_type(like)
        pointer = _pointer(context, builder, array, args[1], args[2], vector)
        align = like.element.bitwidth // 8
        low = builder.load(pointer, align=align)
        high = builder.load(builder.gep(pointer, [_INDEX(1)]), align=align)
        re = _shuffle(builder, low, high, list(range(0, 2 * like.count, 2)))
        im = _shuffle(builder, low, high, list(range(1, 2 * like.count, 2)))
        return context.make_tuple(builder, pair, (re, im))

    return pair(like, array, types.intp), codegen


@intrinsic
def store_complex(typingctx: Any, array: Any, index: Any, re: Any, im: Any) -> Any:
    """Write complex pixels from ``index`` on."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        count = re.count
        zipped = [part for lane in range(count) for part in (lane, count + lane)]
        pointer = _pointer(context, builder, array, args[0], args[1], args[2].type)
        align = re.element.bitwidth // 8
        builder.store(_shuffle(builder, args[2], args[3], zipped[:count]), pointer, align=align)
        high = builder.gep(pointer, [_INDEX(1)])
        builder.store(_shuffle(builder, args[2], args[3], zipped[count:]), high, align=align)
        return context.get_dummy_value()

    return types.void(array, types.intp, re, re), codegen


@intrinsic
def count(typingctx: Any, mask: Any) -> Any:
    """Return for how many pixels the mask is true."""

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Operands) -> Any:
        packed = builder.bitcast(args[0], ir.IntType(mask.count))
        return builder.zext(builder.ctpop(packed), ir.IntType(64))

    return types.int64(mask), codegen

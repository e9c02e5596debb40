"""The vectors of pixels that kernels are written with: each property that the kernels lean on."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.portable import (
    arctangent_ratio,
    bank,
    larger,
    lost_by_squaring,
    magnitude,
    smaller,
)

TYPES = [np.float32, np.float64]
Array = NDArray[Any]


def run(kernel: Callable[..., Any], *arrays: Array) -> Any:
    """Compile a kernel over arrays of one register, and call it."""
    return njit(kernel, error_model="numpy")(*arrays)


def register(dtype: type, values: list[float]) -> Array:
    """One register full of values, again and again."""
    width = simd.REGISTER_BYTES // np.dtype(dtype).itemsize
    return np.resize(np.array(values, dtype), width)


@pytest.mark.parametrize("dtype", TYPES)
def test_arithmetic_is_that_of_numpy(dtype: type) -> None:
    x = register(dtype, [1.5, -2.0, 0.0, np.inf, np.nan, 3e30])
    y = register(dtype, [0.25, 3.0, 0.0, 1.0, 2.0, -1e-30])
    out: Array = np.empty((6, x.size), dtype)

    def kernel(x: Any, y: Any, out: Any) -> None:
        one = simd.ones(x, 1)
        a, b = simd.load(one, x, 0), simd.load(one, y, 0)
        simd.store(out[0], 0, a + b)
        simd.store(out[1], 0, a - b)
        simd.store(out[2], 0, a * b)
        simd.store(out[3], 0, a / b)
        simd.store(out[4], 0, -a)
        simd.store(out[5], 0, 2 + magnitude(a) * 0.5)

    run(kernel, x, y, out)

    with np.errstate(all="ignore"):
        expected = [x + y, x - y, x * y, x / y, -x, 2 + abs(x) * dtype(0.5)]
    assert np.array_equal(out, expected, equal_nan=True)


@pytest.mark.parametrize("dtype", TYPES)
def test_no_comparison_holds_for_nan(dtype: type) -> None:
    x = register(dtype, [np.nan, 1.0])
    counts = np.zeros(6, np.int64)

    def kernel(x: Any, counts: Any) -> None:
        one = simd.ones(x, 1)
        a = simd.load(one, x, 0)
        counts[0], counts[1] = simd.count(a < one), simd.count(a <= one)
        counts[2], counts[3] = simd.count(a > one), simd.count(a >= one)
        counts[4], counts[5] = simd.count(a == one), simd.count(~(a <= one) | (a < one))

    run(kernel, x, counts)

    half = x.size // 2
    assert counts.tolist() == [0, half, 0, half, half, half]


@pytest.mark.parametrize("dtype", TYPES)
def test_minimum_and_maximum_return_the_second_of_a_nan_and_a_number(dtype: type) -> None:
    x, y = register(dtype, [np.nan, 1.0, 2.0]), register(dtype, [1.0, np.nan, 3.0])
    out: Array = np.empty((2, x.size), dtype)

    def kernel(x: Any, y: Any, out: Any) -> None:
        one = simd.ones(x, 1)
        a, b = simd.load(one, x, 0), simd.load(one, y, 0)
        simd.store(out[0], 0, smaller(a, b))
        simd.store(out[1], 0, larger(a, b))

    run(kernel, x, y, out)

    assert np.array_equal(out[0, :3], [1.0, np.nan, 2.0], equal_nan=True)
    assert np.array_equal(out[1, :3], [1.0, np.nan, 3.0], equal_nan=True)


@pytest.mark.parametrize("interleave", [1, 2, 4])
def test_several_registers_are_taken_as_one(interleave: int) -> None:
    x = np.arange(64, dtype=np.float32)
    out = np.zeros(65, np.float32)

    def incremented(x: Any, out: Any) -> int:
        one = simd.ones(x, interleave)
        simd.store(out, 1, simd.load(one, x, 0) + one)
        return simd.width(one)  # type: ignore[no-any-return]  # numba is untyped

    width = run(incremented, x, out)

    assert width == interleave * simd.REGISTER_BYTES // 4
    assert np.array_equal(out[1 : width + 1], x[:width] + 1)
    assert (out[width + 1 :] == 0).all()
    assert out[0] == 0


@pytest.mark.parametrize("dtype", TYPES)
def test_complex_pixels_are_taken_apart_and_put_together(dtype: type) -> None:
    z = (register(dtype, list(range(16))) - 1j * register(dtype, [0.5, 7.0, -2.0])).astype(
        np.result_type(dtype, np.complex64)
    )
    out = np.zeros_like(z)

    def kernel(z: Any, out: Any) -> None:
        one = simd.ones(z, 1)
        re, im = simd.load_complex(one, z, 0)
        simd.store_complex(out, 0, re + one, -im)

    run(kernel, z, out)

    assert np.array_equal(out, z.conj() + 1)


def test_integers_become_numbers_and_numbers_bytes() -> None:
    x = register(np.float32, [0.0])
    raw = np.arange(x.size, dtype=np.uint16) * 4000
    small = np.zeros(x.size, np.uint8)

    def kernel(x: Any, raw: Any, small: Any) -> None:
        one = simd.ones(x, 1)
        values = simd.load(one, raw, 0)
        simd.store(x, 0, values)
        simd.store(small, 0, values * (1 / 4000.0))

    run(kernel, x, raw, small)

    assert np.array_equal(x, raw)
    assert np.abs(small.astype(int) - np.arange(x.size)).max() <= 1


@pytest.mark.parametrize("dtype", TYPES)
def test_what_rounding_takes_from_a_square_is_known(dtype: type) -> None:
    x = register(dtype, [1 + float(np.finfo(dtype).eps)])
    out = np.empty_like(x)

    def kernel(x: Any, out: Any) -> None:
        one = simd.ones(x, 1)
        a = simd.load(one, x, 0)
        simd.store(out, 0, lost_by_squaring(a, a * a))

    run(kernel, x, out)

    assert (out == np.finfo(dtype).eps ** 2).all()


@pytest.mark.parametrize("dtype", TYPES)
def test_the_power_series_of_the_arctangent_is_exact_to_rounding(dtype: type) -> None:
    t: Array = np.linspace(1e-3, np.tan(np.pi / 8), 64).astype(dtype)
    out = np.empty_like(t)

    def kernel(t: Any, out: Any) -> None:
        one = simd.ones(t, 1)
        for p in range(0, t.size, simd.width(one)):
            a = simd.load(one, t, p)
            simd.store(out, p, arctangent_ratio(a * a))

    run(kernel, t, out)

    exact = np.arctan(t.astype(np.longdouble)) / t.astype(np.longdouble)
    assert np.abs(out / exact - 1).max() < 3 * np.finfo(dtype).eps


@pytest.mark.parametrize("interleave", [1, 2])
@pytest.mark.parametrize("dtype", TYPES)
def test_pixels_of_a_mask_are_packed_and_come_back_in_their_places(
    dtype: type, interleave: int
) -> None:
    size = interleave * simd.REGISTER_BYTES // np.dtype(dtype).itemsize
    random = np.random.default_rng(interleave)
    x: Array = random.permutation(4 * size).astype(dtype)
    limit = 2 * size
    packed: Array = np.full(5 * size, -1, dtype)
    back = np.zeros_like(x)

    def through(x: Any, packed: Any, back: Any, limit: float) -> int:
        one = simd.ones(x, interleave)
        count = 0
        for p in range(0, x.size, simd.width(one)):
            value = simd.load(one, x, p)
            count += simd.pack(packed, count, value < limit, value)
        done = 0
        for p in range(0, x.size, simd.width(one)):
            there = simd.load(one, x, p) < limit
            simd.store(back, p, simd.unpack(packed, done, there, -one))
            done += simd.count(there)
        return count

    count = njit(through)(x, packed, back, limit)

    assert count == limit
    assert np.array_equal(packed[:count], x[x < limit])
    assert np.array_equal(back, np.where(x < limit, x, -1))


def test_registers_are_an_array_and_may_be_read_between() -> None:
    x = np.arange(64, dtype=np.float32)
    out = np.zeros(x.size, np.float32)

    def kernel(x: Any, out: Any) -> None:
        one = simd.ones(x, 1)
        width = simd.width(one)
        room = bank(one, (0, 0), 1)
        for i in range(3):
            room[i] = simd.load(one, x, i * width)
        simd.store(out, 0, simd.load_within(room, 5))
        simd.store_within(room, 3, one * 9.0)
        simd.store(out, width, room[0])

    run(kernel, x, out)

    width = simd.REGISTER_BYTES // 4
    assert np.array_equal(out[:width], x[5 : width + 5])
    assert np.array_equal(out[width : 2 * width][:4], [0, 1, 2, 9])


def test_boundaries_of_memory_are_found() -> None:
    room = np.zeros(256, np.float32)
    begin = (-room.ctypes.data % 64) // 4

    def kernel(x: Any, index: int) -> int:
        return simd.before_boundary(x, index)  # type: ignore[no-any-return]  # numba is untyped

    found = njit(kernel)

    width = simd.LINE_BYTES // 4
    assert [found(room[begin:], i) for i in (0, 1, width - 1, width)] == [0, width - 1, 1, 0]

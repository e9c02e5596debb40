"""Blocks, flat planes and loops over them."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from tests.moments import oracles
from transientcam_moments.arrays import by_blocks, in_turn, multiply_rows, repeat
from transientcam_moments.moment_problem._toeplitz import below_one


@pytest.mark.parametrize("pixels", [0, 1, 7, 8, 9, 100])
def test_blocks_put_together_are_the_whole(pixels: int) -> None:
    a, b = np.arange(3 * pixels).reshape(3, pixels), np.arange(pixels)

    total, shifted = by_blocks(lambda x, y: (x.sum(axis=0) + y, x + y), a, b, pixels=8)

    assert np.array_equal(total, a.sum(axis=0) + b)
    assert np.array_equal(shifted, a + b)


def test_rows_of_planes_are_multiplied_with_a_matrix_of_numbers() -> None:
    rng = np.random.default_rng(1)
    rows, table = rng.normal(size=(3, 3, 5)), rng.normal(size=(3, 4))
    out: list[Any] = [None] * 9

    multiply_rows(list(rows.reshape(9, 5)), (0, 0), table, out)

    for pixel in range(5):
        expected = rows[..., pixel] @ table[:, :3]
        found = [plane[pixel] for plane in out]
        assert np.allclose(np.reshape(found, (3, 3)), expected, rtol=1e-12)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_one_minus_a_square_keeps_its_digits_near_the_circle(dtype: type) -> None:
    rng = np.random.default_rng(0)
    eps = np.finfo(dtype).eps
    distance = 10 ** rng.uniform(np.log10(100 * eps), 0, 2000)
    g = ((1 - distance) * np.exp(1j * rng.uniform(0, 7, 2000))).astype(dtype)
    # exact rational arithmetic on the floats themselves
    exact = np.array(
        [
            float(1 - Fraction(z.real) ** 2 - Fraction(z.imag) ** 2)
            for z in g.astype(complex).tolist()
        ]
    )

    x: Any = g.real
    y: Any = g.imag
    found: Any = below_one(x, y)
    assert np.abs(found / exact - 1).max() < 40 * eps


def test_angles_are_brought_into_a_turn_also_after_rounding() -> None:
    for dtype in (np.float32, np.float64):
        angles = np.array([-np.pi, -1e-30, 0.0, 3.0, np.pi], dtype)

        turned = in_turn(angles)

        assert turned.dtype == dtype
        assert np.all((turned >= 0) & (turned < dtype(2 * np.pi)))
        assert oracles.around(turned - angles).max() < 1e-6


State = tuple[Any, ...]


def doubled(first: bool, fixed: State, given: State, state: State) -> State:
    """Double what moves, as often as each pixel is given."""
    moving, (value, done) = state
    fixed[0].append(value.size)
    value = np.where(moving, 2.0 * value + first, value)
    done = done + moving
    return moving & (done < given[0]), [value, done]


def run(times: np.ndarray, steps: int) -> tuple[np.ndarray, list[int]]:
    sizes: list[int] = []
    start = np.ones(times.size)
    state = repeat(doubled, steps, (sizes,), (times,), (start > 0, [start, 0 * start]))
    return state[1][0], sizes


def test_finished_pixels_leave_the_loop_and_keep_their_result() -> None:
    value, sizes = run(np.array([1, 1, 1, 1, 1, 1, 1, 5, 9, 200]), 21)

    assert sizes[0] == 10
    assert sizes[-1] == 1
    assert len(sizes) == 21
    assert value.tolist() == [3.0] * 7 + [3.0 * 2**4, 3.0 * 2**8, 3.0 * 2**20]


def test_a_loop_ends_when_no_pixel_moves() -> None:
    assert len(run(np.array([1, 2, 4]), 50)[1]) == 4


def test_a_result_does_not_depend_on_the_other_pixels() -> None:
    times = np.array([3, 11, 40, 2, 0])

    together, _ = run(times, 50)

    assert together.tolist() == [run(times[k : k + 1], 50)[0][0] for k in range(5)]

"""Blocks, flat planes and loops over them."""

from fractions import Fraction

import numpy as np
import pytest

from tests.moments import oracles
from transientcam_moments.arrays import below_one, by_blocks, in_turn, repeat


@pytest.mark.parametrize("pixels", [0, 1, 7, 8, 9, 100])
def test_blocks_put_together_are_the_whole(pixels: int) -> None:
    a, b = np.arange(3 * pixels).reshape(3, pixels), np.arange(pixels)

    total, shifted = by_blocks(lambda x, y: (x.sum(axis=0) + y, x + y), a, b, pixels=8)

    assert np.array_equal(total, a.sum(axis=0) + b)
    assert np.array_equal(shifted, a + b)


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

    assert np.abs(below_one(g) / exact - 1).max() < 40 * eps


def test_angles_are_brought_into_a_turn_also_after_rounding() -> None:
    for dtype in (np.float32, np.float64):
        angles = np.array([-np.pi, -1e-30, 0.0, 3.0, np.pi], dtype)

        turned = in_turn(angles)

        assert turned.dtype == dtype
        assert np.all((turned >= 0) & (turned < dtype(2 * np.pi)))
        assert oracles.around(turned - angles).max() < 1e-6


def test_finished_pixels_leave_the_loop_and_keep_their_result() -> None:
    sizes = []

    def body(state: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
        left, value = state
        sizes.append(left.size)
        return left - 1, value * 2

    left = np.array([1, 1, 1, 1, 1, 1, 1, 5, 9, 200])
    state = repeat(body, (left, np.ones(10)), times=21, done=lambda state: state[0] <= 0)

    assert sizes[0] == 10
    assert sizes[-1] == 1
    # let go at the next release, whatever the others need
    assert state[1].tolist() == [2.0**4] * 7 + [2.0**5, 2.0**10, 2.0**21]


def test_a_result_does_not_depend_on_the_other_pixels() -> None:
    def run(left: np.ndarray) -> np.ndarray:
        def body(state: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
            return state[0] - 1, state[1] * 1.5

        start = (left, np.ones(left.size))
        value: np.ndarray = repeat(body, start, times=50, done=lambda state: state[0] <= 0)[1]
        return value

    left = np.array([3, 11, 40, 2, 0])

    together = run(left)

    assert together.tolist() == [run(left[k : k + 1])[0] for k in range(5)]

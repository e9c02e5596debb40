"""Flags of pixels."""

import re

import numpy as np
import pytest

import transientcam_moments as tm
from tests.client.conftest import SPECIFICATION


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_every_pixel_is_judged_by_itself(dtype: type) -> None:
    pixels = {
        tm.Flags.VALID: [1.0, 0.5, 0.25],
        tm.Flags.NO_SIGNAL: [0.0, 0.0, 0.0],
        tm.Flags.NON_FINITE: [1.0, np.nan, 0.0],
        tm.Flags.DEGENERATE: [1.0, 1.0, 1.0],
    }

    found = tm.flags(np.array(list(pixels.values()), dtype).T)

    assert found.dtype == np.uint8
    assert found.tolist() == [int(flag) for flag in pixels]


def test_every_flag_is_the_bit_that_the_specification_of_the_stream_gives_it() -> None:
    table = SPECIFICATION.read_text("utf-8").partition("| bit |")[2].partition("| code |")[0]

    found = dict(re.findall(r"^\| (\d+) \| `(\w+)` \|", table, re.MULTILINE))

    assert {int(bit): name.upper() for bit, name in found.items()} == {
        int(each): each.name for each in tm.Flags if each
    }


def test_contradicting_moments_are_degenerate_and_negative_light_is_none() -> None:
    b = np.array([[1, -1, 1e-3], [2, 0.5, 1]], complex)

    assert tm.flags(b).tolist() == [tm.Flags.DEGENERATE, tm.Flags.NO_SIGNAL, tm.Flags.DEGENERATE]


@pytest.mark.parametrize("bad", [np.inf, -np.inf, complex(0, np.nan), complex(1, np.inf)])
def test_any_moment_that_is_no_number_is_flagged(bad: complex) -> None:
    for plane in range(3):
        b = np.ones((3, 2), complex) * [[1], [0.2], [0.1]]
        b[plane, 1] = bad

        assert tm.flags(b).tolist() == [0, tm.Flags.NON_FINITE]


def test_the_least_brightness_can_be_chosen() -> None:
    b = np.array([[5.0, 6.0], [1, 1]])

    assert tm.flags(b, minimum_brightness=5.0).tolist() == [tm.Flags.NO_SIGNAL, 0]


def test_flags_have_the_shape_of_the_pixels() -> None:
    assert tm.flags(np.ones((2, 3, 4)) * 0.5).shape == (3, 4)
    assert tm.flags(np.array([1.0, 0.5])).shape == ()


def test_a_known_eigenvalue_is_used() -> None:
    b = np.array([[1.0], [0.5]])

    assert tm.flags(b, eigenvalue=np.array([-1.0])).tolist() == [tm.Flags.DEGENERATE]

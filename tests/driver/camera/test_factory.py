"""The lens that a camera reports: rays of its pixels."""

import numpy as np
import pytest

from transientcam_driver import Lens

BENT = (0.09, -0.27, 0.004, -0.003, 0.095)


def test_rays_are_seen_where_the_distortion_says() -> None:
    lens = Lens(365.0, 370.0, 256.6, 204.7, BENT)

    x, y = lens.slopes(512, 424)

    k1, k2, p1, p2, k3 = BENT
    square = x**2 + y**2
    radial = 1 + k1 * square + k2 * square**2 + k3 * square**3
    xd = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x**2)
    yd = y * radial + p1 * (square + 2 * y**2) + 2 * p2 * x * y
    columns, rows = np.meshgrid(np.arange(512), np.arange(424))
    np.testing.assert_allclose(365.0 * xd + 256.6, columns, atol=1e-8)
    np.testing.assert_allclose(370.0 * yd + 204.7, rows, atol=1e-8)
    # of several rays that a polynomial bends to one place, the one that goes on from the centre
    assert (np.diff(x, axis=1) > 0).all()
    assert (np.diff(y, axis=0) > 0).all()


def test_a_pinhole_bends_nothing() -> None:
    x, y = Lens(200.0, 100.0, 1.0, 2.0).slopes(4, 3)

    assert x[1].tolist() == [-0.005, 0.0, 0.005, 0.01]
    assert y[:, 3].tolist() == [-0.02, -0.01, 0.0]


def test_where_the_image_folds_back_there_is_no_ray() -> None:
    # x (1 - x^2) is 2 / 3^(3/2) = 0.385 at most
    x, y = Lens(100.0, 100.0, 50.0, 0.0, (-1.0, 0.0, 0.0, 0.0, 0.0)).slopes(101, 1)

    known = np.isfinite(x[0])
    assert known[12:89].all()
    assert not known[:11].any()
    assert not known[90:].any()
    assert (np.isfinite(y[0]) == known).all()


@pytest.mark.parametrize(
    "lens", [(0.0, 1.0, 1.0, 1.0), (1.0, 1.0, np.nan, 1.0), (1.0, 1.0, 1.0, 1.0, (0.1,))]
)
def test_what_is_no_lens_is_refused(lens: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"lens|coefficients"):
        Lens(*lens)  # type: ignore[arg-type]

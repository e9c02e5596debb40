"""Closed forms of synthetic responses, against quadrature of one another."""

import numpy as np
import pytest

from transientcam_experiments.paper.synthetic import CONTINUOUS, PIXEL, SPARSE, Response

F_HZ = 23e6


@pytest.mark.parametrize("response", [CONTINUOUS, PIXEL], ids=lambda each: each.name)
@pytest.mark.parametrize("j", [0, 1, 5])
def test_moments_are_the_density_times_waves(response: Response, j: int) -> None:
    time_s = np.linspace(0, 150e-9, 300_001)
    wave = np.exp(2j * np.pi * j * F_HZ * time_s)

    found = np.trapezoid(response.density(time_s) * wave, time_s)

    expected = response.moment(j * F_HZ)
    assert complex(found) == pytest.approx(complex(expected), abs=1e-6 * response.brightness)


@pytest.mark.parametrize("response", [CONTINUOUS, PIXEL], ids=lambda each: each.name)
def test_the_cumulative_density_is_the_integral_of_the_density(response: Response) -> None:
    edges_s = np.linspace(0, 60e-9, 60_001)
    middles_s = (edges_s[1:] + edges_s[:-1]) / 2

    integral = np.append(0, np.cumsum(response.density(middles_s)) * (edges_s[1] - edges_s[0]))

    assert response.cumulative(edges_s) == pytest.approx(integral, abs=1e-4 * response.brightness)


def test_sharp_returns_have_phasors_and_steps() -> None:
    assert SPARSE.brightness == pytest.approx(1.6)
    expected = np.exp(2j * np.pi * F_HZ * 7e-9) + 0.6 * np.exp(2j * np.pi * F_HZ * 14e-9)
    assert complex(SPARSE.moment(F_HZ)) == pytest.approx(complex(expected))
    assert list(SPARSE.cumulative(np.array([6.9e-9, 7.1e-9, 15e-9]))) == pytest.approx([0, 1, 1.6])


@pytest.mark.parametrize("response", [SPARSE, CONTINUOUS], ids=lambda each: each.name)
def test_all_light_is_back_within_a_period(response: Response) -> None:
    share = response.cumulative(np.array([0.0, 1 / F_HZ])) / response.brightness

    assert share == pytest.approx([0, 1], abs=1e-4)


def test_the_pixel_of_figure_5_is_as_bright_as_the_papers() -> None:
    assert pytest.approx(67.5) == PIXEL.brightness

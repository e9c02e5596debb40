"""How often two returns are found apart: against captures drawn one by one."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.server.planning.looks import SETTINGS
from transientcam_driver import Sequence
from transientcam_server.planning import uniform_scene
from transientcam_server.planning._prediction.resolving import LEVELS, Resolving
from transientcam_server.planning._scene.scene import FEW_PIXELS

C_M_S = 299_792_458.0
DISTANCE_M = 0.7


def found_apart(base_frequency_hz: float, noise: float, draws: int = 2000) -> float:
    """Return how often Pisarenko has a return at each place, with noise of Re and Im b_j each."""
    random = np.random.default_rng(3)
    away_rad = 2 * np.pi * 2 * base_frequency_hz * np.array([2.0, 2.0 + DISTANCE_M]) / C_M_S
    b = np.exp(1j * np.arange(4)[:, None] * away_rad).mean(axis=1)
    drawn = random.normal(size=(2, 4, draws)) * noise
    drawn[:, 0] = 0
    found = tm.pisarenko(b[:, None] + drawn[0] + 1j * drawn[1])
    near = np.abs(found.phase_rad[:, None] - away_rad[:, None]) < np.ptp(away_rad) / 4
    return float((near & (found.weight[:, None] > 0.1)).any(axis=0).all(axis=0).mean())


@pytest.mark.parametrize("base_frequency_hz", [15e6, 23e6])
@pytest.mark.parametrize("noise", LEVELS[[4, 7, 8, 10]])
def test_two_returns_are_found_as_often_as_in_captures(
    base_frequency_hz: float, noise: float
) -> None:
    scene = uniform_scene(1e6, [(2.0 + DISTANCE_M / 2, 1.0)])
    resolving = Resolving(scene, SETTINGS, seed=1, go_on=lambda: None)
    sequence = Sequence(harmonics=3, base_frequency_hz=base_frequency_hz)

    share = resolving.separation(sequence, np.full(FEW_PIXELS, noise), DISTANCE_M)

    assert share == pytest.approx(found_apart(base_frequency_hz, noise), abs=0.1)


def test_one_frequency_separates_nothing() -> None:
    resolving = Resolving(uniform_scene(1e6, [(2.0, 1.0)]), SETTINGS, seed=1, go_on=lambda: None)

    assert resolving.separation(Sequence(harmonics=1), np.full(FEW_PIXELS, 1e-4), 1.0) == 0.0

"""The learned estimator of the examples, on responses that it has not seen."""

import sys
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.conftest import ROOT
from transientcam_moments.noise import MomentNoise


@pytest.fixture(scope="module")
def learned() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "examples" / "learned_range"))
        yield import_module("learned_range")
        del sys.modules["learned_range"]


def responses(tail: bool, seed: int = 5) -> tuple[Any, Any, Any]:
    """Moments (5, P) of a return and a later one, or a tail; their noise, and the first phase."""
    rng, j = np.random.default_rng(seed), np.arange(5)[:, None]
    first = rng.uniform(0, 2 * np.pi, 2000)
    later = first + rng.uniform(0.3, 2.0, 2000)
    share = rng.uniform(0.2, 0.8, 2000)
    b = np.exp(1j * j * first)
    b += share * np.exp(1j * j * later) / (1 - 1j * j * 0.5 if tail else 1)
    std = 0.01 * (1 + share)
    b[1:] += std * (rng.normal(size=(4, 2000)) + 1j * rng.normal(size=(4, 2000)))
    return b, MomentNoise(np.broadcast_to(std**2, b.shape)), first


def off_rad(found: Any, first: Any) -> Any:
    return np.remainder(found - first + np.pi, 2 * np.pi) - np.pi


@pytest.mark.parametrize("tail", [False, True])
def test_it_errs_less_than_one_phase_and_as_it_states(learned: ModuleType, tail: bool) -> None:
    b, noise, first = responses(tail)

    phase, std, _ = learned.answers(b, noise)

    off = np.abs(off_rad(phase, first))
    assert np.median(off) < 0.5 * np.median(np.abs(off_rad(np.angle(b[1]), first)))
    assert 0.55 < np.mean(off < std) < 0.85


def test_a_delay_of_all_light_delays_its_answer_and_nothing_else(learned: ModuleType) -> None:
    b, noise, _ = responses(tail=False)
    delayed = b * np.exp(1j * 1.3 * np.arange(5))[:, None]

    (phase, std, light), after = learned.answers(b, noise), learned.answers(delayed, noise)

    assert np.abs(off_rad(after[0] - 1.3, phase)).max() < 1e-4
    assert after[1] == pytest.approx(std, rel=1e-3)
    assert after[2] == pytest.approx(light, rel=1e-3)


def test_pixels_without_light_have_no_range(learned: ModuleType) -> None:
    found = learned.ESTIMATOR.of(np.zeros((5, 2, 3), complex))

    assert np.isnan(found.phase_rad).all()
    assert (found.uniform == 0).all()

"""Statements about one response, held against others of its kind."""

import numpy as np
import pytest

from transientcam_experiments.paper import random_responses
from transientcam_experiments.paper.outcome import Outcome
from transientcam_experiments.paper.random_responses import CLAIMS
from transientcam_experiments.paper.synthetic import CONTINUOUS, Response, Return


def test_random_responses_are_three_returns_well_apart_within_a_period() -> None:
    for seed in range(50):
        response = random_responses.drawn(np.random.default_rng(seed))

        delays = np.array([each.delay_s for each in response.returns])
        assert delays.size == 3
        assert np.diff(delays).min() >= 5e-9
        assert all(each.width_s > 0 and each.decay_s > 0 for each in response.returns)
        share = response.cumulative(np.array([0.0, 1 / 23e6])) / response.brightness
        assert share == pytest.approx([0, 1], abs=1e-3)


def test_in_a_valley_a_return_is_back_and_the_next_is_not() -> None:
    response = Response(
        "sharp enough", tuple(Return(at, 1.0, 0.1e-9, 0.2e-9) for at in (5e-9, 12e-9, 20e-9))
    )

    back = response.cumulative(np.array(random_responses.valleys_s(response)))

    assert back == pytest.approx([1, 2, 3], abs=1e-3)


def test_a_statement_that_fails_says_how_often_it_holds_elsewhere() -> None:
    time_s = (np.arange(400) + 0.5) * 0.1e-9

    def found(weight: float) -> dict[str, Outcome]:
        truth = CONTINUOUS.cumulative(time_s) / CONTINUOUS.brightness
        each = Outcome(time_s, truth, weight * truth, np.stack([truth, weight * truth], axis=1))
        return dict.fromkeys(("godbaz", "spumic", "sra", "pisarenko", "maximum-entropy"), each)

    dimmer, right = found(0.5), found(1.001)
    others = [(CONTINUOUS, right), (CONTINUOUS, right), (CONTINUOUS, right), (CONTINUOUS, dimmer)]

    stated = random_responses.statements(CONTINUOUS, right, right, others)

    assert len(stated) == len(CLAIMS)
    assert all(each.criterion and " and " not in each.criterion for each in stated)
    (bias,) = (each for each in stated if "less overall brightness" in each.says)
    assert not bias.passes
    assert bias.value == pytest.approx(1.0, abs=0.01)
    assert bias.reason.endswith("it holds in 25%")
    shares, errors = random_responses.tables(others, right)
    assert ("SRA has a bias towards less overall brightness.", 25.0) in shares.rows
    assert len(errors.rows) == 5

"""Codings of a range and of a density: what comes back."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.experiments.tradeoff.moments import moments
from transientcam_experiments.tradeoff import transport


@pytest.mark.parametrize("coding", list(transport.codings(3)), ids=lambda each: str(each.point))
def test_every_coding_comes_back_within_its_error(coding: transport.Coding) -> None:
    b = moments(3, pixels=40).reshape((4, 5, 8))
    range_m = np.random.default_rng(0).uniform(0.5, 6.0, (5, 8)).astype(np.float32)
    range_m[0, 0] = np.nan
    limits = {
        "f32": 0.0,
        "f32, deflated": 0.0,
        "f16": 0.05 if coding.point["product"] == "coefficients" else 2e-3,
        "png, 16 bits of 1 mm": 5.01e-4,
        "reflections, 16 bits": 1e-3,
        "reflections, 8 bits": 0.1,
    }

    values, _ = transport.measure(coding, b, range_m, repetitions=2)

    assert (values["error_median"] or 0) <= limits[str(coding.point["coding"])]
    assert (values["bytes"] or 0) > 0


def test_reflections_sent_are_those_of_the_recursion() -> None:
    coefficients = tm.levinson(moments(4))
    sent = transport._planes(coefficients)

    np.testing.assert_allclose(transport._reflections(sent), coefficients.reflection, atol=1e-9)

"""What techniques are given: the right light, the right noise."""

import numpy as np
import pytest

from tests.moments import oracles
from transientcam_experiments.paper.contenders import CONTENDERS, OURS, PRINTED, Contender, samples
from transientcam_experiments.paper.figure12 import ENTRIES
from transientcam_experiments.paper.synthetic import CONTINUOUS, SPARSE, Response
from transientcam_moments.comparisons import TECHNIQUES, maximum_length_code

CODED = next(each for each in CONTENDERS if each.name == "coded")


def _rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_every_technique_competes_in_both_figures() -> None:
    assert {each.name for each in CONTENDERS} == set(TECHNIQUES)
    assert {each.name for each in ENTRIES} == set(TECHNIQUES)


def test_each_has_the_frequencies_that_it_needs() -> None:
    for each in (*CONTENDERS, *ENTRIES):
        assert each.m >= each.technique.least_harmonics, each.name


def test_the_papers_frequencies_are_the_papers() -> None:
    mhz = {each.name: each.base_frequency_hz / 1e6 for each in CONTENDERS}
    multiples = {each.name: each.technique.harmonics(each.m) for each in CONTENDERS}

    found = {name: [mhz[name] * j for j in multiples[name]] for name in PRINTED}

    assert found == {
        "godbaz": [11, 22, 33, 44],
        "spumic": [11, 22, 33, 44, 55, 66],
        "sra": [23, 46, 69],
        "pisarenko": [23, 46, 69],
        "maximum-entropy": [0, 23, 46, 69],
    }
    assert set(OURS) < set(PRINTED)


def test_frequencies_are_named_in_a_few_words() -> None:
    assert Contender("sra", 23e6, 3).frequencies == "23, 46, 69"
    assert Contender("spumic", 11.5e6, 6).frequencies == "11.5, 23 .. 69"


def test_moments_are_those_of_the_returns() -> None:
    contender = Contender("pisarenko", 23e6, 3)
    turn = 2 * np.pi * 23e6
    phase = turn * np.array([[7e-9], [14e-9]])

    b = samples(contender, SPARSE, noise=0.0, draws=2, rng=_rng())

    expected = oracles.moments_of_returns(phase, np.array([[1.0], [0.6]]), 3)
    assert b == pytest.approx(np.repeat(expected, 2, axis=1))


def test_noise_is_the_same_share_of_the_brightness_in_every_real_measurement() -> None:
    contender = Contender("maximum-entropy", 23e6, 3)

    b = samples(contender, CONTINUOUS, noise=1 / 70, draws=20_000, rng=_rng())

    share = CONTINUOUS.brightness / 70
    assert b.real.std(axis=1) == pytest.approx(np.full(4, share), rel=0.03)
    assert b[1:].imag.std(axis=1) == pytest.approx(np.full(3, share), rel=0.03)
    assert not b[0].imag.any()


@pytest.mark.parametrize("response", [SPARSE, CONTINUOUS], ids=lambda each: each.name)
def test_samples_of_a_code_are_moments_times_its_harmonics(response: Response) -> None:
    y = samples(CODED, response, noise=0.0, draws=1, rng=_rng())[:, 0]

    contents = maximum_length_code().contents[:8]
    moments = response.moments(23e6, 8)[1:]
    spectrum = np.fft.fft(y)[1:9].conj() * 2 / y.size  # y = Re sum c b exp(-i k theta)
    # 62 shifts alias harmonics beyond the 31st
    assert np.abs(spectrum - contents * moments).max() < 0.05 * abs(contents[0])

"""What holds for every technique, whatever it does inside."""

import subprocess
import sys
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments import comparisons
from transientcam_moments.comparisons import Technique

ALL = tuple(comparisons.TECHNIQUES.values())
COARSE = replace(
    comparisons.TECHNIQUES["sra-table"],  # a table that is soon built does for these laws
    estimate=partial(comparisons.TECHNIQUES["sra-table"].estimate, nodes=5),
)
OF_MOMENTS = tuple(
    COARSE if each.name == COARSE.name else each for each in ALL if each.measures == "moments"
)
# this one solves all pixels together; its own tests say how they hang together
BY_THEMSELVES = tuple(each for each in OF_MOMENTS if each.name != "regularised")
M = 8

# the closest that a single return's phase comes to the truth, in radian
GRID_RAD = {"sra": 2e-2, "logarithmic": 2e-2, "matching-pursuit": 5e-3, "sra-table": 1e-3}
SMOOTH_RAD = {"frequency-domain": 3e-3, "inverse-fourier": 1e-3, "regularised": 5e-2}


def by_name(technique: Technique) -> str:
    return technique.name


def moments(pixels: int = 6, *, seed: int = 3) -> NDArray[np.complexfloating[Any, Any]]:
    """Two returns well apart, in any pixel."""
    rng = np.random.default_rng(seed)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=pixels, apart_rad=2.0)
    return oracles.moments_of_returns(phase, weight, M)


def test_a_technique_of_somebodys_is_planar_of_moments_and_told_nothing_unless_it_says_so() -> None:
    words: dict[str, Any] = dict.fromkeys(
        ("label", "returns", "frequencies", "assumptions", "cost", "failure"), ""
    )

    found = Technique(
        name="own", **words, harmonics=lambda m: (1,), least_harmonics=1, estimate=abs
    )

    assert (found.planar, found.measures, found.informed) == (True, "moments", False)


@pytest.mark.parametrize("technique", ALL, ids=by_name)
def test_every_technique_says_what_it_is(technique: Technique) -> None:
    assert comparisons.TECHNIQUES[technique.name] is technique
    words = (technique.label, technique.returns, technique.frequencies)
    assert all((*words, technique.assumptions, technique.cost, technique.failure))
    orders = technique.harmonics(technique.least_harmonics)
    assert orders == tuple(sorted(set(orders)))
    assert max(orders) <= technique.least_harmonics
    assert technique.frequencies_hz(11e6) == tuple(11e6 * j for j in orders)
    assert technique.estimate.__doc__


def test_only_the_papers_and_our_own_techniques_are_not_labelled_after_others() -> None:
    own = {"maximum-entropy", "pisarenko", "pisarenko-merged", "single-frequency", "likelihood"}

    assert {each.name for each in ALL if not each.label.startswith("after ")} == own


@pytest.mark.parametrize("technique", OF_MOMENTS, ids=by_name)
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_a_single_return_is_found(technique: Technique, dtype: type) -> None:
    phase = np.array([[0.4, 2.0, 3.3, 5.9]])
    exact = oracles.moments_of_returns(phase, np.full((1, 4), 3.0), M)

    found = technique.estimate(tm.bias(exact.astype(dtype)).moments)

    closest = (GRID_RAD | SMOOTH_RAD).get(technique.name, 3e-6)
    assert oracles.around(found.first_phase_rad() - phase[0]).max() < closest
    separation = found.separate()
    dim = {"sra": 0.8, "logarithmic": 0.8, "sra-table": 0.1, "regularised": 1.2}
    assert separation.direct == pytest.approx(3.0, rel=dim.get(technique.name, 0.3))
    assert found.first_phase_rad().dtype == separation.direct.dtype == np.finfo(dtype).dtype


@pytest.mark.parametrize("technique", OF_MOMENTS, ids=by_name)
def test_the_cumulative_response_climbs_from_nothing_to_all_of_the_light(
    technique: Technique,
) -> None:
    found = technique.estimate(tm.bias(moments()).moments)
    phase = np.linspace(0, 2 * np.pi, 200)

    come = found.cumulative(phase)

    assert come.shape == (200, 6)
    scale = come[-1].max()
    assert np.abs(come[0]).max() < 0.05 * scale
    assert np.diff(come, axis=0).min() > -1e-6 * scale
    next_turn = found.cumulative(phase + 4 * np.pi)
    assert next_turn[1:-1] == pytest.approx((come + 2 * come[-1])[1:-1], abs=1e-6 * scale)


@pytest.mark.parametrize("technique", BY_THEMSELVES, ids=by_name)
def test_a_pixel_that_cannot_be_used_has_no_range_and_disturbs_no_other(
    technique: Technique,
) -> None:
    b = tm.bias(moments()).moments
    clean = technique.estimate(b.copy()).first_phase_rad()
    b[:, 1] = 0
    b[max(technique.harmonics(M)), 2] = np.nan
    b[max(technique.harmonics(M)), 4] = np.inf

    found = technique.estimate(b)

    phase = found.first_phase_rad()
    assert np.isnan(phase[[1, 2, 4]]).all()
    assert phase[[0, 3, 5]] == pytest.approx(clean[[0, 3, 5]], abs=1e-9)
    light = found.separate().direct[[1, 2, 4]]
    assert np.all((light == 0) | ~np.isfinite(light))


@pytest.mark.parametrize("technique", OF_MOMENTS, ids=by_name)
@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_brightness_changes_the_light_and_no_phase(technique: Technique, scale: float) -> None:
    b = tm.bias(moments()).moments

    dim, bright = technique.estimate(b), technique.estimate(b * scale)

    assert bright.first_phase_rad() == pytest.approx(dim.first_phase_rad(), abs=1e-6)
    end = [2 * np.pi]
    assert bright.cumulative(end) == pytest.approx(dim.cumulative(end) * scale, rel=1e-6)


@pytest.mark.parametrize("technique", OF_MOMENTS, ids=by_name)
def test_moments_that_it_does_not_name_are_not_looked_at(technique: Technique) -> None:
    b = tm.bias(moments()).moments
    expected = technique.estimate(b).first_phase_rad()
    others = sorted(set(range(M + 1)) - set(technique.harmonics(M)))
    if technique.name == "pisarenko":
        others.remove(0)  # says how much is uniform, and nothing of phases
    b[others] = np.nan

    assert np.array_equal(technique.estimate(b).first_phase_rad(), expected)


@pytest.mark.parametrize("technique", BY_THEMSELVES, ids=by_name)
def test_pixels_keep_their_places_in_an_image(technique: Technique) -> None:
    b = tm.bias(moments()).moments

    image = technique.estimate(b.reshape((M + 1, 2, 3)))

    row = technique.estimate(b)
    assert np.array_equal(image.first_phase_rad(), row.first_phase_rad().reshape((2, 3)))
    assert np.array_equal(image.cumulative([3.0])[0], row.cumulative([3.0])[0].reshape((2, 3)))
    alone = technique.estimate(b[:, 0])
    assert alone.first_phase_rad() == pytest.approx(row.first_phase_rad()[0], abs=1e-9)
    assert alone.cumulative([3.0]) == pytest.approx(row.cumulative([3.0])[:, 0])


@pytest.mark.parametrize("technique", OF_MOMENTS, ids=by_name)
def test_too_few_moments_are_refused_by_number(technique: Technique) -> None:
    too_few = technique.least_harmonics - 1
    if too_few == 0:
        with pytest.raises(tm.ShapeError):
            technique.estimate(moments()[:1])
        return

    with pytest.raises(tm.ParameterError, match=technique.name) as error:
        technique.estimate(moments()[: too_few + 1])

    assert (error.value.field, error.value.value) == ("harmonics", too_few)
    technique.estimate(moments()[: too_few + 2])


def test_importing_the_techniques_imports_no_solver() -> None:
    code = (
        "import sys, transientcam_moments.comparisons;"
        "print(sorted({'scipy', 'numba'} & set(sys.modules)))"
    )

    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    assert printed.stdout.strip() == "[]"

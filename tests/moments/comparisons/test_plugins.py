"""Estimators of other packages: found by their names, and refused with the reason."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments import comparisons, plugins
from transientcam_moments.comparisons import PLUGINS, SparseEstimate, Technique

M, PHASE_RAD, WEIGHT = 4, np.array([[0.4, 2.0, 3.3]]), np.full((1, 3), 3.0)
_Offer = Callable[..., None]


def one_return(b: Any, **_: Any) -> SparseEstimate:
    """The phase of the first moment."""
    phase = np.remainder(np.angle(b[1]), 2 * np.pi)
    return SparseEstimate(phase[None], np.abs(b[1])[None], np.zeros(b.shape[1:]))


GOOD = replace(comparisons.TECHNIQUES["pisarenko"], name="mine", estimate=one_return)


@pytest.fixture
def offer(monkeypatch: pytest.MonkeyPatch) -> Iterator[_Offer]:
    """Let packages offer something by a name."""
    points: list[EntryPoint] = []
    module = ModuleType("offered_by_a_test")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(plugins, "entry_points", lambda group: points)

    def make(what: object, name: str = "mine") -> None:
        attribute = f"OFFERED_{len(points)}"
        setattr(module, attribute, what)
        points.append(EntryPoint(name, f"{module.__name__}:{attribute}", PLUGINS.group))
        PLUGINS.points.cache_clear()
        PLUGINS.loaded.cache_clear()

    yield make
    PLUGINS.points.cache_clear()
    PLUGINS.loaded.cache_clear()


def moments(dtype: type = np.complex128) -> Any:
    return oracles.moments_of_returns(PHASE_RAD, WEIGHT, M).astype(dtype)


def with_estimate(estimate: Callable[..., Any], **others: Any) -> Technique:
    return replace(GOOD, estimate=estimate, **others)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_it_is_a_value_of_the_settings_and_gives_range_and_light(
    offer: _Offer, dtype: type
) -> None:
    offer(GOOD)

    settings = tm.Settings(base_frequency_hz=20e6, estimator="mine", least_range_m=0.0)
    found = tm.reconstruct(moments(dtype), settings)

    assert PLUGINS.names() == ("mine",)
    assert found.range_m == pytest.approx(tm.range_m(PHASE_RAD[0], 20e6), rel=1e-5)
    assert found.direct == pytest.approx(WEIGHT[0], rel=1e-5)
    assert found.range_m.dtype == np.finfo(dtype).dtype


def test_it_is_told_noise_and_frequencies_where_it_asks(offer: _Offer) -> None:
    told: dict[str, Any] = {}

    def asks(b: Any, *, noise: Any, frequencies_hz: Any) -> SparseEstimate:
        told.update(noise=noise, frequencies_hz=frequencies_hz)
        return one_return(b)

    offer(with_estimate(asks, informed=True))
    variance = np.ones((M + 1, 3))

    comparisons.separated("mine", moments(), variance, 20e6 * np.arange(M + 1), 0.1)

    assert np.array_equal(told["noise"].variance, variance)
    assert told["frequencies_hz"].tolist() == [0, 20e6, 40e6, 60e6, 80e6]


def test_it_cannot_change_the_moments_of_others(offer: _Offer) -> None:
    def spoils(b: Any) -> SparseEstimate:
        found = one_return(b)
        b[:] = 0
        return found

    offer(with_estimate(spoils))
    b = moments()

    comparisons.separated("mine", b, None, np.arange(M + 1), 0.1)

    assert np.array_equal(b, moments())


def raises(b: Any) -> SparseEstimate:
    """Fail."""
    raise ZeroDivisionError("by hand")


@pytest.mark.parametrize(
    ("estimate", "words"),
    [
        (raises, "ZeroDivisionError: by hand"),
        (lambda b: one_return(b[:, :2]), r"shape \(2,\), and the pixels have \(3,\)"),
        (lambda b: one_return(b * np.nan), "no finite phase"),
        (lambda b: None, "returned None, no Estimate"),
        (lambda b: SparseEstimate(b[1:2] * 0 + 1j, abs(b[1:2]), b[0].real * 0), "complex"),
        (lambda b, extra: None, "TypeError"),
    ],
)
def test_what_it_does_wrong_is_said_and_spoils_no_other_property(
    offer: _Offer, estimate: Callable[..., Any], words: str
) -> None:
    offer(with_estimate(estimate))
    found = tm.reconstruct(moments(), tm.Settings(base_frequency_hz=20e6, estimator="mine"))

    with pytest.raises(tm.PluginFailed, match=f"mine .*{words}"):
        _ = found.range_m

    assert not (found.flags & int(tm.INVALID)).any()
    assert found.brightness == pytest.approx(WEIGHT[0], rel=1e-2)


def test_pixels_that_are_not_finite_have_no_range(offer: _Offer) -> None:
    def partly(b: Any) -> SparseEstimate:
        found = one_return(b)
        found.phase_rad[0, 0], found.weight[0, 1] = np.inf, np.nan
        return found

    offer(with_estimate(partly))

    direct, indirect, phase = comparisons.separated("mine", moments(), None, np.zeros(M + 1), 0.1)

    assert np.isnan(phase).tolist() == [True, True, False]
    assert (direct[:2] == 0).all()
    assert (indirect == 0).all()


@pytest.mark.parametrize(
    ("offered", "words"),
    [
        ([one_return], "is a function, not a Technique"),
        ([replace(GOOD, name="other")], "calls itself 'other'"),
        ([replace(GOOD, measures="code")], "measures 'code'"),
        ([replace(GOOD, cost=7)], "its cost is no text: 7"),  # type: ignore[arg-type]  # a faulty one
        ([GOOD, GOOD], "several packages offer it"),
    ],
)
def test_what_cannot_be_used_is_listed_with_the_reason(
    offer: _Offer, offered: list[object], words: str
) -> None:
    for each in offered:
        offer(each)

    reason = PLUGINS.statements()["mine"]

    assert isinstance(reason, tm.PluginFailed)
    assert words in reason.reason
    with pytest.raises(tm.PluginFailed, match="mine"):
        comparisons.technique_of("mine")


@pytest.mark.parametrize(
    ("compute", "words"),
    [
        (lambda b, **_: b[1], "Cannot cast"),
        (lambda b, **_: np.array(["a", "b", "c"]), "Cannot cast"),
        (lambda b, **_: b[1:].real, r"shape \(4, 3\), and the pixels have \(3,\)"),
        (lambda b, noise: b[1].real, "frequencies_hz"),
        (lambda b, **_: None, "Cannot cast"),
    ],
)
def test_a_map_that_is_none_is_refused_with_the_reason(
    compute: Callable[..., Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = plugins.MapProduct(
        name="a-map", unit="1", summary="", assumptions="", cost="", failure="", compute=compute
    )
    monkeypatch.setattr(plugins.PRODUCTS, "loaded", lambda name: made)

    with pytest.raises(tm.PluginFailed, match=f"the product a-map .*{words}"):
        plugins.mapped("a-map", moments(), None, 20e6 * np.arange(M + 1))


def test_a_map_has_no_infinite_values_and_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = plugins.MapProduct(
        name="a-map",
        unit="1",
        summary="",
        least_harmonics=M,
        assumptions="",
        cost="",
        failure="",
        compute=lambda b, **_: np.array([1.0, np.inf, -np.inf]),
    )
    monkeypatch.setattr(plugins.PRODUCTS, "loaded", lambda name: made)

    found = plugins.mapped("a-map", moments(), None, np.zeros(M + 1))

    assert np.array_equal(found, [1.0, np.nan, np.nan], equal_nan=True)
    with pytest.raises(tm.PluginFailed, match="needs 4 frequencies, and there are 3"):
        plugins.mapped("a-map", moments()[:-1], None, np.zeros(M))


def test_the_name_of_a_built_in_one_cannot_be_taken(offer: _Offer) -> None:
    offer(replace(GOOD, name="pisarenko"), "pisarenko")

    assert PLUGINS.names() == ()
    assert comparisons.technique_of("pisarenko") is comparisons.TECHNIQUES["pisarenko"]

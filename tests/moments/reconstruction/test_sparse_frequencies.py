"""Reconstruction of frequencies that are not 1 to m times one."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments.errors import ParameterError

F_HZ = 8e6
MULTIPLES = (2, 10, 15)
PHASE = np.linspace(0.4, 5.9, 60).reshape(6, 10)
Array = NDArray[Any]


def moments(*returns: tuple[Array, float], zeroth: bool = False) -> Array:
    j = np.array((0, *MULTIPLES))[:, None, None]
    b = sum(weight * np.exp(1j * j * phase) for phase, weight in returns)
    return np.asarray(b if zeroth else np.where(j > 0, b, 0))


def settings(**changes: Any) -> tm.Settings:
    chosen: dict[str, Any] = {
        "base_frequency_hz": F_HZ,
        "zeroth": "estimated",
        "multiples": MULTIPLES,
        "smoothing_sigma_px": 0.0,
        "estimator": "likelihood",
    }
    return tm.Settings(**chosen | changes)


def test_one_return_has_its_range_over_the_whole_period_of_the_base_frequency() -> None:
    found = tm.reconstruct(moments((PHASE, 500.0)), settings())

    np.testing.assert_allclose(found.range_m, tm.range_m(PHASE, F_HZ), atol=1e-4)
    np.testing.assert_allclose(found.brightness, 500, rtol=1e-4)
    assert found.range_m.max() > tm.range_m(np.float64(2 * np.pi / 2), F_HZ)  # that of 2 f alone
    assert not found.flags.any()


@pytest.mark.parametrize("zeroth", ["estimated", "low-frequency"])
def test_two_returns_are_resolved(zeroth: str) -> None:
    b = moments((PHASE, 500.0), (PHASE + 0.35, 300.0), zeroth=zeroth != "estimated")

    found = tm.reconstruct(b, settings(zeroth=zeroth))

    np.testing.assert_allclose(found.range_m, tm.range_m(PHASE, F_HZ), atol=2e-2)
    np.testing.assert_allclose(found.direct, 500, rtol=1e-2)
    np.testing.assert_allclose(found.indirect, 300, rtol=2e-2)
    np.testing.assert_allclose(found.brightness, 800, rtol=1e-2)
    assert found.returns.phase_rad.shape == (3, *PHASE.shape)


def test_returns_have_a_slot_for_each_multiple() -> None:
    j = np.array((0, 2, 3, 5, 7, 11))[:, None]
    b = np.where(j > 0, 400 * np.exp(1j * j * PHASE[0]), 0)

    found = tm.reconstruct(b, settings(multiples=(2, 3, 5, 7, 11))).returns

    assert found.phase_rad.shape == found.weight.shape == (5, 10)
    np.testing.assert_allclose(found.phase_rad[0], PHASE[0], atol=1e-5)
    assert np.isnan(found.phase_rad[3:]).all()
    assert not found.weight[3:].any()


def test_pixels_without_light_or_number_are_flagged_and_have_no_range() -> None:
    b = moments((PHASE, 500.0))
    b[:, 0, 0] = 0.0
    b[2, 0, 1] = np.nan
    saturated = np.zeros(PHASE.shape, dtype=bool)
    saturated[0, 2] = True

    found = tm.reconstruct(b, settings(), saturated_pixels=saturated)

    flags = [tm.Flags.NO_SIGNAL, tm.Flags.NON_FINITE, tm.Flags.SATURATED, tm.Flags.VALID]
    assert found.flags[0, :4].tolist() == flags
    assert np.isfinite(found.range_m[0]).tolist() == [False, False, *[True] * 8]


def test_smoothing_averages_neighbours() -> None:
    b = moments((np.full(PHASE.shape, 2.0), 500.0))
    b[1:] += np.random.default_rng(3).normal(0, 5, b[1:].shape)

    rough = tm.reconstruct(b, settings())
    found = tm.reconstruct(b, settings(smoothing_sigma_px=1.0))

    assert found.range_m.std() < 0.6 * rough.range_m.std()


def test_what_needs_all_multiples_is_refused_by_name() -> None:
    found = tm.reconstruct(moments((PHASE, 500.0)), settings())

    for what in (lambda: found.coefficients, lambda: found.peaks, lambda: found.density([1e-8])):
        with pytest.raises(ParameterError, match=r"multiples = \(2, 10, 15\).* 1 to m, for"):
            what()
    assert np.isnan(found.validity).all()
    with pytest.raises(ParameterError, match="unwrapped-phase, for the multiples"):
        _ = tm.reconstruct(moments((PHASE, 500.0)), settings(estimator="pisarenko")).range_m


def test_predicted_deviations_are_those_of_noisy_frames() -> None:
    sensor = tm.noise.Sensor(
        gain_e_per_dn=9.0, full_well_e=40_000.0, read_noise_e=30.0, dark_dn=64.0, bits=12
    )
    rng = np.random.default_rng(5)
    phases = (0.0, 2 * np.pi / 3, 4 * np.pi / 3)
    phase = np.full((20, 30), 1.7)
    b = moments((phase, 900.0))[1:]
    light = (900 + np.real(b[:, None] * np.exp(-1j * np.array(phases))[:, None, None])) / 2
    electrons = rng.poisson(9 * light) + rng.normal(0, 30, light.shape)
    raw = (64 + electrons / 9).reshape(9, *phase.shape)
    noisy = settings(takes=1, phases_rad=phases, sensor=sensor, neighbours="none")

    found = tm.reconstruct(raw, noisy, calibration=np.ones(4))

    assert found.range_m.std() == pytest.approx(np.median(found.range_std_m), rel=0.25)
    assert (found.flags & tm.Flags.UNEXPLAINED > 0).mean() < 0.02


@pytest.mark.parametrize("estimator", ["two-returns", "unwrapped-phase"])
@pytest.mark.parametrize("zeroth", ["estimated", "low-frequency"])
def test_other_estimators_of_any_multiples_have_range_and_returns(
    estimator: str, zeroth: str
) -> None:
    b = moments((PHASE, 500.0), zeroth=zeroth != "estimated")

    found = tm.reconstruct(b, settings(estimator=estimator, zeroth=zeroth))

    np.testing.assert_allclose(found.range_m, tm.range_m(PHASE, F_HZ), atol=1e-4)
    np.testing.assert_allclose(found.direct, 500, rtol=1e-4)
    assert not found.indirect.any()
    assert (found.returns.count == 1).all()
    assert found.returns.weight.shape == (3, *PHASE.shape)
    bound = tm.range_m(0.01 / np.sqrt(sum(j * j for j in MULTIPLES)), F_HZ)
    assert (found.range_std_m > 0.5 * bound).all()
    assert (found.range_std_m < 1.5 * bound).all()


def test_ambiguous_and_unexplained_phases_are_flagged() -> None:
    sensor = tm.noise.Sensor(
        gain_e_per_dn=9.0, full_well_e=40_000.0, read_noise_e=30.0, dark_dn=64.0, bits=12
    )
    chosen = {"estimator": "unwrapped-phase", "neighbours": "none"}
    stated = settings(takes=1, sensor=sensor, **chosen)
    two = moments((PHASE, 500.0), (PHASE + 0.35, 300.0))
    clear = tm.reconstruct(moments((PHASE, 500.0)), stated, calibration=np.ones(4))

    flags = tm.reconstruct(two, stated, calibration=np.ones(4)).flags

    assert not clear.flags.any()
    assert (flags & tm.Flags.UNEXPLAINED > 0).all()
    faint = tm.reconstruct(moments((PHASE, 14.0)), stated, calibration=np.ones(4))
    assert (faint.flags & tm.Flags.DEGENERATE > 0).mean() > 0.9


def test_the_misfit_is_that_of_the_estimator_in_use() -> None:
    # three returns explain this pair as well, and leave the likelihood no degree of freedom
    b = moments((PHASE, 500.0), (PHASE + 1.1, 210.0))
    misfit = {
        name: tm.reconstruct(b, settings(estimator=name)).reduced_chi_square
        for name in ("likelihood", "two-returns", "unwrapped-phase")
    }
    tried = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)[:, None, None]
    std = 0.01 * np.maximum(abs(b.real), abs(b.imag)).max(axis=0)
    one_return = sum(
        (abs(plane) / std * np.angle(plane * np.exp(-1j * j * tried))) ** 2
        for j, plane in zip(MULTIPLES, b[1:], strict=True)
    )

    assert np.isnan(misfit["likelihood"]).all()
    assert (misfit["two-returns"] < 1e-6).all()
    expected = np.min(one_return, axis=0) / 2  # three phases, one unknown
    np.testing.assert_allclose(misfit["unwrapped-phase"], expected, rtol=1e-3)


@pytest.mark.parametrize("multiples", [(), (0, 1), (2, 2), (3, 1), (1, 33)])
def test_multiples_that_are_none_are_refused(multiples: tuple[int, ...]) -> None:
    with pytest.raises(ParameterError, match="multiples"):
        tm.Settings(multiples=multiples)

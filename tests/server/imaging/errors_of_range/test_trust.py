"""Which reason a pixel has, on moments whose returns are given."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.documents import TrustCountsDocument
from transientcam.wire import Trust
from transientcam_driver import AppliedSequence, RawFrame, Sequence, open_camera
from transientcam_driver.calibration import TemperatureDrift
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Gains, Intrinsics, Recipe
from transientcam_server.imaging._errors_of_range.trust import judged, not_judged
from transientcam_server.settings import ReconstructionSettings

F_HZ, M = 23e6, 4
SHAPE = 24, 30
METRES = 4 * np.pi * F_HZ / 299_792_458.0
"""Phase in rad of a range in m."""
Array = NDArray[np.float64]


def applied() -> AppliedSequence:
    with open_camera("sim:wall", clock=VirtualClock()) as camera:
        sequence = Sequence(base_frequency_hz=F_HZ, harmonics=M, exposure_s=1e-3)
        return camera.capabilities.apply(sequence)


APPLIED = applied()
RECIPE = Recipe(
    APPLIED,
    ReconstructionSettings(estimator="pisarenko", neighbours="gaussian"),
    4095.0,
    sensor=tm.noise.Sensor(),
)


def found(
    range_m: Array,
    light_dn: Array,
    later: tuple[float, float] = (0.0, 0.0),
    recipe: Recipe = RECIPE,
) -> tm.Reconstruction:
    """The reconstruction of a return at a range, and of a later one: its share, and how far."""
    share, after_m = later
    j = np.arange(M + 1).reshape(-1, 1, 1)
    even = 0.01
    b = (1 - share - even) * np.exp(1j * j * METRES * range_m)
    b = b + share * np.exp(1j * j * METRES * (range_m + after_m)) + even * (j == 0)
    return recipe._reconstructor(tm.Measured((light_dn * b).astype(np.complex64)))


def trust_of(
    recipe: Recipe, image: tm.Reconstruction, raw: RawFrame | None = None, bias_m: float = 1e-4,
    std_m: float = 1e-3,
) -> tuple[Array, Array]:  # fmt: skip
    return judged(recipe, image, np.full(SHAPE, std_m), np.full(SHAPE, bias_m), raw)


def test_a_wall_by_its_own_light_is_trusted_within_a_few_millimetres() -> None:
    error_m, trust = trust_of(RECIPE, found(np.full(SHAPE, 2.0), np.full(SHAPE, 500.0)))

    assert (trust == Trust.TRUSTED).all()
    assert (error_m > 1.6e-3).all()
    assert (error_m < 6e-3).all()


def test_light_that_no_surface_can_send_directly_is_not_trusted() -> None:
    lens = Intrinsics.of_field(45.0, width=SHAPE[1], height=SHAPE[0], source="settings")
    image = found(np.full(SHAPE, 2.0), np.full(SHAPE, 500.0))  # white would be 250 DN

    def by(white_dn_per_s: float) -> Recipe:
        return replace(RECIPE, intrinsics=replace(lens, beam=(0.0, 0.0, 1.0, 0.0, white_dn_per_s)))

    assert (trust_of(by(1e6), image)[1] == Trust.NO_DIRECT_LIGHT).all()
    assert (trust_of(by(4e6), image)[1] == Trust.TRUSTED).all()
    assert not_judged(by(1e6), None) == ("motion", "drift")
    assert not_judged(RECIPE, None) == ("no_direct_light", "shadow", "motion", "drift")


def test_pixels_without_light_have_no_range_and_those_beside_a_step_are_edges() -> None:
    range_m, light_dn = np.full(SHAPE, 2.0), np.full(SHAPE, 500.0)
    range_m[:, 15:] = 1.0
    light_dn[:3] = 0.0

    error_m, trust = trust_of(RECIPE, found(range_m, light_dn))

    assert (trust[:2] == Trust.NO_RANGE).all()
    assert np.isnan(error_m[:2]).all()
    assert (trust[8:, 13:17] == Trust.EDGE).any(axis=1).all()
    assert (trust[8:, :11] == Trust.TRUSTED).all()


@pytest.mark.parametrize(("after_m", "most_m"), [(0.3, 0.07), (2.5, 6e-3)])
def test_later_light_widens_the_interval_where_it_is_near_and_not_where_it_is_resolved(
    after_m: float, most_m: float
) -> None:
    image = found(np.full(SHAPE, 1.5), np.full(SHAPE, 500.0), later=(0.15, after_m))

    error_m, trust = trust_of(RECIPE, image)

    assert (trust == Trust.TRUSTED).all()
    assert np.median(error_m) < most_m
    if after_m < 1:
        assert np.median(error_m) > 10e-3


@pytest.mark.parametrize(
    ("later", "reason"),
    [((0.0, 0.0), Trust.LATER_LIGHT_UNRESOLVED), ((0.3, 2.5), Trust.LATER_LIGHT)],
)
def test_estimators_that_disagree_by_much_leave_later_light_open(
    later: tuple[float, float], reason: Trust
) -> None:
    image = found(np.full(SHAPE, 1.5), np.full(SHAPE, 500.0), later=later)

    error_m, trust = trust_of(RECIPE, image, bias_m=0.2)

    assert (trust == reason).all()
    assert (error_m >= 1.6 * 0.2).all()


@pytest.mark.parametrize("estimator", ["likelihood", "pisarenko"])
@pytest.mark.parametrize("kind", ["material", "mirror image", "room"])
def test_light_that_is_spread_by_less_than_any_return_resolves_may_have_begun_earlier(
    kind: str, estimator: str
) -> None:
    """Behind 2 m: an exponential delay of 50 mm in the mean; half of the light 80 mm later; of 10 %
    an exponential delay of 300 mm, whose spread of 131 mm is mostly that of its tail."""
    # with less noise than the Gaussian leaves Pisarenko tells a mirror image apart
    chosen = {"estimator": estimator, "neighbours": "gaussian"}
    recipe = replace(RECIPE, settings=ReconstructionSettings.model_validate(chosen))
    j = np.arange(M + 1).reshape(-1, 1, 1)
    late, range_m = {"material": 0.05, "mirror image": 0.04, "room": 0.03}[kind], 2.0
    delayed = 1 / (1 - 1j * j * METRES * late)
    mirrored = (1 + np.exp(1j * j * METRES * 2 * late)) / 2
    tailed = 0.9 + 0.1 / (1 - 1j * j * METRES * 10 * late)
    light = {"material": delayed, "mirror image": mirrored, "room": tailed}[kind]
    b = light * np.exp(1j * j * METRES * np.full(SHAPE, range_m))
    # with noise: no far return that it makes may pass for what was lost of the modulation
    random = np.random.default_rng(4)
    b = b + random.normal(0, 0.002, b.shape) + 1j * random.normal(0, 0.002, b.shape)
    image = recipe._reconstructor(tm.Measured((500.0 * b).astype(np.complex64)))

    error_m, _ = trust_of(recipe, image)

    off_m = np.asarray(image.range_m) - range_m
    assert kind == "room" or 0.5 * late < np.median(off_m) < 1.1 * late
    # of a room, models with and without a return at its beginning spread
    widest = 1.6 if kind == "room" else 1.3
    assert np.median(off_m) < 1.1 * np.median(error_m) < widest * late


def test_a_share_of_what_a_tail_moves_the_highest_frequency_is_in_the_interval() -> None:
    """Of the light 30 % come after the rest, 1 m later in the mean, falling exponentially."""
    settings = ReconstructionSettings(estimator="likelihood", neighbours="gaussian")
    recipe = replace(RECIPE, settings=settings)
    j = np.arange(M + 1).reshape(-1, 1, 1)
    b = (0.7 + 0.3 / (1 - 1j * j * METRES)) * np.exp(1j * j * METRES * np.full(SHAPE, 2.0))
    image = recipe._reconstructor(tm.Measured((500.0 * b).astype(np.complex64)))

    error_m, _ = trust_of(recipe, image)

    assert np.median(image.likelihood.tail / image.brightness) == pytest.approx(0.3, abs=0.1)
    assert 0.3 / 3 / METRES / M < np.median(error_m) < 2 * 0.3 / METRES / M


KEEPING_EDGES = replace(
    RECIPE, settings=ReconstructionSettings(estimator="likelihood", neighbours="edge-preserving")
)


def test_a_slope_that_averaging_mixes_is_no_light_that_is_spread() -> None:
    """8 mm a pixel have a deviation of 17 mm over the pixels averaged, as of spread light."""
    light_dn, columns = np.full(SHAPE, 500.0), np.arange(SHAPE[1])

    def error_m(slope_m: float) -> float:
        image = found(2.0 + slope_m * columns + np.zeros(SHAPE), light_dn, recipe=KEEPING_EDGES)
        assert image.variance_share is not None
        assert np.median(image.variance_share) < 0.03
        return float(np.median(trust_of(KEEPING_EDGES, image)[0][6:-6, 6:-6]))

    assert error_m(8e-3) < 1.2 * error_m(0.0)


def test_estimators_that_disagree_by_the_noise_that_neighbours_share_show_no_bias() -> None:
    """Noise of 10 mm of four harmonics: that of three has 30/14 times the variance, so that both
    differ by 10.7 mm."""
    wall = np.full(SHAPE, 2.0), np.full(SHAPE, 500.0)

    def error_m(recipe: Recipe, bias_m: float) -> Array:
        image = found(*wall, recipe=recipe)
        return trust_of(recipe, image, bias_m=bias_m, std_m=10e-3)[0]

    # of 25 pixels with noise of their own the median would have less of it
    gaussian = ReconstructionSettings(estimator="likelihood", neighbours="gaussian")
    apart = replace(RECIPE, settings=gaussian)
    assert (error_m(apart, 10.6e-3) > error_m(apart, 0.0)).all()
    np.testing.assert_array_equal(error_m(KEEPING_EDGES, 10.6e-3), error_m(KEEPING_EDGES, 0.0))
    assert (error_m(KEEPING_EDGES, 20e-3) > error_m(KEEPING_EDGES, 0.0)).all()


def test_what_tells_of_the_same_later_light_counts_once() -> None:
    """What nothing shows is no more than what estimators disagree by, where they do by more."""
    image = found(np.full(SHAPE, 2.0), np.full(SHAPE, 500.0), recipe=KEEPING_EDGES)

    error_m, _ = trust_of(KEEPING_EDGES, image, bias_m=20e-3)

    np.testing.assert_allclose(error_m, np.hypot(20e-3, 1.5e-3), rtol=0.01)


def test_fewer_harmonics_than_returns_show_no_bias_of_all_of_them() -> None:
    """Two harmonics hold two returns, and are off by centimetres where three are."""
    applied = replace(APPLIED, sequence=replace(APPLIED.sequence, harmonics=3))
    recipe = replace(KEEPING_EDGES, applied=applied)
    j = np.arange(4).reshape(-1, 1, 1)

    def error_m(shares: tuple[float, ...]) -> Array:
        returns = [
            share * np.exp(1j * j * METRES * np.full(SHAPE, 1.0 + 2.0 * after))
            for after, share in enumerate(shares)
        ]
        b = np.sum(returns, axis=0)
        image = recipe._reconstructor(tm.Measured((500.0 * b).astype(np.complex64)))
        assert (np.asarray(image.likelihood.count) == len(shares)).all()
        return trust_of(recipe, image, bias_m=50e-3)[0]

    assert (error_m((0.7, 0.3)) > 49e-3).all()
    assert (error_m((0.5, 0.3, 0.2)) < 10e-3).all()


def capture(temperature_c: float) -> RawFrame:
    images = np.zeros((0, *SHAPE), np.uint16)
    return RawFrame(1, 1, images, APPLIED.sequence.labels, 0.0, 0.0, 0.1, temperature_c, 0)


def test_a_camera_far_from_its_calibrations_temperature_is_not_trusted() -> None:
    planes = np.ones((M + 1, *SHAPE), np.complex64)
    recipe = replace(RECIPE, gains=Gains("then", planes, None, temperature_c=25.0))
    image = found(np.full(SHAPE, 2.0), np.full(SHAPE, 500.0))
    as_then_m, _ = trust_of(recipe, image, capture(25.0))

    for now_c, reason in ((31.0, Trust.TRUSTED), (38.0, Trust.DRIFT), (12.0, Trust.DRIFT)):
        error_m, trust = trust_of(recipe, image, capture(now_c))
        assert (trust == reason).all()
        drift_m = TemperatureDrift(25.0, now_c).range_m
        np.testing.assert_allclose(error_m, np.hypot(as_then_m, drift_m), rtol=1e-5)


def test_a_temperature_that_is_not_known_is_no_drift() -> None:
    gains = Gains("then", np.ones((M + 1, *SHAPE), np.complex64), None)
    image = found(np.full(SHAPE, 2.0), np.full(SHAPE, 500.0))

    for recipe in (RECIPE, replace(RECIPE, gains=gains)):
        assert (trust_of(recipe, image, capture(60.0))[1] == Trust.TRUSTED).all()


def test_metadata_count_the_codes_in_their_order() -> None:
    assert [each.name.lower() for each in Trust] == list(TrustCountsDocument.__annotations__)
    assert list(Trust) == list(range(len(Trust)))

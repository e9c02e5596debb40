"""Images against the measurement model, and noise against the photon-transfer curve."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Sequence, SubPhases
from transientcam_driver.camera import Sensor
from transientcam_simulation.base import SparseResponses
from transientcam_simulation.effects import EFFECTS, FEW_E, Call, Effect, ShotNoise
from transientcam_simulation.imaging import World
from transientcam_simulation.light import GivenScenery, LightRequirements, Views

SENSOR = Sensor(full_well_e=40_000, gain_e_per_dn=9.0, read_noise_e=30.0, dark_dn=64.0, bits=12)
QUIET = {"shot-noise": "off", "read-noise": "off"}
EXPOSURE_S = 1e-3
SHAPE = (120, 163)


def world(
    *,
    weights: tuple[float, ...] = (1.0,),
    delays_s: tuple[float, ...] = (11e-9,),
    electrons: float = 20_000.0,
    sensor: Sensor = SENSOR,
    effects: Mapping[str, str] | None = None,
    seed: int = 1,
) -> World:
    """The same few returns on all pixels; a weight of 1 is ``electrons`` an exposure."""
    ones = np.ones(SHAPE)
    return World(
        GivenScenery(
            SparseResponses(
                np.array([delay_s * ones for delay_s in delays_s]),
                np.array([weight * ones for weight in weights]),
            )
        ),
        sensor,
        electrons_per_s=electrons / EXPOSURE_S,
        effects=effects or {},
        seed=seed,
    )


def images(of: World, sequence: Sequence, numbers: range | None = None) -> NDArray[np.float64]:
    """All images of a sequence, or one label's image again and again."""
    labels = sequence.labels
    of.configure(sequence, labels)
    chosen = enumerate(labels) if numbers is None else ((n, labels[0]) for n in numbers)
    return np.array(
        [of.image(label, number=n, device_time_s=0.0) for n, label in chosen], dtype=np.float64
    )


def phasor(weights: tuple[float, ...], delays_s: tuple[float, ...], f_hz: float) -> complex:
    """Sum over the returns, in plain Python."""
    return sum(
        w * complex(math.cos(2 * math.pi * f_hz * t), math.sin(2 * math.pi * f_hz * t))
        for w, t in zip(weights, delays_s, strict=True)
    )


@pytest.mark.parametrize(
    "sub_phases", [SubPhases("arccos", 8), SubPhases("none"), SubPhases("harmonic-cancellation", 3)]
)
def test_images_follow_the_measurement_model(sub_phases: SubPhases) -> None:
    weights, delays_s = (0.5, 0.3, 0.1), (11.3e-9, 19.3e-9, 26.7e-9)
    sequence = Sequence(23e6, 3, exposure_s=EXPOSURE_S, sub_phases=sub_phases)
    shift = sum(
        w * complex(math.cos(p), -math.sin(p))
        for w, p in zip(sub_phases.weights, sub_phases.phases_rad, strict=True)
    )

    measured = images(world(weights=weights, delays_s=delays_s, effects=QUIET), sequence)

    for label, image in zip(sequence.labels, measured, strict=True):
        turned = complex(math.cos(label.phase_rad), -math.sin(label.phase_rad))
        modulated = (phasor(weights, delays_s, label.frequency_hz) * shift * turned).real
        expected = 64 + 0.5 * (sum(weights) + modulated) * 20_000 / 9
        assert np.abs(image - expected).max() <= 0.5 + 1e-3


def test_four_buckets_give_the_moment_with_a_phase_that_grows_with_delay() -> None:
    sequence = Sequence(23e6, 1, "estimated", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))

    i_0, i_90, i_180, i_270 = images(world(effects=QUIET, sensor=SENSOR.ideal()), sequence)[:, 0, 0]

    moment = complex(i_0 - i_180, i_90 - i_270)
    assert math.atan2(moment.imag, moment.real) == pytest.approx(
        2 * math.pi * 23e6 * 11e-9, abs=1e-4
    )


def test_on_minus_off_is_half_the_brightness() -> None:
    sequence = Sequence(23e6, 1, "on-off", exposure_s=EXPOSURE_S)

    on, off, *_ = images(world(effects=QUIET), sequence)[:, 0, 0]

    assert off == 64
    assert 2 * (on - off) == pytest.approx(20_000 / 9, abs=1)


def test_the_signal_grows_with_the_exposure_and_saturates_at_full_well() -> None:
    means = []
    for factor in (0.5, 1, 2, 20):
        sequence = Sequence(23e6, 1, "on-off", exposure_s=EXPOSURE_S * factor)
        means.append(images(world(effects=QUIET), sequence)[0].mean() - 64)

    assert means[1] == pytest.approx(2 * means[0], abs=1)
    assert means[2] == pytest.approx(2 * means[1], abs=1)
    assert means[3] == 4095 - 64


@pytest.mark.parametrize("electrons", [0.0, 10.0, 60.0, 150.0, 300.0, 2_000.0, 20_000.0, 60_000.0])
def test_mean_and_variance_follow_the_photon_transfer_curve(electrons: float) -> None:
    """Variance in DN^2 = (mean_e + read^2) / gain^2 + 1/12 for the rounding."""
    level = world(electrons=electrons or 1.0, weights=(1.0 if electrons else 0.0,))
    mean_e = electrons / 2

    series = images(level, Sequence(23e6, 1, "on-off", exposure_s=EXPOSURE_S), range(20))

    values = series.size
    variance = (mean_e + 30.0**2) / 9.0**2 + 1 / 12
    assert series.mean() == pytest.approx(64 + mean_e / 9, abs=5 * math.sqrt(variance / values))
    # the relative error of a variance of n values is sqrt(2 / n)
    assert series.var() == pytest.approx(variance, rel=5 * math.sqrt(2 / values))


def test_few_electrons_are_poisson_distributed_exactly() -> None:
    """With a gain of 1 and no read noise, codes are counted electrons."""
    sensor = Sensor(gain_e_per_dn=1.0, read_noise_e=0.0, dark_dn=0.0)
    mean_e = 3.0
    series = images(
        world(electrons=2 * mean_e, sensor=sensor),
        Sequence(23e6, 1, "on-off", exposure_s=EXPOSURE_S),
        range(10),
    )

    for count in range(10):
        share = math.exp(-mean_e) * mean_e**count / math.factorial(count)
        error = math.sqrt(share * (1 - share) / series.size)
        assert np.mean(series == count) == pytest.approx(share, abs=5 * error)


def test_the_normal_approximation_begins_where_skewness_is_a_tenth() -> None:
    assert 1 / math.sqrt(FEW_E) == pytest.approx(0.1)


def test_pixels_and_images_are_independent() -> None:
    series = images(world(), Sequence(23e6, 1, "on-off", exposure_s=EXPOSURE_S), range(40))
    noise = series - series.mean()

    neighbours = np.corrcoef(noise[:, :, :-1].ravel(), noise[:, :, 1:].ravel())[0, 1]
    successive = np.corrcoef(noise[:-1].ravel(), noise[1:].ravel())[0, 1]
    assert abs(neighbours) < 5 / math.sqrt(noise.size)
    assert abs(successive) < 5 / math.sqrt(noise.size)


def test_the_same_seed_gives_identical_bytes_whatever_was_rendered_before() -> None:
    sequence = Sequence(exposure_s=EXPOSURE_S)
    first, second, other = world(seed=3), world(seed=3), world(seed=4)
    for of in (first, second, other):
        of.configure(sequence, sequence.labels)
    label = sequence.labels[5]
    second.image(label, number=1, device_time_s=0.0)  # one more than the first renders

    image = first.image(label, number=77, device_time_s=0.0)

    assert image.tobytes() == second.image(label, number=77, device_time_s=0.0).tobytes()
    assert image.tobytes() != other.image(label, number=77, device_time_s=0.0).tobytes()
    assert image.tobytes() != first.image(label, number=78, device_time_s=0.0).tobytes()


@pytest.mark.parametrize("effect", [effect for effect in EFFECTS if effect.optional])
def test_an_effect_that_is_off_is_not_built(
    effect: type[Effect], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("built")

    monkeypatch.setattr(effect, "__init__", never)
    sequence = Sequence(exposure_s=EXPOSURE_S)

    world(effects={effect.name: "off"}).configure(sequence, sequence.labels)
    with pytest.raises(AssertionError, match="built"):
        world(effects={effect.name: "on"}).configure(sequence, sequence.labels)


def test_light_is_traced_for_images_or_ahead_of_them_once() -> None:
    class Traced(GivenScenery):
        views = 0

        def view(self, wanted: LightRequirements) -> Views:
            self.views += 1
            return super().view(wanted)

    ones = np.ones((1, *SHAPE))
    scenery = Traced(SparseResponses(11e-9 * ones, ones))
    of = World(scenery, SENSOR, electrons_per_s=2e7, effects={}, seed=1)
    sequence = Sequence(exposure_s=EXPOSURE_S)

    of.configure(sequence, sequence.labels)
    assert scenery.views == 0
    of.prepare()
    images(of, sequence)
    of.truth()
    assert scenery.views == 1


def test_without_noise_no_random_number_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    class NoRandom:
        def __getattr__(self, name: str) -> None:
            raise AssertionError(name)

    sequence = Sequence(exposure_s=EXPOSURE_S)
    quiet = world(effects=QUIET)
    quiet.configure(sequence, sequence.labels)
    expected = quiet.image(sequence.labels[0], number=0, device_time_s=0.0)
    monkeypatch.setattr(np.random, "Generator", lambda _bits: NoRandom())

    image = quiet.image(sequence.labels[0], number=0, device_time_s=0.0)

    assert image.tobytes() == expected.tobytes()


def test_effects_say_whether_why_and_how_large() -> None:
    calls = world().calls(Sequence(exposure_s=EXPOSURE_S))

    assert calls["shot-noise"].called
    # a moment is made of four images and has twice their noise
    assert calls["shot-noise"].size_dn == pytest.approx(2 * math.sqrt(10_000) / 9)
    assert "10000 electrons" in calls["shot-noise"].reason
    assert calls["read-noise"].size_dn == pytest.approx(2 * 30 / 9)
    assert calls["quantisation"].size_dn == pytest.approx(2 / math.sqrt(12))
    assert all(call.cost_s > 0 for call in calls.values() if call.called)


def test_shot_noise_is_called_for_in_the_dark_and_read_noise_where_there_is_any() -> None:
    dark = world(weights=(0.0,)).calls(Sequence(exposure_s=EXPOSURE_S))
    ideal = world(sensor=SENSOR.ideal()).calls(Sequence(exposure_s=EXPOSURE_S))

    assert dark["shot-noise"].called
    assert not ideal["read-noise"].called
    assert isinstance(ShotNoise.called_for(world().conditions(Sequence())), Call)


def test_the_ideal_sensor_measures_moments_to_1e_4_of_the_brightness() -> None:
    weights, delays_s = (0.55, 0.30, 0.5), (3e-9, 9e-9, 20e-9)
    sequence = Sequence(23e6, 4, "on-off", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))
    ideal = world(weights=weights, delays_s=delays_s, sensor=SENSOR.ideal(), effects=QUIET)

    measured = images(ideal, sequence)[2:].reshape(4, 4, *SHAPE)

    scale = 20_000 / SENSOR.ideal().gain_e_per_dn
    for j, (i_0, i_90, i_180, i_270) in enumerate(measured, start=1):
        error = (i_0 - i_180) + 1j * (i_90 - i_270) - scale * phasor(weights, delays_s, j * 23e6)
        assert np.abs(error).max() < 1e-4 * scale * sum(weights)


def test_truth_is_in_the_units_of_the_images() -> None:
    of = world(weights=(0.4, 0.6), delays_s=(20e-9, 10e-9))
    sequence = Sequence(exposure_s=EXPOSURE_S)
    of.configure(sequence, sequence.labels)

    truth = of.truth()

    assert truth.kind == "sparse"
    assert truth.brightness == pytest.approx(np.full(SHAPE, 20_000 / 9))
    assert truth.direct == pytest.approx(np.full(SHAPE, 0.6 * 20_000 / 9))
    assert truth.range_m == pytest.approx(np.full(SHAPE, 299_792_458 * 10e-9 / 2))
    time_s, weight = truth.impulse_response(5, 7)
    assert time_s == pytest.approx([10e-9, 20e-9])
    assert weight == pytest.approx([0.6 * 20_000 / 9, 0.4 * 20_000 / 9])


def test_where_no_light_comes_back_truth_is_nan_and_zero() -> None:
    of = world(weights=(0.0,))
    sequence = Sequence(exposure_s=EXPOSURE_S)
    of.configure(sequence, sequence.labels)

    truth = of.truth()

    assert np.isnan(truth.range_m).all()
    assert not truth.direct.any()
    assert [values.size for values in truth.impulse_response(0, 0)] == [0, 0]

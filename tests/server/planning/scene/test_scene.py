"""What a scene states: its frequencies, ambiguities and typical pixels."""

import dataclasses

import numpy as np
import pytest

from transientcam_moments import SPEED_OF_LIGHT_M_S
from transientcam_server.planning._scene.scene import (
    FEW_PIXELS,
    PIXELS,
    SceneStatistics,
    uniform_scene,
)

HZ = 10e6
LOOKED = 5  # harmonics


def delay_s(range_m: float) -> float:
    return 2 * range_m / SPEED_OF_LIGHT_M_S


def measured(pixels: int = PIXELS) -> SceneStatistics:
    """A look at pixels with one return each, farther and farther away."""
    range_m = np.linspace(1.0, 5.0, pixels)
    turn = np.exp(2j * np.pi * HZ * 2 * range_m / SPEED_OF_LIGHT_M_S)
    return SceneStatistics(
        brightness_dn_per_s=np.arange(pixels) + 1e5,
        ambient_dn_per_s=np.arange(pixels) + 2e5,
        brightest_dn_per_s=3e5,
        direct_m=range_m,
        uncertainty_m=np.linspace(0.0, 0.02, pixels),
        earliest_m=range_m - 0.1,
        latest_m=range_m + 0.1,
        delay_s=2 * range_m[None] / SPEED_OF_LIGHT_M_S,
        share=np.ones((1, pixels)),
        base_frequency_hz=HZ,
        measured=turn ** np.arange(LOOKED + 1)[:, None],
        relative_noise=np.full(pixels, 0.01),
        lit_share=0.5,
        dim_share=0.125,
        moving_share=0.25,
        ambiguity_checked=False,
    )


def test_a_uniform_scene_has_the_light_and_returns_it_is_given() -> None:
    scene = uniform_scene(8e5, [(3.0, 1.0), (2.0, 3.0), (9.0, 0.0)], ambient_dn_per_s=2e5)

    assert len(scene.direct_m) == FEW_PIXELS == 128
    assert scene.direct_m == pytest.approx(2.0)
    assert scene.earliest_m == pytest.approx(2.0)
    assert scene.latest_m == pytest.approx(2.0)
    assert scene.share[:, 7] == pytest.approx([0.25, 0.75, 0.0])
    assert scene.delay_s[:, 7] == pytest.approx([delay_s(3.0), delay_s(2.0), delay_s(9.0)])
    assert scene.brightness_dn_per_s == pytest.approx(8e5)
    assert scene.ambient_dn_per_s == pytest.approx(2e5)
    assert scene.brightest_dn_per_s == 1e6
    assert not scene.uncertainty_m.any()


def test_moments_of_a_scene_are_sums_over_its_returns() -> None:
    scene = uniform_scene(1.0, [(2.0, 0.75), (3.5, 0.25)])

    found = scene.relative_moments(3, HZ)

    for j in range(4):
        phase = [2 * np.pi * j * HZ * delay_s(each) for each in (2.0, 3.5)]
        expected = 0.75 * np.exp(1j * phase[0]) + 0.25 * np.exp(1j * phase[1])
        assert found[j] == pytest.approx(np.full(FEW_PIXELS, expected), abs=1e-6)


def test_light_that_no_return_explains_comes_evenly_at_all_times() -> None:
    scene = uniform_scene(1.0, [(2.0, 1.0)])
    dim = dataclasses.replace(scene, share=0.4 * np.asarray(scene.share))

    assert dim.relative_moments(2, HZ)[0] == pytest.approx(1.0)
    assert np.abs(dim.relative_moments(2, HZ)[1:]) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("harmonics", "base_hz", "covered"),
    [
        (5, HZ, True),
        (6, HZ, False),
        (2, 2 * HZ, True),
        (3, 2 * HZ, False),
        (1, 5 * HZ, True),
        (1, 6 * HZ, False),
        (1, HZ * (1 + 5e-7), True),
        (1, HZ * (1 + 2e-6), False),
        (1, 1.5 * HZ, False),
        (1, 0.5 * HZ, False),
        (1, 0.1 * HZ, False),
    ],
)
def test_a_look_covers_multiples_of_its_frequency_up_to_its_highest(
    harmonics: int, base_hz: float, *, covered: bool
) -> None:
    scene = measured()

    assert scene.covers(harmonics, base_hz) == covered
    # where it does not, a model of the returns has to do: here an exact one
    expected = np.exp(2j * np.pi * base_hz * np.arange(harmonics + 1)[:, None] * scene.delay_s)
    assert scene.relative_moments(harmonics, base_hz) == pytest.approx(expected, abs=1e-4)


def test_what_is_measured_goes_before_a_model() -> None:
    scene = dataclasses.replace(measured(), share=np.zeros((1, PIXELS)))

    assert np.abs(scene.relative_moments(2, 2 * HZ)) == pytest.approx(1.0)
    assert not scene.relative_moments(6, HZ)[1:].any()
    assert uniform_scene(1.0, [(2.0, 1.0)]).covers(99, 0.37 * HZ)


@pytest.mark.parametrize(
    ("far", "late", "ambiguous"),
    [(0, 0, False), (2, 0, False), (3, 0, True), (0, 5, False), (0, 6, True), (2, 5, False)],
)
def test_few_pixels_may_lie_beyond_the_unambiguous_range(
    far: int, late: int, *, ambiguous: bool
) -> None:
    """Of a hundred, two of the direct returns, or five of those that may be taken for it."""
    direct_m, delays_s = np.full(100, 2.0), np.full((2, 100), np.nan)
    delays_s[0], share = delay_s(2.0), np.zeros((2, 100))
    share[0] = 1.0
    direct_m[:far] = 5.0
    delays_s[1, 50 : 50 + late], share[1, 50 : 50 + late] = delay_s(5.0) * (1 + 1e-9), 0.9
    still = dataclasses.replace(measured(100), moving_share=0.0)
    scene = dataclasses.replace(still, direct_m=direct_m, delay_s=delays_s, share=share)

    assert scene.ambiguous(5.0) == ambiguous
    assert not scene.ambiguous(5.001)
    weak = dataclasses.replace(scene, share=np.where(share == 0.9, 1e-3, share))
    assert weak.ambiguous(5.0) == (far > 2)


def test_a_pixel_without_returns_is_nowhere() -> None:
    scene = dataclasses.replace(
        measured(100), delay_s=np.full((1, 100), np.nan), share=np.zeros((1, 100))
    )

    assert not scene.ambiguous(6.0)
    assert scene.ambiguous(1e-3)


def test_few_pixels_are_one_of_eight_in_all_that_is_known_of_them() -> None:
    scene = measured()
    few = scene.few()

    assert few.direct_m.size == 128
    assert few.few() is few
    place = np.searchsorted(scene.direct_m, few.direct_m)
    assert place // 8 == pytest.approx(np.arange(128))
    assert few.measured is not None
    assert scene.measured is not None
    assert few.measured == pytest.approx(scene.measured[:, place])
    assert few.delay_s == pytest.approx(scene.delay_s[:, place])
    assert few.brightness_dn_per_s == pytest.approx(place + 1e5)
    assert (few.brightest_dn_per_s, few.lit_share) == (3e5, 0.5)


def test_a_scene_is_stated_by_its_median_pixel() -> None:
    scene = measured(101)

    assert scene.to_document() == {
        "range_m": pytest.approx(3.0),
        "brightness_dn_per_s": 1e5 + 50,
        "ambient_dn_per_s": 2e5 + 50,
        "lit_share": 0.5,
        "dim_share": 0.125,
        "moving_share": 0.25,
        "ambiguity_checked": False,
        "calibrated": True,
        "uncalibrated_m": 0.0,
        "lost_share": 0.0,
        "drift_m": 0.0,
        "of_one_frame": False,
    }
    assert scene.disagreement_m == pytest.approx(0.01)


@pytest.mark.parametrize(("share", "in_part"), [(0.0, False), (0.249, False), (0.25, True)])
def test_a_quarter_of_dim_pixels_makes_all_ranges_uncertain(share: float, *, in_part: bool) -> None:
    assert dataclasses.replace(measured(100), dim_share=share).lit_in_part == in_part


def test_contrast_is_told_between_the_frequencies_of_a_look() -> None:
    scene = dataclasses.replace(measured(100), contrast=(1.0, 1.0, 0.5, 0.25))

    assert scene.contrast_at(2, HZ) == pytest.approx([1.0, 1.0, 0.5])
    assert scene.contrast_at(2, 1.5 * HZ) == pytest.approx([1.0, 0.75, 0.25])
    assert measured(100).contrast_at(2, HZ) == pytest.approx([1.0, 1.0, 1.0])

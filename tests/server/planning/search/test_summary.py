"""Plans and fronts in words."""

import dataclasses

import numpy as np
import pytest

from tests.server.planning.search.choices import choice
from transientcam_driver import Capabilities
from transientcam_server.planning import SceneStatistics, uniform_scene
from transientcam_server.planning._search.words import summary, summary_of_front

SCENE = uniform_scene(1e6, [(2.0, 1.0)])


def doubtful(*, dim_share: float = 0.0, apart_m: float = 0.0) -> SceneStatistics:
    return dataclasses.replace(
        SCENE, dim_share=dim_share, uncertainty_m=np.full_like(SCENE.direct_m, apart_m)
    )


def test_what_half_the_error_costs_is_stated_with_noise_and_bias(
    capabilities: Capabilities,
) -> None:
    best = choice(capabilities, std_m=3e-3, bias_m=4e-3, capture_s=0.1)
    twice = choice(capabilities, std_m=1.5e-3, bias_m=2e-3, capture_s=0.25, harmonics=6)

    assert summary(best, twice, SCENE) == (
        "3 mm noise, 4 mm off: m = 6 at 20 MHz, 1 ms, likelihood takes 2.5 x as long for 2.5 mm."
    )


def test_the_error_of_a_share_is_stated_beside_noise_and_bias_of_the_median_pixel(
    capabilities: Capabilities,
) -> None:
    best, twice = (
        dataclasses.replace(
            choice(capabilities, std_m=of, bias_m=of, capture_s=2e-4 / of, within_m=4 * of),
            share=0.9,
        )
        for of in (2e-3, 1e-3)
    )

    words = summary(best, twice, SCENE)

    assert words.startswith("8 mm for 90% of the pixels, the median one with 2 mm noise, 2 mm off:")
    assert words.endswith(" takes 2 x as long for 4 mm for 90% of the pixels.")
    assert "the best is 4 mm for 90% of the pixels in" in summary_of_front([best, twice], SCENE)


@pytest.mark.parametrize(
    ("std_m", "bias_m", "hint"),
    [
        (3e-3, 4e-3, "more frequencies or another estimator"),
        (4e-3, 3e-3, "a longer capture"),
        (4e-3, 4e-3, "a longer capture"),
    ],
)
def test_where_nothing_halves_the_error_what_would_come_nearest_is_named(
    std_m: float, bias_m: float, hint: str, capabilities: Capabilities
) -> None:
    words = summary(choice(capabilities, std_m=std_m, bias_m=bias_m), None, SCENE)

    assert words.endswith(f"capture halves the error, not even {hint}.")


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (doubtful(), "put the range 8 mm off."),
        # a quarter of the error, which is 5 mm
        (doubtful(apart_m=1.25e-3), "put the range 8 mm off."),
        (doubtful(apart_m=1.26e-3), "direct from later light differ by 1.26 mm"),
        (doubtful(apart_m=0.999), "differ by 999 mm"),
        (doubtful(dim_share=0.25, apart_m=1.0), "25% of the lit pixels are so dim"),
        (doubtful(dim_share=0.24, apart_m=1.0), "differ by 1000 mm"),
    ],
)
def test_a_doubt_is_stated_by_its_gravest_reason(
    scene: SceneStatistics, reason: str, capabilities: Capabilities
) -> None:
    known = choice(capabilities, std_m=3e-3, bias_m=4e-3)
    unknown = choice(capabilities, std_m=3e-3, bias_m=4e-3, bias_known=False)

    for words in (
        summary(unknown, None, scene),
        summary(unknown, known, scene),
        summary_of_front([known, unknown], scene),
    ):
        assert ". Bias unknown: " in words
        assert reason in words
    assert "unknown" not in summary(known, known, scene)
    assert "unknown" not in summary_of_front([unknown, known], scene)


def test_a_front_is_flat_from_where_bias_rules(capabilities: Capabilities) -> None:
    noisy = choice(capabilities, std_m=9e-3, bias_m=1e-3, capture_s=0.05)
    enough = choice(capabilities, std_m=2e-3, bias_m=3e-3, capture_s=0.5)
    last = choice(capabilities, std_m=1e-3, bias_m=2.5e-3, capture_s=2.5, takes=4)

    assert summary_of_front([noisy, enough, last], SCENE) == (
        "From 500 ms on bias rules and more time buys little; the best is 2.69 mm in 2.5 s "
        "(m = 3 at 20 MHz, 1 ms x 4, likelihood)."
    )
    assert summary_of_front([noisy], SCENE).startswith(
        "Noise rules everywhere: more time buys accuracy; the best is 9.06 mm in 50 ms "
    )
    assert summary_of_front([], SCENE) == "Nothing reaches any accuracy on this scene."


@pytest.mark.parametrize(
    ("time_s", "words"), [(1.0, "1 s"), (1.234, "1.23 s"), (0.999, "999 ms"), (0.0123, "12.3 ms")]
)
def test_times_are_in_seconds_from_one_on(
    time_s: float, words: str, capabilities: Capabilities
) -> None:
    one = choice(capabilities, capture_s=time_s)

    assert f" mm in {words} (" in summary_of_front([one], SCENE)

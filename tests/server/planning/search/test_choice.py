"""Choices: their errors by target, their cost and their words."""

import math
from dataclasses import replace

import pytest

from tests.server.planning.search.choices import choice
from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning._search.search import in_words


def test_each_target_limits_its_own_error(capabilities: Capabilities) -> None:
    one = choice(capabilities, std_m=3e-3, bias_m=4e-3, bound_width=1.5, separation_share=0.75)

    assert one.error("range_error_m") == pytest.approx(5e-3)
    assert one.error("range_std_m") == 3e-3
    assert one.error("bound_width") == one.error_with_margin("bound_width") == 1.5
    assert one.error("separation_m") == one.error_with_margin("separation_m") == 0.25
    assert one.error_with_margin("range_error_m") == pytest.approx(1.25 * 5e-3)
    assert one.error_with_margin("range_std_m") == pytest.approx(1.25 * 3e-3)


def test_what_was_not_predicted_reaches_no_target(capabilities: Capabilities) -> None:
    one = choice(capabilities)

    assert one.error("bound_width") == math.inf
    assert one.error("separation_m") == 1.0


def test_relative_errors_are_the_worst_over_all_targets(capabilities: Capabilities) -> None:
    one = choice(capabilities, std_m=3e-3, bias_m=4e-3, bound_width=1.5)

    assert one.relative_errors({"range_error_m": 10e-3, "range_std_m": 4e-3}) == pytest.approx(
        (0.75, 1.25 * 0.75)
    )
    assert one.relative_errors({"range_std_m": 4e-3, "bound_width": 1.0}) == (1.5, 1.5)
    assert one.relative_errors({}) == (0.0, 0.0)
    # half of what a perfect choice leaves, and what no other one reaches
    perfect = replace(one, separation_share=1.0)
    assert perfect.relative_errors({"separation_m": 0.0}) == (0.0, 0.0)
    assert min(replace(one, separation_share=0.9).relative_errors({"separation_m": 0.0})) > 1e9


def test_computing_takes_its_share_of_the_time_between_frames(capabilities: Capabilities) -> None:
    assert choice(capabilities, capture_s=0.25, reconstruct_s=0.1).computing_share == 0.4
    assert choice(capabilities, reconstruct_s=None).computing_share is None


def test_the_items_of_a_capture_add_up_to_it(capabilities: Capabilities) -> None:
    one = choice(capabilities, takes=5, reconstruct_s=0.25)
    applied, items = one.applied, one.price

    assert items["light_s"] == pytest.approx(applied.images * 1e-3)
    assert items["readout_s"] == pytest.approx(
        applied.images * capabilities.streaming_readout_s - one.settling_s
    )
    assert items["sum_s"] == applied.capture_s + 0.25
    assert items["light_share"] == pytest.approx(applied.images * 1e-3 / applied.capture_s)
    assert items["data_bytes"] == applied.images * (capabilities.image_bytes + 64)
    assert choice(capabilities, reconstruct_s=None).price["computing_s"] is None


def test_a_choice_is_stated_in_words() -> None:
    one = Sequence(base_frequency_hz=11.5e6, harmonics=3, exposure_s=1.2345e-3)

    assert in_words(one, "likelihood") == "m = 3 at 11.5 MHz, 1.23 ms, likelihood"
    several = Sequence(base_frequency_hz=20e6, harmonics=1, exposure_s=2e-3, takes=2)
    assert in_words(several, "pisarenko") == "m = 1 at 20 MHz, 2 ms x 2, pisarenko"


def test_the_document_has_all_of_it(capabilities: Capabilities) -> None:
    one = choice(capabilities, capture_s=0.25, reconstruct_s=0.1, separation_share=0.5)

    document = one.to_document()

    assert document["sequence"] == one.applied.sequence.to_document()
    assert document["applied"] == {
        key: value for key, value in one.applied.to_document().items() if key != "sequence_id"
    }
    assert (document["capture_s"], document["frame_rate_hz"]) == (0.25, 4.0)
    assert (document["reconstruct_s"], document["computing_share"]) == (0.1, 0.4)
    predicted = document["predicted"]
    assert predicted["range_std_m"] == pytest.approx(
        {"median": 3e-3, "low": 1.5e-3, "high": 6e-3, "p90": 9e-3}
    )
    assert (predicted["range_bias_m"], predicted["range_bias_most_m"]) == (4e-3, 8e-3)
    assert (predicted["bias_known"], predicted["beyond_scene"]) == (True, False)
    assert (predicted["bound_width"], predicted["separation_share"]) == (None, 0.5)
    assert predicted["within"] is None
    shares = [predicted["beyond"][each] for each in ("0.02", "0.05", "0.2")]
    assert shares == pytest.approx([0.8, 0.5, 0.0])


def test_a_share_of_the_pixels_is_what_a_target_is_held_against(capabilities: Capabilities) -> None:
    one = choice(capabilities, std_m=3e-3, bias_m=4e-3, within_m=9e-3)

    assert one.error("range_error_m") == 9e-3
    assert one.error_with_margin("range_error_m") == pytest.approx(1.25 * 9e-3)
    assert one.error("range_std_m") == 3e-3
    assert one.to_document()["predicted"]["within"] == pytest.approx(
        {
            "share": 0.75,
            "error_m": 9e-3,
            "low": 4.5e-3,
            "high": 18e-3,
            "target_m": 0.08,
            "target_share": 0.8,
        }
    )

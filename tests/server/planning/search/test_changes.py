"""What better cameras would give: planned anew, and held against trying all."""

from typing import cast

import pytest

from tests.server.planning.closed_form import ClosedForm, planned
from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning import Goal
from transientcam_server.planning._search.families import EXPOSURES, TAKES
from transientcam_server.planning._search.plan import Plan

LONGEST_S = 0.9 * 0.004


def quickest_s(plan: Plan, light: float, readout_s: float) -> float:
    """Time of the quickest sequence of the same frequencies, of all exposures and takes."""
    model, best = ClosedForm(light=light), plan.recommended
    sequence = best.applied.sequence
    target_m = cast(float, plan.goal.range_error_m)
    longest_s = LONGEST_S / light
    times_s: list[float] = []
    for k in range(EXPOSURES):
        exposure_s = 2e-4 * (longest_s / 2e-4) ** (k / (EXPOSURES - 1))
        for takes in TAKES:
            wanted = Sequence(
                sequence.base_frequency_hz, sequence.harmonics, "estimated", exposure_s, takes
            )
            if model.predict(best.estimator, wanted).range_error.with_margin <= target_m:
                times_s.append(wanted.images * (exposure_s + readout_s))
    return min(times_s)


@pytest.mark.parametrize("target_m", [0.02, 0.008, 0.004])
def test_twice_the_light_and_half_the_read_out_save_what_trying_all_finds(
    target_m: float, capabilities: Capabilities
) -> None:
    plan = planned(Goal(range_error_m=target_m), capabilities)

    found = {each.what: each for each in plan.changes}

    readout_s, now_s = capabilities.streaming_readout_s, plan.recommended.applied.capture_s
    for what, light, of_image_s in (("light", 2.0, readout_s), ("readout", 1.0, readout_s / 2)):
        expected_s = quickest_s(plan, light, of_image_s)
        assert found[what].capture_s == pytest.approx(expected_s, rel=1e-3)
        assert found[what].time_factor == pytest.approx(now_s / expected_s, rel=1e-3)
    factors = [each.time_factor for each in plan.changes]
    assert factors == sorted(factors, reverse=True)


def test_the_sentence_names_the_largest_item_and_what_each_change_gives(
    capabilities: Capabilities,
) -> None:
    quick = planned(Goal(range_error_m=0.02), capabilities).to_document()
    price, best = quick["price"], quick["changes"][0]
    assert best["what"] == "readout"
    assert quick["price_summary"].startswith(
        f"{price['readout_s'] / quick['capture_s']:.0%} of the capture is read-out: a read-out "
        f"twice as fast gives {best['time_factor']:.2g} x; twice the light gives "
    )
    by_time = planned(Goal(capture_s=0.2), capabilities)
    assert all(each.error_factor >= 1 for each in by_time.changes)
    assert "x the accuracy" in by_time.to_document()["price_summary"]

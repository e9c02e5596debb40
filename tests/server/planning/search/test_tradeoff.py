"""The front of all that no other beats, and the lines that its choices lie on."""

import math
from typing import cast

from tests.server.planning.closed_form import ClosedForm
from transientcam_driver import Capabilities
from transientcam_server.planning import Goal, Progress
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._search.candidates import curves
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.tradeoff import fronts, lines


def test_lines_fall_onto_the_bias(capabilities: Capabilities) -> None:
    predictor = cast(Predictor, ClosedForm())
    goal = Goal()
    found = families(goal, predictor, capabilities)
    candidates = curves(found, goal, predictor, lambda *_: 1e-3)

    shares: list[float] = []
    progress = Progress(lambda share, step: shares.append(share))
    *so_far, front = fronts(candidates, "range_error_m", progress)
    ends = front[0].applied.capture_s, front[-1].applied.capture_s
    for part in so_far[1:]:
        times_s = [choice.applied.capture_s for choice in part]
        assert times_s == sorted(times_s)
        assert (times_s[0], times_s[-1]) == ends, "both ends first, then what is between"
    assert [len(part) for part in so_far] == sorted(len(part) for part in so_far)

    assert shares == sorted(set(shares))
    assert (shares[0], len(shares)) == (0.0, 12)

    times_s = [choice.applied.capture_s for choice in front]
    assert len(front) > 3
    assert times_s == sorted(times_s)
    for line in lines(candidates, front):
        points = line["points"]
        noise_m = [point["range_std_m"] for point in points]
        assert noise_m == sorted(noise_m, reverse=True)
        assert len({point["range_bias_m"] for point in points}) == 1
        assert all(
            point["range_error_m"] == math.hypot(point["range_std_m"], point["range_bias_m"])
            for point in points
        )

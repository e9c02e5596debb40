"""A result as a measurement would write it."""

from transientcam_driver import Sequence
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff import capture


def record(number: int) -> tradeoff.Record:
    point = Sequence(harmonics=number).to_document()
    values = dict.fromkeys(capture.QUANTITIES, 0.5 / number)
    values["capture_s"] = 0.1 * number
    return tradeoff.Record("capture", "mirrors", point, {"seed": 1}, dict(values), dict(values))

"""A predictor of formulas, and brute force over all that it predicts."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import cast

import numpy as np

from transientcam_driver import Capabilities, Sequence, SequenceError
from transientcam_server.planning import Goal, Plan, uniform_scene
from transientcam_server.planning._prediction.measures import Figure
from transientcam_server.planning._prediction.prediction import Prediction, Predictor, Settings
from transientcam_server.planning._search.families import (
    EXPOSURES,
    HARMONICS,
    TAKES,
    Family,
    Member,
    families,
)
from transientcam_server.planning._search.plan import plan

SPREAD = 1.1
MARGIN = 1.05


class ClosedForm:
    """A predictor whose answers are formulas: noise by the light, bias by frequency and m."""

    def __init__(self, *, far_m: float = 2.0, light: float = 1.0) -> None:
        self.scene = uniform_scene(1e6, [(far_m, 1.0)])
        self.light = light
        self.longest_exposure_s = 0.004 / light

    def noise_scale(self, sequence: Sequence) -> float:
        return float(np.sqrt(1e-3 / (self.light * sequence.exposure_s * sequence.takes)))

    def least_noise_m(self, estimator: str, sequence: Sequence, scale: float) -> float:
        m = 1 if estimator == "single-frequency" else sequence.harmonics
        return float(1e-2 * scale / m**1.5 / (sequence.base_frequency_hz / 23e6))

    def least_bias_m(self, estimator: str, sequence: Sequence) -> float:
        m = 1 if estimator == "single-frequency" else sequence.harmonics
        worse = {"single-frequency": 1.0, "maximum-entropy": 0.6, "likelihood": 0.5}.get(
            estimator, 0.7
        )
        return 0.05 * worse / (m * sequence.base_frequency_hz / 23e6) ** 2

    def bounds(
        self, estimator: str, sequence: Sequence, settings: Settings, *, biased: bool
    ) -> tuple[list[float], list[float], float]:
        pairs = zip(*settings, strict=True)
        each = [replace(sequence, exposure_s=exposure_s, takes=k) for exposure_s, k in pairs]
        scales = [self.noise_scale(one) for one in each]
        noise_m = [self.least_noise_m(estimator, sequence, scale) for scale in scales]
        return scales, noise_m, self.least_bias_m(estimator, sequence) if biased else 0.0

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m = self.least_noise_m(estimator, sequence, scale)
        bias_m = self.least_bias_m(estimator, sequence)
        return std_m, bias_m, math.hypot(std_m, bias_m)

    def predict(
        self, estimator: str, sequence: Sequence, *, closely: bool = False, capture_s: float = 0.0
    ) -> Prediction:
        each = self.quick(estimator, sequence, self.noise_scale(sequence))
        std, error = (
            Figure(value, value / SPREAD, value * SPREAD, 2 * value, value * MARGIN)
            for value in (each[0], each[2])
        )
        return Prediction(std, error, each[1], each[1], bias_known=True)

    def beyond_scene(self, sequence: Sequence) -> bool:
        return False

    def bound_width(self, sequence: Sequence) -> float:
        return 6.0 / (sequence.harmonics + 1) + (0.5 if sequence.zeroth == "estimated" else 0.0)

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        return 1.0 - float(0.5 ** (sequence.harmonics * distance_m))


def planned(goal: Goal, capabilities: Capabilities) -> Plan:
    present, brighter = (cast(Predictor, ClosedForm(light=light)) for light in (1.0, 2.0))
    readout_s = capabilities.streaming_readout_s / 2
    faster = replace(capabilities, streaming_readout_s=readout_s)
    better = {"readout": (present, faster), "light": (brighter, capabilities)}
    return plan(goal, present, capabilities, timed=lambda *_: 1e-3, better=better)


def sequence_of(family: Family, member: Member) -> Sequence:
    return replace(family.first, exposure_s=member.exposure_s, takes=member.takes)


@lru_cache(maxsize=1)
def everything(capabilities: Capabilities) -> list[tuple[float, float]]:
    """Time and error, with margin, of all the grid, one by one: brute force."""
    found = []
    model = ClosedForm()
    exposures_s = np.geomspace(2e-4, 0.9 * 0.004, EXPOSURES)
    for factor in (0.5, 1.0, 2.0, 3.0):
        for m in HARMONICS:
            for estimator in ("single-frequency", "maximum-entropy", "likelihood"):
                if (m == 1) != (estimator == "single-frequency"):
                    continue
                for exposure_s in exposures_s:
                    for takes in TAKES:
                        wanted = Sequence(
                            factor * 23e6, m, "estimated", round(exposure_s, 9), takes
                        )
                        try:
                            applied = capabilities.apply(wanted)
                        except SequenceError:
                            continue
                        figure = model.predict(estimator, applied.sequence).range_error
                        found.append((applied.capture_s, figure.with_margin))
    return found


def quickest_s(goal: Goal, predictor: ClosedForm, capabilities: Capabilities) -> float:
    """Time of the quickest that reaches a target, by trying all."""
    like = cast(Predictor, predictor)
    assert goal.range_error_m is not None
    return min(
        member.capture_s
        for family in families(goal, like, capabilities)
        for member in family.members
        if like.predict(
            family.estimator, capabilities.apply(sequence_of(family, member)).sequence
        ).range_error.with_margin
        <= goal.range_error_m
    )

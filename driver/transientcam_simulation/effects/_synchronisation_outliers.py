"""Synchronisation outliers: light and sensor lose synchronisation during some exposures."""

import math

import numpy as np

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import Shot, ShotEffect


class SynchronisationOutliers(ShotEffect):
    """A share of the images has, for some part of the exposure, a random phase.

    The paper reports 5 to 10 % of all images (Sec. 6). Which ones depends on the seed and the
    image's number only, and on no other effect.
    """

    name = "outliers"
    what = "images that lose their synchronisation"
    figures = "outliers"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        assert conditions.device.outliers is not None  # noqa: S101  (else it is not built)
        self._share = conditions.device.outliers.share

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device has any."""
        outliers = conditions.device.outliers
        if outliers is None or not outliers.share:
            return Call(False, "the device never loses its synchronisation", 0.0, 0.0)
        # a random phase for a part uniform in [0.2, 1]: E part^2 = 0.41; two images a component
        error = math.sqrt(outliers.share * 2 * 0.41 * 2) / 2
        changes = conditions.of_light(error * abs(conditions.sub_phase_gain(1)))
        return weigh(conditions, changes, f"{outliers.share:.0%} of the images", 1e-5)

    def on_shot(self, shot: Shot) -> None:
        """Give a share of the images a random phase."""
        random = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence((shot.seed, shot.number, 0x0071)))
        )
        if random.random() < self._share:
            part = random.uniform(0.2, 1.0)
            shot.factor *= (1 - part) + part * complex(np.exp(2j * np.pi * random.random()))

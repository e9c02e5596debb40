"""How images become moments and moments become returns, at present."""

from dataclasses import dataclass
from typing import Any

from transientcam_driver import AppliedSequence
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.calibration import Calibration
from transientcam_server.imaging.lens import ASSUMED_FIELD_OF_VIEW_DEG, Intrinsics
from transientcam_server.settings import ReconstructionSettings


@dataclass(frozen=True, slots=True)
class Reconstruction:
    """Settings in use, and the number that frames computed with them carry.

    Attributes
    ----------
    id
        Counts the settings from 1, those the service started with.
    """

    id: int
    settings: ReconstructionSettings

    def followed_by(self, settings: ReconstructionSettings) -> "Reconstruction":
        """Return what is in use once these settings are; the same where they are no others."""
        return self if settings == self.settings else Reconstruction(self.id + 1, settings)

    def to_document(self) -> dict[str, Any]:
        """Return the settings by their names, and ``reconstruction_id``."""
        return self.settings.model_dump() | {"reconstruction_id": self.id}


def require_harmonics(settings: ReconstructionSettings, harmonics: int, *, field: str) -> None:
    """Refuse an estimator and a number of harmonics that do not go together.

    Parameters
    ----------
    field
        Which of the two was asked for: "estimator" or "harmonics".

    Raises
    ------
    Problem
        ``estimator-misfit``.
    """
    least = settings.least_harmonics
    if harmonics >= least:
        return
    raise Problem(
        kinds.ESTIMATOR_MISFIT,
        f"The estimator {settings.estimator} needs {least} harmonics, and there are {harmonics}.",
        field=field,
        value=harmonics if field == "harmonics" else settings.estimator,
        limit=f"at least {least}"
        if field == "harmonics"
        else f"one that does with {harmonics} harmonics",
    )


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a computation may know beside the results it needs.

    ``full_scale`` is the largest value that the sensor gives, in DN. Without a ``calibration``,
    gains are the nominal ones. ``reconstruction_id`` counts the settings there were. Without
    ``intrinsics`` a usual field of view is assumed.
    """

    applied: AppliedSequence
    settings: ReconstructionSettings
    full_scale: float
    calibration: Calibration | None = None
    reconstruction_id: int = 1
    intrinsics: Intrinsics | None = None

    def lens(self, height: int, width: int) -> Intrinsics:
        """Return where the pixels look, as it is known or else assumed."""
        if self.intrinsics is not None:
            return self.intrinsics
        return Intrinsics.of_field(ASSUMED_FIELD_OF_VIEW_DEG, width=width, height=height)

    @property
    def base_frequency_hz(self) -> float:
        """The frequency whose period is the unambiguous time of flight."""
        return self.applied.sequence.base_frequency_hz

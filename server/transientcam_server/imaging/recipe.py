"""How images become moments and moments become returns, at present."""

from dataclasses import dataclass
from typing import Any

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
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

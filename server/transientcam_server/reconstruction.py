"""How images become moments and moments become returns, at present."""

from dataclasses import dataclass
from typing import Any

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

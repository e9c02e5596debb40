"""How recorded frames are computed: with the gains that were recorded beside them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging.lens import known_intrinsics
from transientcam_server.imaging.recipe import Recipe, Reconstruction
from transientcam_server.recording.layout import Header
from transientcam_server.settings import LensSettings

if TYPE_CHECKING:
    from transientcam_server.imaging.calibration import Calibration


@dataclass(frozen=True, slots=True, eq=False)
class RecordedGains:
    """Of a calibration, a reconstruction asks no more."""

    id: str
    gains: NDArray[Any]
    bad: NDArray[np.bool_] | None


def recorded_recipe(
    header: Header, reconstruction: Reconstruction, *, lens: LensSettings | None = None
) -> Recipe:
    """Return what a reconstruction of a recording's frames has to know beside them."""
    capabilities, planes = header.capabilities, header.calibration_planes
    gains = None
    if planes is not None:
        name = str(header.calibration.get("id", "recorded"))
        gains = RecordedGains(name, planes, header.calibration_bad)
    return Recipe(
        header.applied,
        reconstruction.settings,
        2.0**capabilities.bits - 1.0,
        cast("Calibration | None", gains),
        reconstruction.id,
        known_intrinsics(
            lens or LensSettings(),
            width=capabilities.width,
            height=capabilities.height,
            recorded=header.camera.get("intrinsics"),
        ),
    )

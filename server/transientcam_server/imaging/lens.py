"""Where the rays of the pixels go: a pinhole camera's intrinsics, and where they are known from."""

import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from transientcam.robotics import Pinhole
from transientcam_server.settings import LensSettings

ASSUMED_FIELD_OF_VIEW_DEG: Final = 45.0
"""Of a camera whose lens is not known."""
Source = Literal["settings", "scene", "recording", "assumed"]


@dataclass(frozen=True, slots=True)
class Intrinsics(Pinhole):
    """A pinhole camera, and what the service computes with it.

    x points right, y down, z where the camera looks.

    Attributes
    ----------
    source
        Where they come from: the ``settings`` of the service, the simulated ``scene``, the
        ``recording``, or none of these (``assumed``).
    """

    source: Source = "assumed"

    @classmethod
    def of_field(
        cls, field_of_view_deg: float, *, width: int, height: int, source: Source = "assumed"
    ) -> Self:
        """Return those of square pixels around the axis; the field of view is horizontal."""
        focal_px = 0.5 * width / math.tan(math.radians(field_of_view_deg) / 2)
        centre = (width - 1) / 2, (height - 1) / 2
        return cls(focal_px, focal_px, *centre, width, height, source)

    @classmethod
    def of_settings(cls, settings: LensSettings, *, width: int, height: int) -> Self | None:
        """Return what the settings say, None where they say nothing."""
        if settings.fx_px is not None:
            fy_px = settings.fx_px if settings.fy_px is None else settings.fy_px
            cx_px = (width - 1) / 2 if settings.cx_px is None else settings.cx_px
            cy_px = (height - 1) / 2 if settings.cy_px is None else settings.cy_px
            return cls(settings.fx_px, fy_px, cx_px, cy_px, width, height, "settings")
        if settings.field_of_view_deg is None:
            return None
        field_deg = settings.field_of_view_deg
        return cls.of_field(field_deg, width=width, height=height, source="settings")

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Self:
        """Return the intrinsics that a recording holds.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it holds something else.
        """
        fx, fy, cx, cy = (float(document[name]) for name in ("fx", "fy", "cx", "cy"))
        if not (all(map(math.isfinite, (fx, fy, cx, cy))) and min(fx, fy) > 0.0):
            raise ValueError("focal lengths must be greater than 0")
        width, height = int(document["width"]), int(document["height"])
        return cls(fx, fy, cx, cy, width, height, "recording")

    def points(self, range_m: NDArray[Any]) -> NDArray[np.float32]:
        """Return the points (3, H, W) in m at distances (H, W) along the pixels' rays."""
        rows, columns = range_m.shape
        x = (np.arange(columns) - self.cx) / self.fx
        y = (np.arange(rows) - self.cy) / self.fy
        z = 1.0 / np.sqrt(x * x + (y * y)[:, None] + 1.0)  # of the unit vector
        points = np.empty((3, rows, columns), dtype=np.float32)
        np.multiply(range_m, z, out=points[2], casting="same_kind")
        np.multiply(points[2], x, out=points[0], casting="same_kind")
        np.multiply(points[2], y[:, None], out=points[1], casting="same_kind")
        return points


def known_intrinsics(
    settings: LensSettings,
    *,
    width: int,
    height: int,
    scene_field_deg: float | None = None,
    recorded: Mapping[str, Any] | None = None,
) -> Intrinsics:
    """Return the best that is known: settings before scene before recording before a guess."""
    given = Intrinsics.of_settings(settings, width=width, height=height)
    if given is not None:
        return given
    if scene_field_deg is not None:
        return Intrinsics.of_field(scene_field_deg, width=width, height=height, source="scene")
    if recorded is not None:
        with contextlib.suppress(KeyError, TypeError, ValueError):
            return Intrinsics.of_document(recorded)
    return Intrinsics.of_field(ASSUMED_FIELD_OF_VIEW_DEG, width=width, height=height)

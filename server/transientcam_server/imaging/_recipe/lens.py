"""Where the rays of the pixels go: a pinhole camera's intrinsics, and where they are known from."""

import contextlib
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal, Self, cast

import numpy as np
from numpy.typing import NDArray

from transientcam.documents import ExtrinsicsDocument
from transientcam.robotics import Pinhole
from transientcam_driver import Extrinsics, Lens
from transientcam_server.settings import LensSettings, dataclass_of, has_switch

ASSUMED_FIELD_OF_VIEW_DEG: Final = 45.0
"""Of a camera whose lens is not known."""
_LIGHT: Final = ("light_x_m", "light_y_m", "light_z_m")
Source = Literal["settings", "camera", "scene", "recording", "origin", "assumed"]


@dataclass(frozen=True, slots=True)
class Intrinsics(Pinhole):
    """A lens as the client has it, and what the service computes with it.

    x points right, y down, z where the camera looks. With
    a distortion the pixel looks along the ray that the lens bends there, see `Lens`.

    Attributes
    ----------
    source
        Where they come from: the ``settings`` of the service, the ``camera`` itself, the simulated
        ``scene``, the ``recording``, the ``origin`` of a relay, or none of these (``assumed``).
    light_x_m, light_y_m, light_z_m, beam
        As of `Lens`.
    """

    source: Source = "assumed"
    distortion: tuple[float, ...] = ()
    light_x_m: float = 0.0
    light_y_m: float = 0.0
    light_z_m: float = 0.0
    beam: tuple[float, ...] = ()

    @classmethod
    def of_field(
        cls, field_of_view_deg: float, *, width: int, height: int, source: Source = "assumed"
    ) -> Self:
        """Return those of square pixels around the axis; the field of view is horizontal."""
        focal_px = 0.5 * width / math.tan(math.radians(field_of_view_deg) / 2)
        centre = (width - 1) / 2, (height - 1) / 2
        return cls(focal_px, focal_px, *centre, width, height, source)

    def with_settings(self, settings: LensSettings) -> Self:
        """Return these with what the settings say in the place of what is known otherwise.

        A focal length or field of view takes the place of the whole lens, since principal point
        and distortion belong to it; a light's place that of the light alone.
        """
        known = self
        if settings.field_of_view_deg or settings.fx_px:
            field_deg = settings.field_of_view_deg or ASSUMED_FIELD_OF_VIEW_DEG
            known = self.of_field(field_deg, width=self.width, height=self.height)
            known = replace(known, source="settings", distortion=settings.distortion)
        kept = {name: getattr(self, name) for name in (*_LIGHT, "extrinsics")}
        kept |= {"beam": settings.beam or self.beam}
        given = {name: getattr(settings, f"{name}_px") for name in ("fx", "cx", "cy")}
        given |= {"fy": settings.fy_px or settings.fx_px}
        given |= {name: getattr(settings, name) for name in _LIGHT}
        return replace(known, **kept | {name: v for name, v in given.items() if v is not None})

    @classmethod
    def of_document(cls, document: Mapping[str, Any], *, source: Source = "recording") -> Self:
        """Return the intrinsics that a recording holds, or another service states.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it holds something else.
        """
        if has_switch(document):
            raise TypeError("true or false stands for a number")
        fx, fy, cx, cy = (float(document[name]) for name in ("fx", "fy", "cx", "cy"))
        distortion = tuple(float(each) for each in document.get("distortion", ()))
        x_m, y_m, z_m = (float(document.get(name, 0.0)) for name in _LIGHT)
        beam = tuple(float(each) for each in document.get("beam", ()))
        lens = Lens(fx, fy, cx, cy, distortion, x_m, y_m, z_m, beam)
        width, height = int(document["width"]), int(document["height"])
        known = cls.of_lens(lens, width=width, height=height, source=source)
        if (stated := document.get("extrinsics")) is not None:
            dataclass_of(Extrinsics, stated)
        return replace(known, extrinsics=stated)

    @classmethod
    def of_lens(cls, lens: Lens, *, width: int, height: int, source: Source) -> Self:
        """Return those of a lens."""
        pinhole = lens.fx, lens.fy, lens.cx, lens.cy
        return cls(*pinhole, width, height, source, lens.distortion, *lens.light_m, lens.beam)

    @property
    def lens(self) -> Lens:
        """The lens and where the light is, as a camera reports them."""
        light_m = self.light_x_m, self.light_y_m, self.light_z_m
        return Lens(self.fx, self.fy, self.cx, self.cy, self.distortion, *light_m, self.beam)

    def points(self, range_m: NDArray[Any]) -> NDArray[np.float32]:
        """Return the points (3, H, W) in m of a range (H, W): half of the path of the light."""
        x, y, z = _rays(self.lens, *range_m.shape)
        if any(self.lens.light_m):
            # |p| + |p - light| is the path: intersect the ray with that ellipsoid
            light_x, light_y, light_z = self.lens.light_m
            path_m = 2.0 * range_m
            along = z * (light_x * x + light_y * y + light_z)
            with np.errstate(all="ignore"):  # a path shorter than the way to the light
                around = path_m * path_m - (light_x**2 + light_y**2 + light_z**2)
                range_m = around / (2.0 * (path_m - along))
                range_m = np.where(around > 0.0, range_m, np.nan)
        points = np.empty((3, *range_m.shape), dtype=np.float32)
        np.multiply(range_m, z, out=points[2], casting="same_kind")
        np.multiply(points[2], x, out=points[0], casting="same_kind")
        np.multiply(points[2], y, out=points[1], casting="same_kind")
        return points


@lru_cache(maxsize=4)
def _rays(lens: Lens, rows: int, columns: int) -> tuple[NDArray[np.float64], ...]:
    """Return x and y (H, W) of the rays (x, y, 1), and z of their unit vectors."""
    x, y = lens.slopes(columns, rows)
    return x, y, 1.0 / np.sqrt(x * x + y * y + 1.0)


def known_intrinsics(
    settings: LensSettings,
    *,
    width: int,
    height: int,
    reported: Lens | None = None,
    mounted: Extrinsics | None = None,
    scene: Lens | None = None,
    recorded: Mapping[str, Any] | None = None,
    relayed: Mapping[str, Any] | None = None,
) -> Intrinsics:
    """Return the best that is known.

    Settings go before what the camera reports, then scene, recording or origin, then a guess.
    Where the light of a simulated camera is, and how its lens bends, its simulation knows best.
    """
    if reported is not None and scene is not None:
        pinhole = {name: getattr(reported, name) for name in ("fx", "fy", "cx", "cy")}
        reported = replace(scene, **pinhole)
    found = Intrinsics.of_field(ASSUMED_FIELD_OF_VIEW_DEG, width=width, height=height)
    if reported is not None:
        found = Intrinsics.of_lens(reported, width=width, height=height, source="camera")
    elif scene is not None:
        found = Intrinsics.of_lens(scene, width=width, height=height, source="scene")
    elif recorded is not None or relayed is not None:
        source: Source = "origin" if recorded is None else "recording"
        with contextlib.suppress(KeyError, TypeError, ValueError):
            found = Intrinsics.of_document(recorded or relayed or {}, source=source)
    if mounted is not None:
        found = replace(found, extrinsics=cast("ExtrinsicsDocument", asdict(mounted)))
    return found.with_settings(settings)

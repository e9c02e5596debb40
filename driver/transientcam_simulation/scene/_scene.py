"""What is in front of the simulated camera, and the camera itself.

The schema is described in docs/scenes.md; ``file`` reads it.
"""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Lens as RealLens, Sensor
from transientcam_simulation.base import (
    IDEAL,
    PINHOLE,
    STEADY,
    DeviceProfile,
    Lens,
    OtherLight,
    Scatter,
)
from transientcam_simulation.scene._geometry import Points, Primitive, Rectangle
from transientcam_simulation.scene._mesh import Mesh
from transientcam_simulation.scene._motion import Motion, carried, speed_m_s

Background = Literal["none", "median"]
TimeZero = Literal["start", "peak"]
Shape = Primitive | Mesh
Kind = Literal["diffuse", "translucent", "mirror", "stencil", "glass", "dust"]


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where the camera stands and looks; ``field_of_view_deg`` is horizontal, of a pinhole."""

    position_m: Points
    look_at_m: Points
    field_of_view_deg: float
    lens: Lens = PINHOLE
    motions: tuple[Motion, ...] = ()
    up: Points = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    @property
    def axes(self) -> Points:
        """Unit vectors (3, 3) to the right, downwards, and where the camera looks."""
        forward = self.look_at_m - self.position_m
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward])

    def at(self, time_s: float) -> "Viewpoint":
        """Return it where it stands and looks at a time."""
        points = np.array([self.position_m, self.look_at_m, self.position_m + self.up])
        eye_m, aim_m, above_m = carried(self.motions, time_s, self.position_m, points)
        return replace(self, position_m=eye_m, look_at_m=aim_m, up=above_m - eye_m, motions=())

    def as_lens(self, light_m: Points, *, width: int, height: int) -> RealLens:
        """Return what a camera would report of this lens, and of a light at ``light_m``."""
        focal_px = 0.5 * width / math.tan(math.radians(self.field_of_view_deg) / 2)
        k1, k2, p1, p2, k3 = self.lens.distortion
        right, down = (width * off for off in self.lens.centre)
        x, y, z = (float(axis @ (light_m - self.position_m)) for axis in self.axes)
        return RealLens(
            focal_px,
            focal_px,
            (width - 1) / 2 + right,
            (height - 1) / 2 + down,
            (k1, k2, -p1, p2, k3) if any(self.lens.distortion) else (),  # its y is up
            x,
            y,
            z,
        )


@dataclass(frozen=True, slots=True)
class Light:
    """A small light source.

    Its intensity falls off with the ``beam_exponent``-th power of the cosine to the direction it
    is aimed in. ``electrons_per_s`` is what a white surface that faces it on its axis at 1 m
    gives a pixel. What turns it does so about the camera, on which it rides.
    """

    electrons_per_s: float
    position_m: Points
    aim_at_m: Points
    beam_exponent: float
    motions: tuple[Motion, ...] = ()

    def at(self, time_s: float, camera_m: Points) -> "Light":
        """Return it at its place at a time, given where the camera stands without motion."""
        points = np.array([self.position_m, self.aim_at_m])
        position_m, aim_at_m = carried(self.motions, time_s, camera_m, points)
        return replace(self, position_m=position_m, aim_at_m=aim_at_m, motions=())


@dataclass(frozen=True, slots=True)
class Glass:
    """What makes a pane, clear from both sides, both faces of which count as one plane.

    ``reflectivity`` is that of a half mirror at any angle; None: of bare faces, by Fresnel.
    ``dust`` covers that share of it on both sides, and is white. Light is unpolarised, and what
    goes to and fro between the faces adds up without interference.
    """

    refractive_index: float = 1.5
    thickness_m: float = 0.004
    reflectivity: float | None = None
    dust: float = 0.0

    def shares(self, cosine: Points) -> tuple[Points, Points, Points]:
        """Shares that are mirrored and pass, by cosines of incidence, and m that these are late."""
        n = self.refractive_index
        within = np.sqrt(np.maximum(1 - (1 - cosine**2) / n**2, 1e-9))  # by Snell
        across = ((cosine - n * within) / (cosine + n * within)) ** 2  # of one face, by Fresnel
        along = ((n * cosine - within) / (n * cosine + within)) ** 2
        mirrored = across / (1 + across) + along / (1 + along)
        if self.reflectivity is not None:
            mirrored = np.full(cosine.shape, self.reflectivity)
        clean, later_m = 1 - self.dust, self.thickness_m * (n * within - cosine)
        return clean * mirrored, clean * (1 - mirrored), later_m


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Something that scatters, reflects, blocks or lets through light.

    ``reflectivity`` is the albedo of a diffuse or translucent surface. A pane has a ``glass``;
    its dust follows it, if it has any, as a surface of its front and one of its back. ``opaque`` is
    the mask of a stencil, rows from top to bottom as seen from its front; the other kinds have
    none. ``gloss`` is the share of light that a scattering surface reflects as a dull mirror, in a
    lobe of Blinn's model with the exponent ``gloss_exponent``.
    """

    name: str
    kind: Kind
    shape: Shape
    reflectivity: float
    opaque: NDArray[np.bool_] | None = None
    scatter: Scatter | None = None
    motions: tuple[Motion, ...] = ()
    gloss: float = 0.0
    gloss_exponent: float = 50.0
    glass: Glass | None = None

    @property
    def mirror(self) -> Rectangle:
        """The plane of a mirror, stencil or pane."""
        assert isinstance(self.shape, Rectangle)  # noqa: S101  (scene files make no others)
        return self.shape

    @property
    def primitive(self) -> Primitive:
        """The shape of what is no mesh, which can be moved and cut into patches."""
        assert not isinstance(self.shape, Mesh)  # noqa: S101  (meshes stay, and are not cut)
        return self.shape

    @property
    def scatters(self) -> bool:
        """Whether light that falls on it goes in all directions."""
        return self.kind in ("diffuse", "translucent", "dust")

    @property
    def passes(self) -> bool:
        """Whether light goes on behind it."""
        return self.kind in ("glass", "dust")

    @property
    def speed_m_s(self) -> float:
        """Highest speed of any of its points."""
        corners = self.shape.extent()
        return speed_m_s(self.motions, corners.mean(axis=0), corners)

    @property
    def turns(self) -> bool:
        """Whether it turns."""
        return any(motion.rotation_deg.any() for motion in self.motions)

    def offset_m(self, time_s: float) -> Points:
        """Return how far it has moved at a time."""
        return sum((motion.offset_m(time_s) for motion in self.motions), np.zeros(3))

    def at(self, time_s: float) -> "Surface":
        """Return it at its place at a time."""
        if not self.motions:
            return self
        shape = self.primitive.moved(self.offset_m(time_s))
        if self.turns and isinstance(shape, Rectangle):  # a sphere stays as it is
            for motion in self.motions:
                shape = shape.turned_by(motion.turn(time_s))
        return replace(self, shape=shape, motions=())


@dataclass(frozen=True, slots=True)
class Transport:
    """How far light is followed."""

    mirror_bounces: int = 2
    """Most mirrors on the way of light to a surface, and on a ray of the camera."""
    diffuse_bounces: int | None = None
    """How often light goes from surface to surface before the camera sees it; None: until what is
    left is below the noise."""
    patches: int = 24
    """Into how many patches the longest side of a surface is cut to compute that."""


@dataclass(frozen=True, slots=True)
class ResponseFile:
    """Impulse responses from a file (see ``measured.py``)."""

    path: Path
    weight: float = 1.0
    delay_s: float = 0.0
    normalise: bool = True
    background: Background = "none"
    time_zero: TimeZero = "start"
    time_zero_s: float | None = None
    time_zero_file: Path | None = None
    bin_s: float | None = None


@dataclass(frozen=True, slots=True)
class Diffuser:
    """The light shines at the sensor through a filter and a diffuser (Fig. 4).

    Every pixel gets one return of the same brightness and delay; ``fall_off`` is the share of the
    brightness that is missing in the corners of the image.
    """

    brightness: float = 1.0
    delay_s: float = 0.0
    fall_off: float = 0.0


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything in front of the camera, and the camera."""

    name: str
    description: str
    file: Path | None
    light: Light
    sensor: Sensor = field(default_factory=Sensor)
    device: DeviceProfile = IDEAL
    camera: Viewpoint | None = None
    surfaces: tuple[Surface, ...] = ()
    transport: Transport = field(default_factory=Transport)
    responses: tuple[ResponseFile, ...] = ()
    diffuser: Diffuser | None = None
    ambient_electrons_per_s: float = 0.0
    other_light: OtherLight = STEADY
    effects: dict[str, str] = field(default_factory=dict)
    seed: int = 1

    @property
    def mirror_bounces(self) -> int:
        """Mirrors that light may pass."""
        return self.transport.mirror_bounces

    @property
    def panes(self) -> tuple[tuple[Rectangle, Glass], ...]:
        """What lets light through, and where."""
        return tuple((each.mirror, each.glass) for each in self.surfaces if each.glass)

    @property
    def mirrors(self) -> tuple[Surface, ...]:
        """What mirrors light from its front: sides of a pane, which share their centre, as two."""
        fronts = [each for each in self.surfaces if each.kind in ("mirror", "glass")]
        backs = (replace(each, shape=each.mirror.turned()) for each in fronts if each.glass)
        return (*fronts, *backs)

    @property
    def moves(self) -> bool:
        """Whether anything in it moves."""
        return bool(self.carriers) or any(surface.motions for surface in self.surfaces)

    @property
    def carriers(self) -> tuple[Motion, ...]:
        """What moves the camera or the lamp, once each: all light changes if there is any."""
        of_camera = self.camera.motions if self.camera else ()
        return (*of_camera, *(each for each in self.light.motions if each not in of_camera))

    def at(self, time_s: float) -> "Scene":
        """Return the scene as it is at a time of the device."""
        surfaces = tuple(surface.at(time_s) for surface in self.surfaces)
        if self.camera is None or not self.carriers:
            return replace(self, surfaces=surfaces) if self.moves else self
        camera, light = self.camera.at(time_s), self.light.at(time_s, self.camera.position_m)
        return replace(self, surfaces=surfaces, camera=camera, light=light)

"""What robot programs are sent of one frame, independent of any format.

Conventions are those of ROS, which Foxglove shares: REP 103 (frames and units) and REP 118 (depth
images: metres along the optical axis, NaN without a return).
"""

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Self

import numpy as np
from numpy.typing import NDArray

from transientcam.documents import ExtrinsicsDocument
from transientcam.wire import Product

CAMERA_FRAME: Final = "camera_link"
"""x where the camera looks, y left, z up, in m."""
OPTICAL_FRAME: Final = "camera_optical_frame"
"""x right, y down, z where the camera looks, in m: the frame of images and points."""
DEPTH: Final = "/depth"
"""Topic of the depth image of REP 118: z of the points. Product ``range`` is along the ray."""
RECTIFIED: Final = "/depth_rect"
"""Topic of the same through the lens without its distortion, for programs that know no other."""
_ONE_SURFACE: Final = 0.02
"""By so much of it depth may change from pixel to pixel of one surface."""
_ENCODINGS: Final = {"<f4": "32FC1", "<u2": "16UC1", "|u1": "mono8"}


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A lens; without distortion pixel (c, r) looks along ((c - cx) / fx, (r - cy) / fy, 1)."""

    fx: float
    fy: float
    cx: float
    cy: float
    """``fx``, ``fy``, ``cx``, ``cy``: focal lengths and principal point in pixels; whole numbers
    are the centres of pixels."""
    width: int
    height: int
    """``width``, ``height``: of the image, in pixels."""
    source: str
    """Where they are known from; ``assumed`` is a guess of the service."""
    distortion: tuple[float, ...] = ()
    """k1, k2, p1, p2, k3 in the order of OpenCV (ROS calls it ``plumb_bob``), or empty."""
    extrinsics: ExtrinsicsDocument | None = field(default=None, hash=False, kw_only=True)
    """Where the camera is mounted; None where nobody says."""

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Self:
        """Return the intrinsics that a point cloud, or the camera's document, has."""
        names = ("fx", "fy", "cx", "cy", "width", "height", "source")
        distortion = tuple(document.get("distortion", ()))
        given = {name: document[name] for name in names}
        return cls(**given, distortion=distortion, extrinsics=document.get("extrinsics"))

    @property
    def coefficients(self) -> list[float]:
        """The five numbers of the distortion, also where there is none."""
        return [float(each) for each in self.distortion] or [0.0] * 5

    @property
    def matrix(self) -> list[float]:
        """The 3 x 3 camera matrix, row by row."""
        return [self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0]

    @property
    def projection(self) -> list[float]:
        """The 3 x 4 projection of a single camera, row by row."""
        return [self.fx, 0.0, self.cx, 0.0, 0.0, self.fy, self.cy, 0.0, 0.0, 0.0, 1.0, 0.0]

    @property
    def off_the_image(self) -> str | None:
        """What to say of a principal point that is outside the image; None of any other."""
        if 0 <= self.cx <= self.width - 1 and 0 <= self.cy <= self.height - 1:
            return None
        return (
            f"the principal point ({self.cx:g}, {self.cy:g}) is outside the image of "
            f"{self.width} x {self.height} pixels: was the lens calibrated at another resolution?"
        )

    def rectified(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a depth image (H, W) as the same lens without its distortion sees it.

        Each pixel has the depth between the four that look its way where these see one surface,
        else that of the nearest; NaN where there is none.
        """
        if not any(self.distortion):
            return depth_m
        k1, k2, p1, p2, k3 = self.distortion
        height, width = depth_m.shape
        x, y = np.meshgrid(
            (np.arange(width) - self.cx) / self.fx, (np.arange(height) - self.cy) / self.fy
        )
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        bent_x = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x)
        bent_y = y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y
        column, row = self.fx * bent_x + self.cx, self.fy * bent_y + self.cy
        nearest = np.rint(column).clip(0, width - 1), np.rint(row).clip(0, height - 1)
        seen = np.maximum(np.abs(nearest[0] - column), np.abs(nearest[1] - row)) <= 0.5
        left, top = (
            at.clip(0, size - 2).astype(np.intp)
            for at, size in ((np.floor(column), width), (np.floor(row), height))
        )
        right, below = column - left, row - top
        with np.errstate(all="ignore"):  # where nothing is seen
            # 1 / z of a plane is even in the image
            around = [1.0 / depth_m[top + k, left + j] for k in (0, 1) for j in (0, 1)]
            even = np.ptp(around, axis=0) < _ONE_SURFACE * np.max(around, axis=0)
            above = (1.0 - right) * around[0] + right * around[1]
            under = (1.0 - right) * around[2] + right * around[3]
            between = 1.0 / ((1.0 - below) * above + below * under)
        depth = depth_m[nearest[1].astype(np.intp), nearest[0].astype(np.intp)]
        return np.where(seen, np.where(even, between, depth), np.nan).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """One value a pixel, (H, W): float32, uint16 or uint8, little-endian."""

    topic: str
    values: NDArray[Any]

    @property
    def encoding(self) -> str:
        """Name of the pixels' type, as `sensor_msgs/Image` and Foxglove call it."""
        return _ENCODINGS[self.values.dtype.str]


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Points (H, W, 3 or 4), float32: x, y, z in m in `OPTICAL_FRAME`; NaN without a return.

    The fourth is the intensity: light of the first return in DN.
    """

    topic: ClassVar[str] = "/pointcloud"
    values: NDArray[np.float32]

    @property
    def fields(self) -> tuple[str, ...]:
        """Name of each value of a point."""
        return ("x", "y", "z", "intensity")[: self.values.shape[-1]]


@dataclass(frozen=True, slots=True)
class Calibration:
    """The lens."""

    topic: ClassVar[str] = "/camera_info"
    lens: Pinhole


@dataclass(frozen=True, slots=True)
class Transform:
    """How `OPTICAL_FRAME` stands in `CAMERA_FRAME`, and that where it is mounted; constant."""

    topic: ClassVar[str] = "/tf_static"
    rotation_xyzw: ClassVar[tuple[float, float, float, float]] = (-0.5, 0.5, -0.5, 0.5)
    mount: ExtrinsicsDocument | None = None

    @property
    def edges(self) -> list[tuple[str, str, dict[str, float], dict[str, float]]]:
        """Each frame, that around it, and where it is there: x, y, z in m, and the quaternion."""
        turn = dict(zip("xyzw", self.rotation_xyzw, strict=True))
        found = [(OPTICAL_FRAME, CAMERA_FRAME, dict.fromkeys("xyz", 0.0), turn)]
        if self.mount is not None:
            x, y, z, w = (0.5 * each for each in self.mount["rotation_xyzw"])
            # times the inverse of the rotation between both frames
            turned = w + x + y + z, y + z - w - x, w + z - x - y, w + y - x - z
            place = dict(zip("xyz", self.mount["translation_m"], strict=True))
            turn = dict(zip("xyzw", turned, strict=True))
            found.insert(0, (CAMERA_FRAME, self.mount["parent"], place, turn))
        return found


Message = Image | Points | Calibration | Transform


def viewable(product: Product) -> bool:
    """Return whether a product can be sent: images, raw images and points."""
    image = product.axes == ("y", "x") and product.dtype in _ENCODINGS
    return image or product.name in ("raw", "pointcloud")


def topics_of(product: str) -> dict[str, type[Message]]:
    """Return the topics that show a product (raw images excepted), and what is on each."""
    if product == "pointcloud":
        return {DEPTH: Image, RECTIFIED: Image, Points.topic: Points}
    return {f"/{product}": Image}


def products_of(topics: Iterable[str]) -> tuple[str, ...]:
    """Return the products that topics show, points last; lens and pose need none."""
    products: set[str] = set()
    for topic in topics:
        if topic == Points.topic:
            products |= {"pointcloud", "direct"}  # points are coloured by the direct light
        elif topic in (DEPTH, RECTIFIED):
            products.add("pointcloud")
        elif topic not in (Calibration.topic, Transform.topic):
            products.add(topic.removeprefix("/"))
    return tuple(sorted(products, key=lambda name: (name == "pointcloud", name)))


def messages_of(
    arrays: Mapping[str, NDArray[Any]],
    lens: Pinhole,
    *,
    intensity: NDArray[np.float32] | None = None,
    topics: Container[str] | None = None,
) -> Iterator[Message]:
    """Yield the messages of one frame, those about pose and lens first.

    Parameters
    ----------
    arrays
        The frame's products by name, each `viewable`.
    lens
        Of the frame's pixels.
    intensity
        Of the points: light of the first return (H, W) in DN; None for points without.
    topics
        Those to yield; None for all.
    """
    messages = (Transform(lens.extrinsics), Calibration(lens), *_of_products(arrays, intensity))
    for each in messages:
        if (
            isinstance(each, Image)
            and each.topic == DEPTH
            and (any(lens.distortion) if topics is None else RECTIFIED in topics)
        ):
            yield Image(RECTIFIED, lens.rectified(each.values))
        if topics is None or each.topic in topics:
            yield each


def _of_products(
    arrays: Mapping[str, NDArray[Any]], intensity: NDArray[np.float32] | None
) -> Iterator[Message]:
    for name, array in arrays.items():
        if name == "raw":
            for index, image in enumerate(array):
                yield Image(f"/raw/image_{index:03d}", image)
        elif name == "pointcloud":
            yield Image(DEPTH, array[2])
            planes = [*array] if intensity is None else [*array, intensity]
            yield Points(np.stack(planes, axis=-1))
        else:
            yield Image(f"/{name}", array)

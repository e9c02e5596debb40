"""Messages in Foxglove's schemas (protobuf); needs foxglove-sdk."""

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from foxglove import Schema
from foxglove.messages import (
    CameraCalibration,
    FrameTransform,
    FrameTransforms,
    PackedElementField,
    PackedElementFieldNumericType,
    PointCloud,
    Pose,
    Quaternion,
    RawImage,
    Timestamp,
    Vector3,
)

from transientcam.robotics._messages import (
    OPTICAL_FRAME,
    Calibration,
    Image,
    Message,
    Points,
    Transform,
)

PROTOBUF: Final = "protobuf"
_FLOAT_BYTES: Final = 4


class Encoded(NamedTuple):
    """One message as bytes, and what they mean."""

    schema: Schema
    message_encoding: str
    data: bytes


_SCHEMAS: Final[dict[type[Message], Callable[[], Schema]]] = {
    Image: RawImage.get_schema,
    Points: PointCloud.get_schema,
    Calibration: CameraCalibration.get_schema,
    Transform: FrameTransforms.get_schema,
}


def schema_of(kind: type[Message]) -> Schema:
    """Return the schema of a kind of messages."""
    return _SCHEMAS[kind]()


def encode(message: Message, time_ns: int) -> Encoded:
    """Return a message in Foxglove's schema, stamped with ``time_ns`` (Unix time)."""
    stamp = Timestamp(*divmod(time_ns, 10**9))
    found: RawImage | PointCloud | CameraCalibration | FrameTransforms
    match message:
        case Image():
            found = _image(message, stamp)
        case Points():
            found = _points(message, stamp)
        case Calibration():
            found = _calibration(message, stamp)
        case Transform():
            found = _transform(message, stamp)
    return Encoded(found.get_schema(), PROTOBUF, found.encode())


def _image(message: Image, stamp: Timestamp) -> RawImage:
    height, width = message.values.shape
    return RawImage(
        timestamp=stamp,
        frame_id=OPTICAL_FRAME,
        width=width,
        height=height,
        encoding=message.encoding,
        step=width * message.values.itemsize,
        data=message.values.tobytes(),
    )


def _points(message: Points, stamp: Timestamp) -> PointCloud:
    # viewers show a list of points; those without a return have no place in it
    points = message.values[np.isfinite(message.values[..., 2])]
    return PointCloud(
        timestamp=stamp,
        frame_id=OPTICAL_FRAME,
        pose=Pose(position=Vector3(), orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)),
        point_stride=len(message.fields) * _FLOAT_BYTES,
        fields=[
            PackedElementField(
                name=name, offset=index * _FLOAT_BYTES, type=PackedElementFieldNumericType.Float32
            )
            for index, name in enumerate(message.fields)
        ],
        data=points.tobytes(),
    )


def _calibration(message: Calibration, stamp: Timestamp) -> CameraCalibration:
    lens = message.lens
    return CameraCalibration(
        timestamp=stamp,
        frame_id=OPTICAL_FRAME,
        width=lens.width,
        height=lens.height,
        distortion_model="plumb_bob",
        D=lens.coefficients,
        K=lens.matrix,
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=lens.projection,
    )


def _transform(message: Transform, stamp: Timestamp) -> FrameTransforms:
    transforms = [
        FrameTransform(
            timestamp=stamp,
            parent_frame_id=parent,
            child_frame_id=frame,
            translation=Vector3(**place),
            rotation=Quaternion(**turn),
        )
        for frame, parent, place, turn in message.edges
    ]
    return FrameTransforms(transforms=transforms)

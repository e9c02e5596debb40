"""Messages as ROS 2 programs have them, in CDR with their definitions; needs rosbags, not ROS."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any, Final

import numpy as np
from foxglove import Schema
from rosbags.typesys import Stores, get_typestore

from transientcam.robotics import (
    OPTICAL_FRAME,
    Calibration,
    Encoded,
    Image,
    Message,
    Points,
    Transform,
)

_STORE: Final = get_typestore(Stores.ROS2_HUMBLE)
"""Its definitions of these messages are those of every distribution since: their hashes agree."""
_FLOAT32: Final = 7
"""`sensor_msgs/PointField.FLOAT32`."""
_FLOAT_BYTES: Final = 4
_UNSPECIFIED: Final = {"sec": 0, "nsec": 0}
_LATCHED: Final = {
    "history": 1,  # keep last
    "depth": 1,
    "reliability": 1,  # reliable
    "durability": 1,  # transient local: also for those who come later
    "deadline": _UNSPECIFIED,
    "lifespan": _UNSPECIFIED,
    "liveliness": 1,  # automatic
    "liveliness_lease_duration": _UNSPECIFIED,
    "avoid_ros_namespace_conventions": False,
}


def quality_of_service(message: Message) -> dict[str, str]:
    """Return the metadata of a topic by which a player offers it; empty for the usual one.

    Static transforms are latched, or their listeners do not get them (tf2_ros). The text is YAML.
    """
    if isinstance(message, Transform):
        return {"offered_qos_profiles": json.dumps([_LATCHED])}
    return {}


def encode(message: Message, time_ns: int) -> Encoded:
    """Return a message in CDR, stamped with ``time_ns`` (Unix time)."""
    found = _MAKERS[type(message)](message, time_ns)
    name = found.__msgtype__
    return Encoded(_schema(name), "cdr", bytes(_STORE.serialize_cdr(found, name)))


@cache
def _schema(name: str) -> Schema:
    definition, _ = _STORE.generate_msgdef(name, ros_version=2)
    return Schema(name=name, encoding="ros2msg", data=definition.encode())


def _made(name: str, /, **fields: Any) -> Any:
    return _STORE.types[name](**fields)


def _header(time_ns: int, frame: str) -> Any:
    seconds, nanoseconds = divmod(time_ns, 10**9)
    stamp = _made("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return _made("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _image(message: Image, time_ns: int) -> Any:
    height, width = message.values.shape
    return _made(
        "sensor_msgs/msg/Image",
        header=_header(time_ns, OPTICAL_FRAME),
        height=height,
        width=width,
        encoding=message.encoding,
        is_bigendian=0,
        step=width * message.values.itemsize,
        data=np.frombuffer(message.values.tobytes(), np.uint8),
    )


def _points(message: Points, time_ns: int) -> Any:
    height, width, values = message.values.shape
    fields = [
        _made(
            "sensor_msgs/msg/PointField",
            name=name,
            offset=index * _FLOAT_BYTES,
            datatype=_FLOAT32,
            count=1,
        )
        for index, name in enumerate(message.fields)
    ]
    return _made(
        "sensor_msgs/msg/PointCloud2",
        header=_header(time_ns, OPTICAL_FRAME),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=False,
        point_step=values * _FLOAT_BYTES,
        row_step=width * values * _FLOAT_BYTES,
        data=np.frombuffer(message.values.tobytes(), np.uint8),
        is_dense=False,  # pixels without a return are NaN
    )


def _calibration(message: Calibration, time_ns: int) -> Any:
    lens = message.lens
    whole = _made(
        "sensor_msgs/msg/RegionOfInterest",
        x_offset=0,
        y_offset=0,
        height=0,  # 0: all of the image
        width=0,
        do_rectify=False,
    )
    return _made(
        "sensor_msgs/msg/CameraInfo",
        header=_header(time_ns, OPTICAL_FRAME),
        height=lens.height,
        width=lens.width,
        distortion_model="plumb_bob",
        d=np.array(lens.coefficients),
        k=np.asarray(lens.matrix),
        r=np.eye(3).ravel(),
        p=np.asarray(lens.projection),
        binning_x=0,
        binning_y=0,
        roi=whole,
    )


def _transform(message: Transform, time_ns: int) -> Any:
    stamped = [
        _made(
            "geometry_msgs/msg/TransformStamped",
            header=_header(time_ns, parent),
            child_frame_id=frame,
            transform=_made(
                "geometry_msgs/msg/Transform",
                translation=_made("geometry_msgs/msg/Vector3", **place),
                rotation=_made("geometry_msgs/msg/Quaternion", **turn),
            ),
        )
        for frame, parent, place, turn in message.edges
    ]
    return _made("tf2_msgs/msg/TFMessage", transforms=stamped)


_MAKERS: Final[dict[type[Message], Callable[[Any, int], Any]]] = {
    Image: _image,
    Points: _points,
    Calibration: _calibration,
    Transform: _transform,
}

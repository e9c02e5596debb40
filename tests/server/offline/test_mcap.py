"""Recordings as .mcap: read back by other people's readers, and held against the recording."""

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as CdrDecoders
from numpy.typing import NDArray
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

import transientcam
from tests.server.recording.made import HEIGHT, WIDTH, frame, record
from transientcam_driver.camera import Sensor
from transientcam_server.errors import InputError
from transientcam_server.offline import convert_recording
from transientcam_server.offline._mcap import PRODUCTS
from transientcam_server.recording import Recording

FRAMES = 2
K1 = -0.4
LENS = {"fx": 20.0, "fy": 21.0, "cx": 7.25, "cy": 5.5, "width": WIDTH, "height": HEIGHT}
BENT = LENS | {"distortion": [K1, 0.0, 0.0, 0.0, 0.0]}
PIXELS = {"32FC1": "<f4", "16UC1": "<u2", "mono8": "|u1"}
SHOWN = ("range", "flags", "pointcloud", "raw")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("source") / "a.h5"
    return record(
        path, FRAMES, camera={"spec": "sim:mirrors", "intrinsics": BENT, "sensor": asdict(Sensor())}
    )


@pytest.fixture(scope="module")
def ros2(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return converted(source, tmp_path_factory.mktemp("ros2") / "a.mcap", schemas="ros2")


@pytest.fixture(scope="module")
def foxglove(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return converted(source, tmp_path_factory.mktemp("foxglove") / "a.mcap")


def converted(source: Path, output: Path, **options: Any) -> Path:
    with Recording(source) as recording:
        convert_recording(recording, output, products=SHOWN, **options)
    return output


def expected(source: Path, index: int) -> dict[str, NDArray[Any]]:
    """Range, flags and light of a frame, and its points from the range by hand."""
    with transientcam.open(source) as recording:
        range_m, flags, direct = recording[index].range_m, recording[index].flags, recording[index]
        light = direct.direct
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    seen = np.stack([(column - LENS["cx"]) / LENS["fx"], (row - LENS["cy"]) / LENS["fy"]], -1)
    slopes = seen
    for _ in range(100):  # what the lens bends to where the pixel is
        slopes = seen / (1.0 + K1 * np.sum(slopes**2, axis=-1, keepdims=True))
    ray = np.concatenate([slopes, np.ones((HEIGHT, WIDTH, 1))], -1)
    points = range_m[..., None] * ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    return {"range": range_m, "flags": flags, "direct": light, "points": points}


def through_rosbags(path: Path) -> dict[str, list[Any]]:
    types = get_typestore(Stores.ROS2_HUMBLE)
    found: dict[str, list[Any]] = {}
    with Reader(path) as reader:
        for connection, time_ns, data in reader.messages():
            message: Any = types.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time_ns, message))
    return found


def through_mcap(path: Path, decoders: Any) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        for each in make_reader(stream, decoder_factories=[decoders]).iter_decoded_messages():
            found.setdefault(each.channel.topic, []).append(
                (each.message.log_time, each.decoded_message)
            )
    return found


def pixels(message: Any) -> NDArray[Any]:
    values = np.frombuffer(bytes(message.data), PIXELS[message.encoding])
    return values.reshape(message.height, message.step // values.itemsize)


@pytest.mark.parametrize("decoded_by", ["rosbags", "mcap-ros2-support"])
def test_ros_programs_read_images_lens_and_points(
    ros2: Path, source: Path, decoded_by: str
) -> None:
    found = through_rosbags(ros2) if decoded_by == "rosbags" else through_mcap(ros2, CdrDecoders())

    for index in range(FRAMES):
        wanted = expected(source, index)
        assert np.isfinite(wanted["range"]).any()
        for topic in ("range", "flags"):
            _, image = found[f"/{topic}"][index]
            np.testing.assert_array_equal(pixels(image), wanted[topic])
        _, depth = found["/depth"][index]
        np.testing.assert_allclose(pixels(depth), wanted["points"][..., 2], rtol=1e-5)
        _, raw = found["/raw/image_003"][index]
        np.testing.assert_array_equal(pixels(raw), frame(index).images[3])

        arrived_ns, cloud = found["/pointcloud"][index]
        assert [each.name for each in cloud.fields] == ["x", "y", "z", "intensity"]
        assert [each.offset for each in cloud.fields] == [0, 4, 8, 12]
        assert (cloud.height, cloud.width, cloud.row_step) == (HEIGHT, WIDTH, WIDTH * 16)
        points = np.frombuffer(bytes(cloud.data), "<f4").reshape(HEIGHT, WIDTH, 4)
        np.testing.assert_allclose(points[..., :3], wanted["points"], rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(points[..., 3], wanted["direct"])

        _, info = found["/camera_info"][index]
        assert list(info.k) == [20.0, 0.0, 7.25, 0.0, 21.0, 5.5, 0.0, 0.0, 1.0]
        assert list(info.p) == [20.0, 0.0, 7.25, 0.0, 0.0, 21.0, 5.5, 0.0, 0.0, 0.0, 1.0, 0.0]
        assert (info.width, info.height, info.distortion_model) == (WIDTH, HEIGHT, "plumb_bob")
        assert list(info.d) == BENT["distortion"]
        # a pinhole's pixel (0, 0) looks where the lens bends light to another pixel
        x, y = -7.25 / 20.0, -5.5 / 21.0
        bent = 1.0 + K1 * (x * x + y * y)
        row, column = round(21.0 * y * bent + 5.5), round(20.0 * x * bent + 7.25)
        assert (row, column) != (0, 0)
        rectified = pixels(found["/depth_rect"][index][1])
        np.testing.assert_array_equal(rectified[0, 0], pixels(depth)[row, column])
        since_s = frame(index).device_time_s - frame(0).device_time_s
        first_ns, _ = found["/pointcloud"][0]
        assert arrived_ns - first_ns == pytest.approx(since_s * 1e9, abs=1e3)
        stamp = info.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == arrived_ns
        assert info.header.frame_id == cloud.header.frame_id == "camera_optical_frame"


def test_ros_listeners_that_come_late_get_the_pose_of_the_optical_frame(ros2: Path) -> None:
    _, message = through_rosbags(ros2)["/tf_static"][0]
    with Reader(ros2) as reader:
        (of_pose,) = (each for each in reader.connections if each.topic == "/tf_static")
        kinds = {each.topic: each.msgtype for each in reader.connections}

    (transform,) = message.transforms
    assert transform.header.frame_id == "camera_link"
    assert transform.child_frame_id == "camera_optical_frame"
    rotation = transform.transform.rotation
    # what the camera sees straight ahead, to its right and below, in the frame of REP 103
    for seen, wanted in (((0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, -1, 0)), ((0, 1, 0), (0, 0, -1))):
        np.testing.assert_allclose(rotated(rotation, seen), wanted, atol=1e-12)
    assert of_pose.ext.offered_qos_profiles[0].durability is QosDurability.TRANSIENT_LOCAL  # type: ignore[union-attr]
    assert kinds["/tf_static"] == "tf2_msgs/msg/TFMessage"
    assert kinds["/raw/image_000"] == kinds["/range"] == "sensor_msgs/msg/Image"


def rotated(quaternion: Any, vector: tuple[int, int, int]) -> NDArray[Any]:
    """Rotate by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v)."""
    q = np.array([quaternion.x, quaternion.y, quaternion.z])
    once = np.cross(q, vector)
    turned: NDArray[Any] = vector + 2.0 * quaternion.w * once + 2.0 * np.cross(q, once)
    return turned


def test_a_file_for_ros_holds_no_message_of_another_kind(ros2: Path) -> None:
    with ros2.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert reader.get_header().profile == "ros2"
        assert {each.message_encoding for each in summary.channels.values()} == {"cdr"}
        assert {each.encoding for each in summary.schemas.values()} == {"ros2msg"}
        (metadata,) = reader.iter_metadata()
        (label,) = (
            each.metadata for each in summary.channels.values() if each.topic == "/raw/image_001"
        )
    assert json.loads(metadata.metadata["sequence"])["harmonics"] == 2
    assert json.loads(label["weight"]) == [[0, 0], [0, 1], [0, 0]]


def test_foxglove_reads_images_lens_points_and_pose(foxglove: Path, source: Path) -> None:
    found = through_mcap(foxglove, ProtobufDecoders())

    assert set(found) == {
        "/tf_static",
        "/camera_info",
        "/range",
        "/flags",
        "/depth",
        "/depth_rect",
    } | {"/pointcloud"} | {f"/raw/image_{index:03d}" for index in range(8)}
    for index in range(FRAMES):
        wanted = expected(source, index)
        seen = np.isfinite(wanted["range"])
        for topic in ("range", "flags"):
            _, image = found[f"/{topic}"][index]
            np.testing.assert_array_equal(pixels(image), wanted[topic])
        _, cloud = found["/pointcloud"][index]
        assert [(each.name, each.offset, each.type) for each in cloud.fields] == [
            (name, 4 * place, 7) for place, name in enumerate(("x", "y", "z", "intensity"))
        ]
        points = np.frombuffer(cloud.data, "<f4").reshape(-1, cloud.point_stride // 4)
        np.testing.assert_allclose(points[:, :3], wanted["points"][seen], rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(points[:, 3], wanted["direct"][seen])
        _, info = found["/camera_info"][index]
        assert list(info.K) == [20.0, 0.0, 7.25, 0.0, 21.0, 5.5, 0.0, 0.0, 1.0]
        time_ns, pose = found["/tf_static"][index]
        (transform,) = pose.transforms
        assert (transform.parent_frame_id, transform.child_frame_id) == (
            "camera_link",
            "camera_optical_frame",
        )
        assert transform.timestamp.ToNanoseconds() == time_ns


def test_a_lens_that_is_only_assumed_says_so(tmp_path: Path) -> None:
    path = converted(record(tmp_path / "a.h5", 1), tmp_path / "a.mcap")

    with path.open("rb") as stream:
        (channel,) = (
            channel for _, channel, _ in make_reader(stream).iter_messages(topics=["/camera_info"])
        )
    assert channel.metadata == {"source": "assumed"}


@pytest.mark.parametrize("product", ["transient", "truth", "nothing"])
def test_what_no_message_can_hold_is_refused_with_what_can(
    source: Path, tmp_path: Path, product: str
) -> None:
    with Recording(source) as recording, pytest.raises(InputError, match=product) as error:
        convert_recording(recording, tmp_path / "a.mcap", products=["range", product])

    assert all(name in str(error.value) for name in PRODUCTS)
    assert list(tmp_path.iterdir()) == []


def test_other_formats_hold_raw_images_only(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording, pytest.raises(InputError, match="reconstruct"):
        convert_recording(recording, tmp_path / "a.npz", products=["range"])


def test_a_disk_that_takes_no_more_is_an_error_in_words(source: Path, tmp_path: Path) -> None:
    program = f"""
import resource
from pathlib import Path
from transientcam_server.errors import StorageError
from transientcam_server.offline import convert_recording
from transientcam_server.recording import Recording
with Recording(Path({str(source)!r})) as recording:
    convert_recording(recording, Path({str(tmp_path / "whole.mcap")!r}))  # all is imported
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
    try:
        convert_recording(recording, Path({str(tmp_path / "a.mcap")!r}))
    except StorageError as error:
        print(error)
"""
    # -B: no compiled module is cut off, too
    command = [sys.executable, "-B", "-c", program]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)

    assert ended.stdout.startswith(str(tmp_path / "a.mcap"))
    assert "cannot be read or written" in ended.stdout
    assert [each.name for each in tmp_path.iterdir()] == ["whole.mcap"]

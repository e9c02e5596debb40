"""The node of docker/ros2 before a real service, with rclpy replaced.

Its image cannot be built here, since no registry of images is reached: what the image adds is not
tested. Both programs run as they are, one after the other; what takes the place of rclpy keeps
what is published, which rosbags reads as ROS 2 would.
"""

import io
import json
import os
import runpy
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from tests.conftest import ROOT
from tests.serving import serving
from transientcam import Camera

_NODE = ROOT / "docker" / "ros2" / "node.py"
_STORE = get_typestore(Stores.ROS2_HUMBLE)
_RCLPY = """
import json, os, sys, types


class Node:
    def __init__(self, name):
        self.name = name
    def declare_parameter(self, name, default):
        return types.SimpleNamespace(value={"url": os.environ["URL"]}.get(name, default))
    def create_publisher(self, kind, topic, quality):
        count = [0]
        def publish(data):
            assert type(data) is bytes
            count[0] += 1
            name = topic.strip("/").replace("/", "-")
            with open(f"{name}.cdr", "wb") as file:
                file.write(data)
            with open(f"{name}.json", "w") as file:
                json.dump({"type": kind, "quality": quality, "count": count[0]}, file)
            left[topic] = count[0]
        return types.SimpleNamespace(publish=publish)
    def destroy_node(self):
        print("destroyed")

class Kinds:
    def __init__(self, package):
        self.package = package
    def __getattr__(self, name):
        return f"{self.package}/msg/{name}"

left = {}
def module(name, **holds):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(holds)

module("rclpy", init=lambda: None, ok=lambda: left.get("/pointcloud", 0) < 2)
module("rclpy.node", Node=Node)
module("rclpy.executors", ExternalShutdownException=type("Ended", (Exception,), {}))
module("rclpy.qos", DurabilityPolicy=types.SimpleNamespace(TRANSIENT_LOCAL="latched"),
       QoSProfile=lambda depth, durability: durability, qos_profile_sensor_data="sensor data")
for package in ("sensor_msgs", "tf2_msgs"):
    module(package)
    sys.modules[f"{package}.msg"] = Kinds(package)
"""


class _Pipe(io.BytesIO):
    """What reads at the other end goes away once two frames are whole."""

    def flush(self) -> None:
        if self.getvalue().count(b'"/pointcloud"') == 2:
            raise BrokenPipeError


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[dict[str, Any], Any]]:
    """By its topic how each was offered, and its last message; of two frames of a still scene."""
    directory = tmp_path_factory.mktemp("published")
    main = runpy.run_path(str(_NODE.with_name("cdr.py")))["main"]
    written = _Pipe()
    with serving("sim:mirrors?noise=off") as daemon:
        with pytest.raises(BrokenPipeError):
            main([daemon.url], written)
        with Camera(daemon.url) as camera:
            expected = {name: camera.frame(name).array for name in ("range", "pointcloud")}
    (directory / "replaced.py").write_text(_RCLPY)
    (directory / "messages").write_bytes(written.getvalue())
    child = directory / "child"
    child.write_text("#!/bin/sh\nprintf '%s ' \"$@\" >asked\nexec cat messages\n")
    child.chmod(0o755)
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            f"import replaced, runpy; runpy.run_path({str(_NODE)!r}, run_name='__main__')",
        ],
        cwd=directory,
        env=os.environ | {"URL": "http://camera", "TRANSIENTCAM_PYTHON": str(child)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "destroyed" in done.stdout
    assert (directory / "asked").read_text() == (
        f"{_NODE.with_name('cdr.py')} http://camera range direct pointcloud --max-rate-hz 10.0 "
    )
    found: dict[str, Any] = {name: ({}, array) for name, array in expected.items()}
    found = {f"expected {name}": each for name, each in found.items()}
    for path in directory.glob("*.json"):
        offered = json.loads(path.read_text())
        data = path.with_suffix(".cdr").read_bytes()
        found[path.stem] = offered, _STORE.deserialize_cdr(data, offered["type"])
    return found


def test_each_topic_has_its_type_and_quality(published: Any) -> None:
    offered = {
        topic: (each["type"], each["quality"]) for topic, (each, _) in published.items() if each
    }

    assert offered == {
        "range": ("sensor_msgs/msg/Image", "sensor data"),
        "direct": ("sensor_msgs/msg/Image", "sensor data"),
        "depth": ("sensor_msgs/msg/Image", "sensor data"),
        "pointcloud": ("sensor_msgs/msg/PointCloud2", "sensor data"),
        "camera_info": ("sensor_msgs/msg/CameraInfo", "sensor data"),
        "tf_static": ("tf2_msgs/msg/TFMessage", "latched"),
    }
    assert published["tf_static"][0]["count"] == 1
    assert published["camera_info"][0]["count"] == published["pointcloud"][0]["count"] == 2


def test_messages_are_the_frames_of_the_service(published: Any) -> None:
    image, points = published["range"][1], published["pointcloud"][1]

    values = image.data.view("<f4").reshape(image.height, image.width)
    np.testing.assert_allclose(values, published["expected range"][1], rtol=1e-5)
    assert [each.name for each in points.fields] == ["x", "y", "z", "intensity"]
    xyzi = points.data.view("<f4").reshape(points.height, points.width, 4)
    xyz_m = np.moveaxis(published["expected pointcloud"][1], 0, -1)
    np.testing.assert_allclose(xyzi[..., :3], xyz_m, rtol=1e-4)
    assert np.nanmax(xyzi[..., 3]) > 0
    assert image.header.frame_id == "camera_optical_frame"


def test_the_image_copies_programs_and_locks_that_there_are() -> None:
    for line in _NODE.with_name("Dockerfile").read_text().splitlines():
        if line.startswith("COPY "):
            for name in line.split()[1:-1]:
                assert name.startswith("dist/") or (ROOT / name).is_file(), name

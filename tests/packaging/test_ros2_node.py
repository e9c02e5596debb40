"""The node of docker/ros2 before a real service, with rclpy replaced.

Its image cannot be built here, since no registry of images is reached: what the image adds is not
tested. Both programs run as they are; what takes the place of rclpy keeps what is published, which
rosbags reads as ROS 2 would.
"""

import json
import os
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


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[dict[str, Any], Any]]:
    """By its topic how each was offered, and its last message; of two frames of a still scene."""
    directory = tmp_path_factory.mktemp("published")
    (directory / "replaced.py").write_text(_RCLPY)
    with serving("sim:mirrors?noise=off") as daemon:
        environment = os.environ | {
            "URL": daemon.url,
            "TRANSIENTCAM_PYTHON": sys.executable,
        }
        program = f"import replaced, runpy; runpy.run_path({str(_NODE)!r}, run_name='__main__')"
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=directory,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert "destroyed" in done.stdout, done.stderr
        with Camera(daemon.url) as camera:
            range_m = camera.frame("range").array
    found = {}
    for path in directory.glob("*.json"):
        offered = json.loads(path.read_text())
        data = path.with_suffix(".cdr").read_bytes()
        found[path.stem] = offered, _STORE.deserialize_cdr(data, offered["type"])
    found["expected"] = {}, range_m
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
    image, expected = published["range"][1], published["expected"][1]
    points = published["pointcloud"][1]

    values = image.data.view("<f4").reshape(image.height, image.width)
    np.testing.assert_allclose(values, expected, rtol=1e-5)
    assert [each.name for each in points.fields] == ["x", "y", "z", "intensity"]
    xyz = points.data.view("<f4").reshape(points.height, points.width, 4)
    np.testing.assert_allclose(np.linalg.norm(xyz[..., :3], axis=-1), expected, rtol=1e-4)
    assert np.nanmax(xyz[..., 3]) > 0
    assert published["range"][1].header.frame_id == "camera_optical_frame"


def test_the_image_copies_programs_and_locks_that_there_are() -> None:
    for line in _NODE.with_name("Dockerfile").read_text().splitlines():
        if line.startswith("COPY "):
            for name in line.split()[1:-1]:
                assert name.startswith("dist/") or (ROOT / name).is_file(), name

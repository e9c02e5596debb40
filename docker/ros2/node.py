"""A ROS 2 node that publishes a camera of the network; it needs rclpy, and no other package.

``cdr.py`` beside it makes the messages, in the environment of ``TRANSIENTCAM_PYTHON``; they are
published as the bytes that they are. Parameters: ``url``, ``products``, ``max_rate_hz``.
"""

import importlib
import json
import os
import subprocess
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data

PYTHON = os.environ.get("TRANSIENTCAM_PYTHON", "/opt/transientcam/bin/python")


class CameraNode(Node):
    """Publishes each topic as soon as there is a message for it."""

    def __init__(self):
        super().__init__("transientcam")
        url = self.declare_parameter("url", "http://127.0.0.1:8000").value
        products = self.declare_parameter("products", ["range", "direct", "pointcloud"]).value
        rate_hz = self.declare_parameter("max_rate_hz", 10.0).value
        program = [PYTHON, str(Path(__file__).with_name("cdr.py")), url, *products]
        program += ["--max-rate-hz", str(rate_hz)]
        self._child = subprocess.Popen(program, stdout=subprocess.PIPE)  # noqa: S603 - no shell
        self._topics = {}

    def run(self):
        """Publish until ROS ends, which is 0, or the child does, which is its exit code."""
        try:
            while rclpy.ok():
                line = self._child.stdout.readline()
                if not line:
                    return self._child.wait()
                head = json.loads(line)
                self._publish(head, self._child.stdout.read(head["bytes"]))
            return 0
        finally:
            self._child.terminate()
            self._child.wait()

    def _publish(self, head, data):
        topic = head["topic"]
        if topic not in self._topics:
            package, _, name = head["type"].split("/")
            kind = getattr(importlib.import_module(f"{package}.msg"), name)
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            quality = latched if head["latched"] else qos_profile_sensor_data
            self._topics[topic] = self.create_publisher(kind, topic, quality)
        self._topics[topic].publish(data)


def main():
    """Publish until ROS or the camera's messages end."""
    rclpy.init()
    node = CameraNode()
    try:
        return node.run()
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        node.destroy_node()


if __name__ == "__main__":
    raise SystemExit(main())

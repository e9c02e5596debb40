"""Cameras that run by themselves: mocks keep the contract, and are measured by a daemon."""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from tests.driver.cameras.free_running import argos_camera, moments_camera, taps_camera
from tests.driver.cameras.free_running.measuring import MOCKS, Measured, installed, measure
from transientcam.robotics import Transform
from transientcam_driver import (
    CameraName,
    Description,
    Exposure,
    Extrinsics,
    FreeRunningCamera,
    Moment,
    ProtocolError,
)
from transientcam_driver.cameras.free_running._frequencies import common_base
from transientcam_driver.clock import RealClock
from transientcam_driver.contract import CLAUSES, Bench, Clause
from transientcam_server.offline import ros2_message


@pytest.fixture(scope="module", autouse=True)
def mocks() -> Iterator[None]:
    with installed():
        yield


@pytest.fixture(scope="module", params=list(MOCKS))
def measured(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Measured:
    return measure(request.param, tmp_path_factory.mktemp(request.param))


def test_a_daemon_serves_them_and_no_check_fails(measured: Measured) -> None:
    asked = [each.frequency_hz for each in measured.module.MEASURED]
    multiples = np.array(measured.sequence["sampling"]["multiples"])
    measured_hz = multiples * measured.sequence["base_frequency_hz"]

    assert measured.failed == []
    assert measured_hz == pytest.approx(sorted(set(asked)), rel=3e-6)
    sensor = measured.camera["sensor"]  # of the Argos nobody states one: its images tell the noise
    assert sensor is None if measured.module is argos_camera else sensor["bits"] == 16


def test_their_range_is_right_and_their_noise_is_as_stated(measured: Measured) -> None:
    assert abs(measured.bias_mm) < 0.2
    assert measured.most_mm < 10 * measured.scatter_mm  # no turn is wrong
    assert 0.85 < measured.stated_mm / measured.scatter_mm < 1.15


def test_times_in_mcap_are_those_of_the_device(measured: Measured) -> None:
    assert measured.ticks_off_s < 1e-5
    assert measured.mcap_off_s < 1e-6


def test_where_a_camera_is_mounted_is_in_frames_points_and_transforms(measured: Measured) -> None:
    stated = measured.camera["intrinsics"]["extrinsics"]
    assert measured.frame["extrinsics"] == stated
    with measured.mcap.open("rb") as file:
        found = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        edges = next(each.transforms for _, channel, _, each in found if "tf" in channel.topic)
    if measured.module is not moments_camera:
        assert stated is None
        assert [each.parent_frame_id for each in edges] == ["camera_link"]
        return
    assert stated["parent"] == "base_link"
    assert b'"extrinsics": {"parent": "base_link"' in measured.points
    around = np.eye(4)
    for each in edges:  # from the frame it is mounted in down to the optical one
        step, turn, to = np.eye(4), each.rotation, each.translation
        step[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        step[:3, 3] = to.x, to.y, to.z
        around = around @ step
    wanted = Rotation.from_quat([0.5, -0.5, 0.5, 0.5]).as_matrix()
    np.testing.assert_allclose(around[:3, :3], wanted, atol=1e-12)
    assert around[:3, 3].tolist() == [0.2, -0.1, 1.3]
    names = [(each.parent_frame_id, each.child_frame_id) for each in edges]
    assert names == [("base_link", "camera_link"), ("camera_link", "camera_optical_frame")]


def test_ros_2_gets_the_same_transforms_as_foxglove() -> None:
    mount: Any = asdict(Extrinsics("arm", (0.1, -0.7, 0.1, 0.7), (1.0, 2.0, 3.0)))
    message = Transform(mount)
    types = get_typestore(Stores.ROS2_HUMBLE)
    data = ros2_message(message, 5).data
    found: Any = types.deserialize_cdr(data, "tf2_msgs/msg/TFMessage")
    seen = [
        (each.child_frame_id, each.header.frame_id, each.transform.rotation.w)
        for each in found.transforms
    ]
    assert seen == [(frame, parent, turn["w"]) for frame, parent, _, turn in message.edges]
    place = found.transforms[0].transform.translation
    assert (place.x, place.y, place.z) == (1.0, 2.0, 3.0)


GOOD: dict[str, Any] = {"parent": "base_link"}


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"parent": ""}, "parent"),
        ({"rotation_xyzw": (0.0, 0.0, 0.0, 2.0)}, "rotation_xyzw"),
        ({"rotation_xyzw": (1.0,)}, "rotation_xyzw"),
        ({"translation_m": (0.0, math.nan, 0.0)}, "translation_m"),
        ({"translation_m": (0.0, 0.0)}, "translation_m"),
    ],
)
def test_what_is_no_pose_is_refused_by_name(wrong: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=rf"{named}=.* has no name"):
        Extrinsics(**{**GOOD, **wrong})


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_the_contract_is_kept(clause: Clause) -> None:
    taps_camera.Device.unplugged.clear()
    bench = Bench(
        lambda: taps_camera.PLUGIN.open(CameraName.parse("taps:"), RealClock()),
        lit=lambda camera: (
            taps_camera.Device.lit == 1 and not taps_camera.Device.unplugged.is_set()
        ),
        unplug=lambda camera: taps_camera.Device.unplugged.set(),
        replug=lambda camera: taps_camera.Device.unplugged.clear(),
        lose_image=lambda camera: taps_camera.Device.spoilt.set(),
        read_s=60.0,
    )
    clause.run(bench)


@pytest.mark.parametrize(
    ("frequencies_hz", "max_range_m", "multiples"),
    [
        ((20e6, 100e6), None, (1, 5)),
        ((120e6, 16e6, 80e6), None, (2, 10, 15)),
        ((14.9e6, 100.1e6), 7.5, (149, 1001)),
        ((60e6,), None, (1,)),
    ],
)
def test_a_base_is_the_largest_that_there_is(
    frequencies_hz: tuple[float, ...], max_range_m: float | None, multiples: tuple[int, ...]
) -> None:
    base_hz, found = common_base(frequencies_hz, max_range_m)

    assert found == multiples
    assert base_hz * np.array(found) == pytest.approx(sorted(frequencies_hz), rel=1e-12)


def test_incommensurable_frequencies_are_off_by_less_than_shows() -> None:
    wanted_hz = 20e6 * np.sqrt([1.0, 7.0, 10.0])
    base_hz, multiples = common_base(wanted_hz, 10.0)

    delay_s = 2 * 10.0 / 299_792_458.0
    assert abs(2 * np.pi * delay_s * (base_hz * np.array(multiples) - wanted_hz)).max() < 2e-4


def described(*measurements: Exposure | Moment, **others: Any) -> Description:
    return Description(
        model="x", serial="1", firmware="1", width=4, height=3, frame_rate_hz=10.0,
        measurements=measurements, **others,
    )  # fmt: skip


THREE = tuple(Exposure(80e6, 2 * math.pi * k / 3) for k in range(3))
FOUR = tuple(Exposure(100e6, math.pi * k / 2) for k in range(4))
NOT_POSSIBLE: dict[str, Callable[[], Description]] = {
    "at least one": described,
    "three different ones": lambda: described(*THREE[:2], sensor=taps_camera.SENSOR),
    "one moment, or exposures": lambda: described(*THREE, Moment(80e6, 1.0, 9.0)),
    "stated, for phases that differ": lambda: described(*THREE, *FOUR),
    "or max_range_m stated": lambda: described(Moment(2e7, 1.0, 9.0), Moment(7.1e7, 1.0, 9.0)),
    r"std is -1.0": lambda: described(Moment(2e7, -1.0, 9.0)),
    r"one or \(3, 4\)": lambda: described(Moment(2e7, 1.0, 9.0, np.ones((2, 2)))),
    "finite and not 0": lambda: described(replace(THREE[0], gain=0.0)),
}


@pytest.mark.parametrize("limit", NOT_POSSIBLE)
def test_what_cannot_be_measured_is_refused_by_name(limit: str) -> None:
    class Device(moments_camera.Device):
        def __init__(self) -> None:
            super().__init__()
            self.description = NOT_POSSIBLE[limit]()

    with pytest.raises(ProtocolError, match=limit):
        FreeRunningCamera(Device)

"""A flat wall is flat in every format, behind ten lenses and beside ten lights.

Each file is read by its format's own reader; where pixels look is OpenCV's word.
"""

import io
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import rerun
import xarray
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as CdrDecoders
from numpy.typing import NDArray
from plyfile import PlyData
from rerun.chunk import RrdReader

import transientcam
from tests.server.recording.made import CAPABILITIES, SEQUENCE, frame, header
from transientcam.robotics import Pinhole, messages_of
from transientcam.robotics._rerun_bridge import POINTS, log_message
from transientcam_server.imaging import ENCODINGS, Intrinsics, nominal_gains
from transientcam_server.offline import BatchOptions, convert_recording, reconstruct_recording
from transientcam_server.recording import Recording, RecordingWriter
from transientcam_server.settings import ReconstructionSettings

LIGHT_M_S = 299_792_458.0
WIDTH, HEIGHT = 48, 36
NORMAL, AWAY_M = np.array([0.15, -0.1, 1.0]) / np.linalg.norm([0.15, -0.1, 1.0]), 2.0
FLAT_M = 1e-3
"""What the steps of 16 bits do to a range, at most."""
RECTIFIED_M = 2e-3
PRODUCTS = ("pointcloud", "range", "direct", "flags")
PLAIN = ReconstructionSettings(estimator="pisarenko", smoothing_px=0.0)
KINECT = (0.0905, -0.2682, 0.0, 0.0, 0.0951)
LENSES = {
    "pinhole": Intrinsics(45.0, 45.0, 23.5, 17.5, WIDTH, HEIGHT),
    "off axis": Intrinsics(45.0, 47.0, 18.25, 21.5, WIDTH, HEIGHT),
    "far off axis": Intrinsics(60.0, 60.0, -3.0, 17.5, WIDTH, HEIGHT),
    "Kinect": Intrinsics(34.3, 34.3, 24.0, 19.4, WIDTH, HEIGHT, "camera", KINECT, 0.045),
    "barrel": Intrinsics(45.0, 45.0, 23.5, 17.5, WIDTH, HEIGHT, "scene", (-0.25, 0.05, 0, 0, 0)),
    "tangential": Intrinsics(
        40.0, 42.0, 22.0, 18.0, WIDTH, HEIGHT, "scene", (0, 0, 0.01, -0.02, 0)
    ),
    "light right": Intrinsics(45.0, 45.0, 23.5, 17.5, WIDTH, HEIGHT, "scene", (), 0.6),
    "light above": Intrinsics(45.0, 45.0, 23.5, 17.5, WIDTH, HEIGHT, "scene", (), 0, -0.3),
    "light behind": Intrinsics(45.0, 45.0, 23.5, 17.5, WIDTH, HEIGHT, "scene", (), 0, 0, -0.4),
    "everything": Intrinsics(
        *(38.0, 36.0, 25.0, 16.0, WIDTH, HEIGHT, "settings"),
        *((0.1, -0.2, 0.004, -0.006, 0.05), -0.2, 0.1, 0.15),
    ),
}


@dataclass(frozen=True)
class Wall:
    """A recording of the wall, and its points (H, W, 3) in m."""

    path: Path
    lens: Intrinsics
    points: NDArray[np.float64]


@pytest.fixture(params=LENSES)
def wall(request: pytest.FixtureRequest, tmp_path: Path) -> Wall:
    lens = LENSES[request.param]
    rays = looked(lens.matrix, lens.coefficients)
    points = AWAY_M * rays / (rays @ NORMAL)[..., np.newaxis]
    light = np.array([lens.light_x_m, lens.light_y_m, lens.light_z_m])
    path_m = np.linalg.norm(points, axis=-1) + np.linalg.norm(points - light, axis=-1)
    capabilities = replace(CAPABILITIES, width=WIDTH, height=HEIGHT)
    applied = capabilities.apply(replace(SEQUENCE, harmonics=1), epoch=7)
    gain = nominal_gains(applied.sequence)
    images = []
    for label in applied.labels:
        turn_rad = 2.0 * np.pi * label.frequency_hz * path_m / LIGHT_M_S
        light_dn = 4e4 * gain[label.harmonic] * np.exp(1j * (turn_rad - label.phase_rad))
        images.append(np.rint(3.2e4 + light_dn.real / 2.0))
    raw = replace(frame(0), labels=applied.labels, images=np.array(images).astype(np.uint16))
    about = header(applied=applied, capabilities=capabilities, camera={"intrinsics": asdict(lens)})
    about = replace(about, reconstruction=PLAIN.model_dump())
    writer = RecordingWriter(tmp_path / "wall.h5", about)
    writer.append(raw)
    writer.close({"reason": "stopped", "frames": 1, "duration_s": 0.1})
    return Wall(tmp_path / "wall.h5", lens, points)


def looked(matrix: Any, distortion: Any) -> NDArray[np.float64]:
    """Return the rays (H, W, 3) of all pixels, (x, y, 1), by OpenCV."""
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).astype(np.float64)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-12)
    k, d = np.reshape(matrix, (3, 3)), np.asarray(distortion, dtype=np.float64)
    slopes = cv2.undistortPoints(pixels.reshape(-1, 1, 2), k, d, criteria=until)
    return np.concatenate([slopes.reshape(HEIGHT, WIDTH, 2), np.ones((HEIGHT, WIDTH, 1))], -1)


def assert_flat(points: Any) -> None:
    """Hold points (N, 3) to the wall, in all pixels."""
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    assert len(points) == WIDTH * HEIGHT
    assert np.abs(points @ NORMAL - AWAY_M).max() < FLAT_M


def test_a_flat_wall_is_flat_in_every_format(wall: Wall) -> None:
    folder = wall.path.parent
    with transientcam.open(wall.path) as opened:
        cloud, *others = (opened.frames[0].product(each) for each in PRODUCTS)
    np.testing.assert_allclose(np.moveaxis(cloud.array, 0, -1), wall.points, atol=FLAT_M)

    beside = {each.product: each.array for each in others}
    ply = PlyData.read(io.BytesIO(ENCODINGS["ply"].encode(replace(cloud, extra=beside))))["vertex"]
    assert_flat(np.stack([ply[axis] for axis in "xyz"], -1))
    with Recording(wall.path) as recording:
        reconstruct_recording(recording, folder / "p.nc", BatchOptions(("pointcloud",), PLAIN))
        convert_recording(recording, folder / "r.mcap", products=["pointcloud"], schemas="ros2")
        convert_recording(recording, folder / "f.mcap", products=["pointcloud"])
    assert_robots_agree(through_mcap(folder / "r.mcap", CdrDecoders()))
    assert_robots_agree(through_mcap(folder / "f.mcap", ProtobufDecoders()))
    with xarray.open_dataset(folder / "p.nc", engine="h5netcdf") as dataset:
        assert_flat(np.moveaxis(dataset["pointcloud"][0].values, 0, -1))
    logged = through_rerun(folder / "wall.rrd", cloud.array, wall.lens)
    assert_flat(logged[POINTS, "Points3D:positions"][0])


def through_mcap(path: Path, decoders: Any) -> dict[str, Any]:
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[decoders])
        return {each.channel.topic: each.decoded_message for each in reader.iter_decoded_messages()}


def assert_robots_agree(found: dict[str, Any]) -> None:
    """Hold points to the wall, and depth and lens to the points, by OpenCV."""
    info, depth = found["/camera_info"], plane(found["/depth"])
    k, d = (getattr(info, name.lower(), None) or getattr(info, name) for name in "KD")
    data = np.frombuffer(bytes(found["/pointcloud"].data), "<f4")
    points = data.reshape(HEIGHT, WIDTH, 4)[..., :3]
    assert_flat(points)
    np.testing.assert_allclose(depth[..., np.newaxis] * looked(k, d), points, atol=2e-4)
    if (rectified := found.get("/depth_rect")) is None:
        assert not any(d)
        return
    seen = plane(rectified)[..., np.newaxis] * looked(k, np.zeros(5))
    there = np.isfinite(seen[..., 2])
    assert there.mean() > 0.8
    assert np.abs(seen[there] @ NORMAL - AWAY_M).max() < RECTIFIED_M


def plane(message: Any) -> NDArray[Any]:
    return np.frombuffer(bytes(message.data), "<f4").reshape(HEIGHT, WIDTH).astype(np.float64)


def through_rerun(path: Path, points: NDArray[Any], lens: Pinhole) -> dict[tuple[str, str], Any]:
    recording = rerun.RecordingStream("wall")
    recording.save(path)
    for message in messages_of({"pointcloud": points}, lens):
        log_message(recording, message)
    recording.flush()
    recording.disconnect()
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            found[chunk.entity_path.lstrip("/"), name] = column.to_pylist()
    return found

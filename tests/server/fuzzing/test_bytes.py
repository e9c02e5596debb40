"""Untrusted bytes: whatever they are, only documented errors are raised."""

import io
import os
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.conftest import ROOT
from tests.server.fuzzing.targets import SMALL_BYTES, TARGETS
from tests.serving import serving
from transientcam import wire
from transientcam_driver import Sequence, capture_calibration, open_camera
from transientcam_driver.calibration import CalibrationCapture
from transientcam_driver.clock import VirtualClock
from transientcam_driver.errors import CalibrationError

RUNS = 2000
REPEATABLE = settings(derandomize=True, deadline=None, database=None, max_examples=60)


def good_calibration(path: Path) -> bytes:
    """A small file of the right kind."""
    with open_camera("sim:calibration", clock=VirtualClock()) as camera:
        camera.configure(Sequence(harmonics=1, zeroth="estimated", exposure_s=0.0005))
        capture_calibration(camera, takes=2).save(path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Something that each target makes sense of."""
    subscribe = {"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]}
    frame = wire.encode_frame(
        product="range",
        unit="m",
        axes=("y", "x"),
        meta={"frame": 1},
        array=np.zeros((2, 3), np.float32),
        channel=0,
    )
    return {
        "client_message": wire.pack(subscribe),
        "server_message": frame,
        "calibration_file": good_calibration(tmp_path_factory.mktemp("seed") / "good.npz"),
        "byte_range": b"bytes=0-99,200-",
    }


def mutated(data: bytes) -> st.SearchStrategy[bytes]:
    """Bytes of which a few are others, and of which some are missing."""
    places = st.integers(0, len(data) - 1)
    changes = st.lists(st.tuples(places, st.integers(0, 255)), max_size=8)

    def change(how: tuple[list[tuple[int, int]], int]) -> bytes:
        changed = bytearray(data)
        for place, value in how[0]:
            changed[place] = value
        return bytes(changed[: how[1]])

    return st.tuples(changes, st.one_of(st.just(len(data)), places)).map(change)


@pytest.mark.parametrize("name", TARGETS)
def test_any_bytes_are_read_or_refused(name: str) -> None:
    @REPEATABLE
    @given(st.binary(max_size=512))
    def read(data: bytes) -> None:
        TARGETS[name](data)

    read()


@pytest.mark.parametrize("name", TARGETS)
def test_bytes_that_are_nearly_right_are_read_or_refused(
    name: str, seeds: dict[str, bytes]
) -> None:
    @REPEATABLE
    @given(mutated(seeds[name]))
    def read(data: bytes) -> None:
        TARGETS[name](data)

    read()


def test_what_coverage_leads_to_is_read_or_refused(seeds: dict[str, bytes], tmp_path: Path) -> None:
    pytest.importorskip("atheris", reason="atheris is made for Linux and some versions of Python")
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    for index, name in enumerate(TARGETS):
        (corpus / name).write_bytes(bytes((index,)) + seeds[name])
    result = subprocess.run(
        [
            *(sys.executable, "-m", "tests.server.fuzzing.coverage_guided", f"-runs={RUNS}"),
            *("-seed=1", "-max_len=65536", f"-artifact_prefix={tmp_path}/", str(corpus)),
        ],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )

    assert result.returncode == 0, result.stderr[-4000:]
    assert f"Done {RUNS} runs" in result.stderr


def archive(**members: bytes) -> bytes:
    """A zip with these files."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in members.items():
            packed.writestr(f"{name}.npy", data)
    return stream.getvalue()


def npy(array: Any) -> bytes:
    """An array as a file."""
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


HOSTILE = {
    "nothing": b"",
    "a zip of nothing": archive(),
    "a bomb": archive(images=npy(np.zeros((64, 1024, 1024), np.float32))),
    "an array said to be huge": archive(
        images=npy(np.zeros(1)).replace(b"'shape': (1,), }", b"'shape': (9**9,)}")
    ),
    "a document as deep as can be": archive(document=npy(np.array("[" * 100_000))),
    "a document that is none": archive(document=npy(np.array('{"sequence": 7}'))),
    "names that lead elsewhere": archive(**{"../../etc/passwd": npy(np.zeros(1))}),
}


def lying(name: str, data: bytes, *, stated: int, packing: int) -> bytes:
    """A zip with one file, whose directory states another size than it unpacks to."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", packing) as packed:
        packed.writestr(f"{name}.npy", data)
    archive = stream.getvalue()
    sizes = len(data).to_bytes(4, "little")
    return archive.replace(sizes, stated.to_bytes(4, "little"))


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2])
def test_a_file_that_unpacks_to_more_than_it_states_takes_no_memory(
    tmp_path: Path, packing: int
) -> None:
    path = tmp_path / "upload.npz"
    path.write_bytes(lying("images", bytes(64 * SMALL_BYTES), stated=1000, packing=packing))

    tracemalloc.start()
    with pytest.raises(CalibrationError):
        CalibrationCapture.load(path, max_bytes=SMALL_BYTES)
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    assert peak_bytes < SMALL_BYTES


def test_uploads_are_taken_or_refused_and_nothing_else_is_disturbed(
    tmp_path: Path, seeds: dict[str, bytes]
) -> None:
    directory = tmp_path / "kept"
    kept = {"directory": directory, "max_bytes": 4 * 1024 * 1024}
    with (
        serving("sim:calibration?noise=off", calibrations=kept) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as client,
    ):
        address = "/api/v1/calibrations/import"

        @settings(REPEATABLE, max_examples=40)
        @given(mutated(seeds["calibration_file"]))
        def upload(data: bytes) -> None:
            answer = client.post(address, content=data)
            assert answer.status_code in (201, 409, 422), answer.text

        upload()
        refused = {
            name: client.post(address, content=data).status_code for name, data in HOSTILE.items()
        }
        number = client.get("/api/v1/frames/latest", params={"wait_s": 10}).json()["frame"]
        query = {"wait_s": 10, "after": number}
        following = client.get("/api/v1/frames/latest", params=query)

    assert set(refused.values()) <= {413, 422}, refused
    assert following.status_code == 200
    assert not list(directory.glob("*.part"))

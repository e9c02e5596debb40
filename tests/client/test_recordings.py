import asyncio
import json
from collections.abc import Iterator
from pathlib import Path

import h5py
import httpx
import pytest

import transientcam
from tests.serving import Served, serving
from transientcam.cli import run


@pytest.fixture
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    directory = tmp_path_factory.mktemp("kept")
    with serving(recordings={"directory": directory, "min_free_bytes": 0}) as served:
        yield served


def test_a_camera_records_stops_and_downloads(daemon: Served, tmp_path: Path) -> None:
    with transientcam.Camera(daemon.url) as camera:
        running = camera.record(name="by hand", annotations={"a": 1})
        assert camera.recording(running["id"])["state"] == "recording"
        stopped = camera.stop_recording(running["id"])
        reported: list[tuple[int, int | None]] = []
        camera.download_recording(
            running["id"], tmp_path / "a.h5", progress=lambda *how_far: reported.append(how_far)
        )
        size = (tmp_path / "a.h5").stat().st_size
        assert reported[-1] == (size, size)
        assert [done for done, _ in reported] == sorted({done for done, _ in reported})
        listed = camera.recordings()["recordings"]

    assert stopped["state"] == "complete"
    assert stopped["id"] in [each["id"] for each in listed]
    with h5py.File(tmp_path / "a.h5") as file:
        assert file.attrs["title"] == "by hand"
        assert len(file["raw"]) == stopped["frames"]


def test_an_async_camera_does_the_same(daemon: Served, tmp_path: Path) -> None:
    async def record() -> int:
        async with transientcam.AsyncCamera(daemon.url) as camera:
            running = await camera.record(frames=2)
            while running["state"] != "complete":
                running = await camera.recording(running["id"])
            await camera.download_recording(running["id"], tmp_path / "a.h5")
            with pytest.raises(transientcam.ProblemError, match="no recording"):
                await camera.stop_recording("absent")
            assert (await camera.recordings())["active"] is None
            return int(running["frames"])

    frames = asyncio.run(record())
    with h5py.File(tmp_path / "a.h5") as file:
        assert len(file["raw"]) == frames == 2


def test_a_download_that_is_refused_leaves_nothing(daemon: Served, tmp_path: Path) -> None:
    with (
        transientcam.Camera(daemon.url) as camera,
        pytest.raises(transientcam.ProblemError, match="no recording"),
    ):
        camera.download_recording("absent", tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_an_id_never_leaves_the_client(daemon: Served) -> None:
    with transientcam.Camera(daemon.url) as camera:
        for name in ("", "../a", "a/b", "a?b"):
            with pytest.raises(transientcam.ParameterError):
                camera.recording(name)


def test_the_verb_records_nothing_into_a_file_of_another_format(
    daemon: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = len(httpx.get(f"{daemon.url}/api/v1/recordings").json()["recordings"])

    assert run(["record", daemon.url, "--frames", "1", "-o", str(tmp_path / "a.npz")]) == 2

    assert ".h5 or .hdf5" in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert len(httpx.get(f"{daemon.url}/api/v1/recordings").json()["recordings"]) == before


def test_the_verb_records_downloads_and_reports(
    daemon: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "a.h5"
    code = run(
        ["record", daemon.url, "--frames", "3", "--note", "a fly", "-o", str(output), "--json"]
    )

    report = json.loads(capsys.readouterr().out)
    assert code == 0
    assert report["state"] == "complete"
    assert report["annotations"] == {"note": "a fly"}
    with h5py.File(output) as file:
        assert len(file["raw"]) == report["frames"] == 3

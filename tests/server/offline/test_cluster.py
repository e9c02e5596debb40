"""Recordings computed on a cluster, held against the run of one process."""

import os
import shutil
import signal
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import dask
import distributed
import numpy as np
import pytest
import xarray
import zarr
from moto.server import ThreadedMotoServer

import transientcam
import transientcam_moments as tm
from tests.moments.compiled_kernels import without_kernels
from tests.server.recording.made import record
from tests.waiting import wait_until
from transientcam.cli import run
from transientcam_server.errors import ClusterError, InputError, MixedVersions, StorageError
from transientcam_server.offline import (
    BatchOptions,
    _cluster as cluster,
    _job as job,
    reconstruct_on,
    reconstruct_recording,
)
from transientcam_server.offline._job import BLOCK_FRAMES, Job, spans
from transientcam_server.recording import Recording
from transientcam_server.settings import ReconstructionSettings

FRAMES = 3 * BLOCK_FRAMES - 20
SETTINGS = ReconstructionSettings(
    estimator="pisarenko"
)  # the quickest: what is held is who computes
OPTIONS = BatchOptions(("range", "validity"), SETTINGS)
LOAD_KERNELS = job.load_kernels
NOTHING: Any = lambda *_: None  # noqa: E731 - in place of what compiles
pytestmark = pytest.mark.usefixtures("zarr_clients")


@pytest.fixture(scope="module", autouse=True)
def numpy_only() -> Iterator[None]:
    """Leave everything to NumPy, whatever this process compiled or has loaded: kernels round
    otherwise, and processes are compared bit for bit."""
    with pytest.MonkeyPatch.context() as patch, without_kernels():
        patch.setattr(job, "load_kernels", NOTHING)
        yield


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("cluster") / "a.h5", FRAMES)


@pytest.fixture(scope="module")
def serial(source: Path) -> dict[str, Any]:
    """Every array, as one process writes it."""
    output = source.with_name("serial.zarr")
    with Recording(source) as recording:
        reconstruct_recording(recording, output, OPTIONS)
    return {name: np.asarray(array) for name, array in zarr.open_group(str(output)).arrays()}


@pytest.fixture(scope="module")
def client() -> Iterator[distributed.Client]:
    """Of a cluster of threads, which starts in no time and is reached by its address."""
    quick = {"distributed.worker.profile.enabled": False}
    with (
        dask.config.set(quick),
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=False,
            protocol="tcp",
            dashboard_address="127.0.0.1:0",
        ) as local,
        distributed.Client(local) as client,
    ):
        for worker in client.scheduler_info(n_workers=-1)["workers"]:
            client.submit(int, workers=[worker], pure=False).result()  # starts its thread
        yield client


def idle(client: distributed.Client) -> bool:
    """Return whether no task is left, those that were cancelled while they ran included."""
    left = client.run_on_scheduler(lambda dask_scheduler: len(dask_scheduler.tasks))
    running = client.run(lambda dask_worker: len(dask_worker.state.tasks))
    return not left and not any(running.values())


def assert_same(output: str, serial: dict[str, Any]) -> None:
    """Hold a store against the serial run, bit for bit."""
    dataset = xarray.open_zarr(output)
    assert set(dataset.variables) == serial.keys()
    for name, expected in serial.items():
        np.testing.assert_array_equal(dataset[name].to_numpy(), expected)
        assert dataset[name].dtype == expected.dtype


def test_a_cluster_computes_what_one_process_does(
    client: distributed.Client, source: Path, serial: dict[str, Any], tmp_path: Path
) -> None:
    done: list[tuple[int, int]] = []
    output = str(tmp_path / "a.zarr")

    counts = reconstruct_on(
        client, str(source), output, OPTIONS, progress=lambda *count: done.append(count)
    )

    assert counts == (FRAMES, 0)
    assert_same(output, serial)
    assert done[0] == (0, FRAMES)
    assert done[-1] == (FRAMES, FRAMES)
    assert len(done) == 1 + len(spans(FRAMES))
    with pytest.raises(FileExistsError):
        reconstruct_on(client, str(source), output, OPTIONS)


def test_a_run_that_was_interrupted_is_gone_on_with(
    client: distributed.Client, source: Path, serial: dict[str, Any], tmp_path: Path
) -> None:
    def interrupt(done: int, total: int) -> None:
        if done:
            raise KeyboardInterrupt

    output = str(tmp_path / "a.zarr")
    with pytest.raises(KeyboardInterrupt):
        reconstruct_on(client, str(source), output, OPTIONS, progress=interrupt)
    wait_until(lambda: idle(client))  # what had begun goes on, and writes
    begun: Any = zarr.open_group(output, mode="r")
    assert begun.attrs["state"] == "unfinished"
    missing = begun["frame"][:] == cluster.MISSING
    for name in OPTIONS.products:
        values = begun[name][:][missing]
        assert np.isnan(values).all() if values.dtype.kind in "fc" else (values == 255).all()
    other = BatchOptions(OPTIONS.products, SETTINGS.model_copy(update={"bias": 0.01}))
    with pytest.raises(InputError, match="reconstruction"):
        reconstruct_on(client, str(source), output, other)

    frames, before = reconstruct_on(client, str(source), output, OPTIONS)

    assert frames == FRAMES
    assert before >= FRAMES % BLOCK_FRAMES
    assert zarr.open_group(output, mode="r").attrs["state"] == "complete"
    assert_same(output, serial)


def test_a_store_that_was_not_yet_laid_out_is_begun_anew(
    client: distributed.Client, source: Path, serial: dict[str, Any], tmp_path: Path
) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    output = tmp_path / "a.zarr"
    with pytest.raises(KeyboardInterrupt):
        reconstruct_on(client, str(source), str(output), OPTIONS, progress=interrupt)
    shutil.rmtree(output / cluster.COUNTING)

    assert reconstruct_on(client, str(source), str(output), OPTIONS) == (FRAMES, 0)
    assert_same(str(output), serial)


def test_what_is_not_a_store_is_left_alone(
    client: distributed.Client, source: Path, tmp_path: Path
) -> None:
    output = tmp_path / "a.zarr"
    output.mkdir()
    (output / "notes.txt").write_text("mine")

    with pytest.raises(FileExistsError, match="no Zarr store"):
        reconstruct_on(client, str(source), str(output), OPTIONS)
    assert [each.name for each in output.iterdir()] == ["notes.txt"]


def test_workers_that_stay_read_a_replaced_file_anew(
    client: distributed.Client, tmp_path: Path
) -> None:
    source, output = tmp_path / "a.h5", tmp_path / "a.zarr"
    shapes = []
    for frames in (3, 5):
        source.unlink(missing_ok=True)
        record(source, frames)
        reconstruct_on(client, str(source), str(output), BatchOptions(("range",), SETTINGS))
        shapes.append(xarray.open_zarr(output)["range"].shape[0])
        shutil.rmtree(output)

    assert shapes == [3, 5]


def kill_once(flag: Path) -> None:
    """Have the first frames that this process computes end it as SIGKILL does."""
    module: Any = cluster
    real = module.computed

    def computed(*arguments: Any) -> Any:
        if not flag.exists():
            flag.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return real(*arguments)

    module.computed = computed


def test_a_worker_that_is_killed_in_the_middle_spoils_nothing(
    source: Path, serial: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TRANSIENTCAM_KERNELS", "off")
    output, flag = str(tmp_path / "a.zarr"), tmp_path / "killed"
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
        ) as local,
        distributed.Client(local) as client,
    ):
        first = client.run(os.getpid)
        client.run(partial(kill_once, flag))
        reconstruct_on(client, str(source), output, OPTIONS)
        assert client.run(os.getpid) != first

    assert flag.exists()
    assert_same(output, serial)


def test_a_scheduler_that_goes_is_said_and_its_successor_goes_on(
    client: distributed.Client, source: Path, serial: dict[str, Any], tmp_path: Path
) -> None:
    output = str(tmp_path / "a.zarr")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as local,
        distributed.Client(local) as lost,
        pytest.raises(ClusterError, match="goes on where it stopped"),
    ):
        reconstruct_on(
            lost,
            str(source),
            output,
            OPTIONS,
            progress=lambda done, total: local.close() if done else None,
        )

    _, before = reconstruct_on(client, str(source), output, OPTIONS)

    assert before
    assert_same(output, serial)


def test_a_worker_with_other_versions_refuses(
    client: distributed.Client, source: Path, tmp_path: Path
) -> None:
    made = Job.of(str(source), OPTIONS)
    older = replace(made, versions=(("transientcam", "0.0.1"), *made.versions[1:]))

    with pytest.raises(MixedVersions, match=r"worker tcp://.* and not 0\.0\.1"):
        client.submit(job.computed, older, 0, 1).result()


@pytest.fixture(scope="module")
def s3(zarr_clients: None) -> Iterator[Any]:
    """The file system of a server as that of S3, with the bucket `bucket`."""
    import s3fs

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            patch.setenv(name, "testing")
        files = s3fs.S3FileSystem()
        files.mkdir("bucket")
        yield files
        server.stop()


def test_the_output_may_be_an_address_as_of_s3(
    client: distributed.Client, source: Path, serial: dict[str, Any], s3: Any
) -> None:
    reconstruct_on(client, str(source), "s3://bucket/a.zarr", OPTIONS)

    assert_same("s3://bucket/a.zarr", serial)


def test_a_store_that_refuses_is_named_with_its_bucket(
    client: distributed.Client, source: Path, s3: Any
) -> None:
    with pytest.raises(StorageError, match=r"^s3://none/a\.zarr .*bucket does not exist"):
        reconstruct_on(client, str(source), "s3://none/a.zarr", OPTIONS)
    with pytest.raises(StorageError, match=r"^ftps3://none/a\.zarr .*ftps3"):
        reconstruct_on(client, str(source), "ftps3://none/a.zarr", OPTIONS)


def test_a_store_that_goes_in_the_middle_is_named_by_a_worker(
    client: distributed.Client, source: Path, s3: Any
) -> None:
    def lose(done: int, total: int) -> None:
        if s3.exists("lost"):
            s3.rm("lost", recursive=True)

    s3.mkdir("lost")
    with pytest.raises(StorageError, match=r"^s3://lost/a\.zarr "):
        reconstruct_on(client, str(source), "s3://lost/a.zarr", OPTIONS, progress=lose)


def test_the_command_takes_the_address_of_a_scheduler_and_a_directory(
    client: distributed.Client, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    for name in ("a", "b"):
        record(recordings / f"{name}.h5", 2)
    address = client.scheduler.address
    options = ["--product", "range", "--dask", address]

    assert run(["reconstruct", str(recordings), "-o", str(tmp_path / "out"), *options]) == 0
    assert "range of 2 frames" in capsys.readouterr().err
    for name in ("a", "b"):
        assert xarray.open_zarr(tmp_path / "out" / f"{name}.zarr")["range"].shape[0] == 2
    whole = (recordings / "a.h5").read_bytes()
    (recordings / "0 torn.h5").write_bytes(whole[:3000])
    (recordings / "1 flipped.h5").write_bytes(bytes(each ^ 0xFF for each in whole))
    (recordings / "2 empty.h5").touch()
    os.mkfifo(recordings / "3 pipe.h5")
    assert run(["reconstruct", str(recordings), "-o", str(tmp_path / "again"), *options]) == 1
    said = capsys.readouterr().err
    assert all(name in said for name in ("0 torn.h5", "1 flipped.h5", "2 empty.h5"))
    assert "3 of 5 recordings are not reconstructed" in said
    assert xarray.open_zarr(tmp_path / "again" / "b.zarr")["range"].shape[0] == 2
    assert run(["reconstruct", str(source), "-o", "a.h5", *options]) == 2
    assert run(["reconstruct", str(source), "-o", "a.zarr", *options, "--workers", "2"]) == 2
    assert run(["reconstruct", str(tmp_path / "out"), "-o", "a.zarr", *options]) == 2


def test_python_has_the_products_as_dask_arrays(source: Path, serial: dict[str, Any]) -> None:
    with transientcam.open(source, settings=OPTIONS.settings.model_dump()) as recording:
        dataset = recording.reconstruct("range", "validity")

        assert dataset["range"].chunks == ((64, 64, 44), (12,), (16,))
        part = dataset["range"][60:70].to_numpy()
    # kernels that became ready between the two round otherwise
    np.testing.assert_allclose(part, serial["range"][60:70], rtol=1e-5, atol=1e-5)


def test_the_kernels_that_frames_need_are_made_ready_first(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(job, "load_kernels", LOAD_KERNELS)
    monkeypatch.setattr(tm.kernels, "compile", lambda **options: asked.append(options))
    settings = ReconstructionSettings(estimator="likelihood")

    job.computed(Job.of(str(source), BatchOptions(("range",), settings)), 0, 1)

    (options,) = asked
    assert options["harmonics"] == [2]
    assert {"reconstruct", "likelihood"} <= set(options["names"])
    assert "pairs" not in options["names"]

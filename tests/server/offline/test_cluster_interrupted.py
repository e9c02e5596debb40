"""Ctrl-C in a terminal while `transientcam ... --workers N` computes."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import distributed
import numpy as np
import pytest
import zarr

from tests.server.recording.made import record
from transientcam_server.offline import BatchOptions, job, reconstruct_recording
from transientcam_server.offline.cluster import COUNTING, MISSING, reconstruct_on
from transientcam_server.offline.job import BLOCK_FRAMES
from transientcam_server.recording import Recording

FRAMES = 2 * BLOCK_FRAMES + 4
OPTIONS = BatchOptions(("range",))
COMMAND = [sys.executable, "-c", "from transientcam.cli import main; main()"]
HOLD = """
import os, time
from transientcam_server.offline import cluster

real = cluster.computed

def computed(job, first, last):
    while first >= cluster.BLOCK_FRAMES:  # tasks behind the first never end by themselves
        time.sleep(0.05)
    return real(job, first, last)

def dask_setup(worker):
    cluster.computed = computed
    print(os.getpid(), flush=True)
"""
pytestmark = pytest.mark.usefixtures("zarr_clients")


@contextmanager
def in_a_terminal(
    *arguments: str, environment: dict[str, str]
) -> Iterator["subprocess.Popen[str]"]:
    """Run a command in a process group of its own, as a shell does."""
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def there(store: Path) -> int:
    """Return how many frames a store has, also while it is laid out."""
    try:
        frames = np.asarray(zarr.open_array(str(store / COUNTING), mode="r"))
    except (FileNotFoundError, ValueError):
        return 0
    return int(np.count_nonzero(frames != MISSING))


def test_ctrl_c_ends_the_workers_and_leaves_a_store_to_go_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TRANSIENTCAM_KERNELS", "off")  # all is compared on NumPy
    monkeypatch.setattr(job, "_load_lanes", lambda *_: None)
    source, store = record(tmp_path / "a.h5", FRAMES), tmp_path / "a.zarr"
    hold = tmp_path / "hold.py"
    hold.write_text(HOLD)
    environment = os.environ | {"DASK_DISTRIBUTED__WORKER__PRELOAD": str([str(hold)])}
    reconstruct = ["reconstruct", str(source), "--product", "range"]
    with in_a_terminal(
        *reconstruct, "-o", str(store), "--workers", "2", environment=environment
    ) as process:
        while there(store) < BLOCK_FRAMES:
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        said, _ = process.communicate()
        assert process.returncode == 130
    workers = [int(each) for each in said.split()]

    assert len(workers) == 2
    for worker in workers:
        assert not Path(f"/proc/{worker}").exists()
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as local,
        distributed.Client(local) as client,
    ):
        counts = reconstruct_on(client, str(source), str(store), OPTIONS)
    assert counts == (FRAMES, BLOCK_FRAMES)
    with Recording(source) as recording:
        reconstruct_recording(recording, tmp_path / "serial.zarr", OPTIONS)
    found, serial = (
        np.asarray(zarr.open_array(f"{each}/range", mode="r"))
        for each in (store, tmp_path / "serial.zarr")
    )
    np.testing.assert_array_equal(found, serial)

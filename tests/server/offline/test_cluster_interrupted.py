"""Ctrl-C in a terminal while `transientcam reconstruct ... --workers N` computes."""

from pathlib import Path

import distributed
import numpy as np
import pytest
import zarr

from tests.interrupting import Hold, interrupt
from tests.moments.compiled_kernels import without_kernels
from tests.server.recording.made import record
from transientcam_server.offline import (
    BatchOptions,
    _job as job,
    reconstruct_on,
    reconstruct_recording,
)
from transientcam_server.offline._cluster import COUNTING, MISSING
from transientcam_server.offline._job import BLOCK_FRAMES
from transientcam_server.recording import Recording
from transientcam_server.settings import ReconstructionSettings

FRAMES = 2 * BLOCK_FRAMES + 4
# the quickest, and as it was recorded: what is held is who computes
SETTINGS = ReconstructionSettings(estimator="pisarenko", neighbours="gaussian")
OPTIONS = BatchOptions(("range",), SETTINGS)
HOLD = Hold(
    "transientcam_server.offline._cluster",
    "computed",
    f"lambda job, first, last: first >= {BLOCK_FRAMES}",  # tasks behind the first
)
pytestmark = pytest.mark.usefixtures("zarr_clients")


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
    monkeypatch.setattr(job, "load_kernels", lambda *_: None)
    source, store = record(tmp_path / "a.h5", FRAMES), tmp_path / "a.zarr"
    interrupt(
        tmp_path,
        *("reconstruct", str(source), "--product", "range", "--estimator", "pisarenko"),
        *("-o", str(store)),
        hold=HOLD,
        once=lambda: there(store) >= BLOCK_FRAMES,
    )

    with (
        without_kernels(),
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as local,
        distributed.Client(local) as client,
    ):
        counts = reconstruct_on(client, str(source), str(store), OPTIONS)
    assert counts == (FRAMES, BLOCK_FRAMES)
    with without_kernels(), Recording(source) as recording:
        reconstruct_recording(recording, tmp_path / "serial.zarr", OPTIONS)
    found, serial = (
        np.asarray(zarr.open_array(f"{each}/range", mode="r"))
        for each in (store, tmp_path / "serial.zarr")
    )
    np.testing.assert_array_equal(found, serial)

"""The files of every mode are enough for the daemon's range: by the documented formula, labels,
`transientcam.open`, and a worker, compiled or not."""

from collections.abc import Iterator
from pathlib import Path

import h5py
import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.recordings.by_hand import MODES, Mode, by_worker, differences, example, recorded
from tests.moments.compiled_kernels import kernels, without_kernels
from tests.serving import serving
from transientcam import Camera
from transientcam_moments._dispatch import KERNELS

ROUNDING_M = 1e-5
THRESHOLD_SHARE = 1e-2
"""Share of pixels in which another rounding may make another optimum the best one."""


@pytest.fixture(scope="module")
def camera(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Camera]:
    kept = {"directory": tmp_path_factory.mktemp("kept"), "min_free_bytes": 0}
    with (
        kernels(3, precisions=("float32",), names=("likelihood", "neighbours")),
        serving("sim:mirrors?seed=1", recordings=kept, reconstruction={}) as served,
        Camera(served.url, timeout_s=60.0) as opened,
    ):
        served.start_all_workers()
        yield opened


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
def test_a_file_of_every_mode_is_enough_for_the_daemons_range(
    camera: Camera, mode: Mode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(KERNELS, "enabled", False)
    ranges = recorded(camera, mode, tmp_path)

    (path,) = tmp_path.iterdir()
    with h5py.File(path) as file:
        assert file["gain"].ndim == (3 if mode.calibrated else 1)
    assert np.isfinite(ranges.daemon).mean() > 0.9
    assert np.nanmax(ranges.daemon) - np.nanmin(ranges.daemon) > 0.1
    for way in (ranges.labelled, ranges.opened, ranges.worker):
        assert_the_same(ranges.daemon, way)
    if mode.sequence.get("zeroth") == "estimated":
        # how bright a pixel is, and so which neighbours differ by no more than noise, is told by
        # the images, and not by the moments: within a third of the noise of a pixel
        assert differences(ranges.daemon, ranges.example)[0] < 1e-3
    else:
        assert_the_same(ranges.daemon, ranges.example)


def test_a_daemon_averages_neighbours_that_agree_unless_told_otherwise(camera: Camera) -> None:
    path = f"{camera.url}/api/v1/frames/latest"

    frame = httpx.get(path, params={"computed": True, "wait_s": 10.0}, timeout=60.0).json()

    assert (frame["neighbours"], frame["estimator"]) == ("edge-preserving", "likelihood")


def test_numpy_gives_the_range_of_the_compiled_kernel(
    camera: Camera, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(KERNELS, "enabled", False)
    compiled_m = recorded(camera, MODES[0], tmp_path).daemon
    (path,) = tmp_path.iterdir()
    with without_kernels():
        in_numpy_m = by_worker(path)

    assert not np.array_equal(in_numpy_m, compiled_m, equal_nan=True)
    assert_the_same(compiled_m, in_numpy_m)


def assert_the_same(range_m: NDArray[np.floating], other_m: NDArray[np.floating]) -> None:
    median_m, _, apart = differences(range_m, other_m)
    assert median_m < ROUNDING_M
    assert apart <= THRESHOLD_SHARE


def test_the_documented_example_is_short_and_needs_nothing_but_the_file() -> None:
    code = example()

    assert len(code.splitlines()) < 25
    assert code.count('"corner.h5"') == 1

"""Measured impulse responses through USB, REST and msgpack: the reference's numbers at the end."""

from pathlib import Path

import httpx
import numpy as np
import pytest

from tests.server.offline.test_measurement import composite
from tests.serving import serving
from transientcam import wire

LATEST = "/api/v1/frames/latest"
BINS = 4096


@pytest.mark.data
@pytest.mark.parametrize(
    ("harmonics", "peaks_ns"), [(3, (3.18, 9.73, 22.22)), (4, (3.07, 9.31, 21.68))]
)
def test_the_daemon_finds_three_measured_responses_where_the_reference_says(
    data_dir: Path, tmp_path: Path, harmonics: int, peaks_ns: tuple[float, ...]
) -> None:
    counts, bin_s = composite(data_dir)
    np.savez(tmp_path / "composite.npz", counts=counts, bin_s=bin_s)
    with (
        serving(f"sim:measured:{tmp_path / 'composite.npz'}?noise=off") as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as http,
    ):
        wanted = {"harmonics": harmonics, "zeroth": "on-off"}
        applied = http.put("/api/v1/sequence", json=wanted).json()
        frame = http.get(LATEST, params={"wait_s": 10.0}).json()
        while frame["sequence_id"] != applied["sequence_id"]:
            frame = http.get(LATEST, params={"wait_s": 10.0, "after": frame["frame"]}).json()
        pixel = http.get(f"{LATEST}/pixel", params={"x": 80, "y": 60, "bins": BINS}).json()
        message = wire.parse_frame(http.get(f"{LATEST}/coefficients").content)

    for h, time_s in (
        (np.array(pixel["density_per_s"]), np.array(pixel["time_s"])),
        _density(message.array[:, 30, 100], applied["base_frequency_hz"]),
    ):
        peaks = np.flatnonzero((h[1:-1] > h[:-2]) & (h[1:-1] > h[2:])) + 1
        for expected_ns in peaks_ns:
            assert np.abs(time_s[peaks] * 1e9 - expected_ns).min() < 0.05


def _density(planes: np.ndarray, f_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Eq. (2) from streamed coefficients, as any client may evaluate it."""
    a = np.concatenate([[1.0], planes[1::2] + 1j * planes[2::2]])
    time_s = np.arange(BINS) / (BINS * f_hz)
    s = np.exp(2j * np.pi * f_hz * np.outer(time_s, np.arange(a.size)))
    return planes[0] * f_hz / np.abs(s @ a.conj()) ** 2, time_s

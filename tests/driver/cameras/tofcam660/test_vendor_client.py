"""The vendor's unmodified client against the emulated camera, and our driver beside it.

`make test` installs it without its dependencies, of which this part of it needs NumPy alone.
"""

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.driver.cameras.tofcam660.conftest import VENDOR_HOST, Emulation, emulation
from tests.driver.cameras.tofcam660.vendor_client import FREE_MHZ, INTEGRATION_US, PRESETS_MHZ
from transientcam_driver import Sequence, SubPhases, TriggeredCamera
from transientcam_driver.cameras.tofcam660 import DeviceOptions, Tofcam660
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("epc") is None, reason="needs epc-tofcam-toolkit (make test has it)"
)
CLIENT = Path(__file__).with_name("vendor_client.py")


@pytest.fixture(scope="module")
def camera() -> Iterator[Emulation]:
    made = emulation(host=VENDOR_HOST, fixed_ports=True)
    yield made
    made.device.close()


@pytest.fixture(scope="module")
def theirs(camera: Emulation, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the vendor's client found."""
    output = tmp_path_factory.mktemp("vendor") / "found.npz"
    done = subprocess.run(
        [sys.executable, str(CLIENT), VENDOR_HOST, str(output)],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    with np.load(output) as found:
        return dict(found)


@pytest.fixture(scope="module")
def truth_m(theirs: dict[str, Any], camera: Emulation) -> NDArray[np.float64]:
    return camera.simulation.truth().range_m


@pytest.fixture(scope="module")
def ours(theirs: dict[str, Any], camera: Emulation) -> dict[float, NDArray[Any]]:
    """The phasors of our driver at the same frequencies, with the delay taken away."""
    options = DeviceOptions(settle_s=0.0, answer_s=60.0)  # of a machine that is slow
    with TriggeredCamera(lambda: Tofcam660(VENDOR_HOST, options)) as driver:
        delay_s = driver.capabilities.delay_s
        found = {}
        for base_hz, harmonics in ((7e6, 4), (3.5e6, 1), (0.25e6, 1)):
            sequence = Sequence(
                base_frequency_hz=base_hz,
                harmonics=harmonics,
                zeroth="estimated",
                exposure_s=INTEGRATION_US * 1e-6,
                sub_phases=SubPhases("none"),
            )
            driver.configure(sequence)
            driver.start()
            frame = driver.read_frame(timeout_s=60.0)
            for group in range(harmonics):
                dcs = frame.images[4 * group : 4 * group + 4].astype(float)
                frequency_hz = frame.labels[4 * group].frequency_hz
                turn = np.exp(-2j * np.pi * frequency_hz * delay_s)
                found[frequency_hz / 1e6] = turn * (dcs[0] - dcs[2] + 1j * (dcs[1] - dcs[3]))
    return found


def wrapped_m(difference_m: NDArray[Any], megahertz: float) -> NDArray[Any]:
    period_m = SPEED_OF_LIGHT_M_S / (2e6 * megahertz)
    return np.abs((difference_m + period_m / 2) % period_m - period_m / 2)


def radian_m(megahertz: float) -> float:
    return SPEED_OF_LIGHT_M_S / (4e6 * np.pi * megahertz)


def test_it_reads_what_the_camera_is(theirs: dict[str, Any]) -> None:
    assert tuple(theirs["chip"]) == (4242, 7)
    assert str(theirs["firmware"]) == "3.59"
    assert theirs["temperature_c"] == 25.0
    assert theirs["integration_us"] == INTEGRATION_US
    assert str(theirs["over"]) == "TCP"


@pytest.mark.parametrize("megahertz", FREE_MHZ)
def test_its_distances_are_the_truth_at_any_frequency(
    theirs: dict[str, Any], truth_m: NDArray[np.float64], megahertz: float
) -> None:
    found_m = theirs[f"free_{megahertz}_distance_mm"] / 1e3
    amplitude = theirs[f"free_{megahertz}_amplitude"]

    apart_m = wrapped_m(found_m - truth_m, megahertz)

    # two taps and their difference are rounded: each of four differences is off by 1 DN at most
    most_rad = np.sqrt(2) / amplitude
    assert (apart_m < radian_m(megahertz) * most_rad).all()
    assert np.median(apart_m) < radian_m(megahertz) * np.median(most_rad) / 2
    assert np.median(amplitude) > 300


@pytest.mark.parametrize("megahertz", FREE_MHZ)
def test_our_driver_finds_the_same(
    theirs: dict[str, Any], ours: dict[float, NDArray[Any]], megahertz: float
) -> None:
    phasor = ours[float(megahertz)]
    period_m = SPEED_OF_LIGHT_M_S / (2e6 * megahertz)
    distance_m = np.angle(phasor) / (2 * np.pi) * period_m
    found_m = theirs[f"free_{megahertz}_distance_mm"] / 1e3

    assert wrapped_m(found_m - distance_m, megahertz).max() < 2e-5 * max(1.0, period_m / 5)
    amplitude = theirs[f"free_{megahertz}_amplitude"]
    assert np.abs(amplitude - np.abs(phasor) / 2).max() < 1e-3


@pytest.mark.parametrize("megahertz", PRESETS_MHZ)
def test_presets_are_computed_by_the_camera(
    theirs: dict[str, Any], truth_m: NDArray[np.float64], megahertz: float
) -> None:
    found_m = theirs[f"preset_{megahertz}_distance_mm"] / 1e3

    assert np.median(wrapped_m(found_m - truth_m, megahertz)) < 10e-3
    assert theirs[f"preset_{megahertz}_amplitude"].min() > 10


def test_regions_arrive_over_either_way(
    theirs: dict[str, Any], truth_m: NDArray[np.float64]
) -> None:
    assert theirs["region"].shape == (60, 80)
    assert np.array_equal(theirs["region"], theirs["region_over_tcp"])
    apart_m = wrapped_m(theirs["region"] / 1e3 - truth_m[90:150, 100:180], PRESETS_MHZ[-1])
    assert np.median(apart_m) < 10e-3


def test_raw_differences_and_grayscale_have_the_light(theirs: dict[str, Any]) -> None:
    assert theirs["dcs"].shape == (4, 240, 320)
    assert np.abs(theirs["dcs"]).max() < 2048
    assert theirs["grayscale"].min() > 0


def test_a_frequency_beyond_the_limits_is_refused(theirs: dict[str, Any]) -> None:
    assert "NotAcknowledge" in str(theirs["refusal"])

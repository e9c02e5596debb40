"""The compiled pass's own tests, with a software device in the place of kernels."""

from collections.abc import Iterator
from typing import Any

import pytest

import transientcam_moments as tm
from tests.moments.gpu_devices import CountingDevice, software_device
from tests.moments.kernels.test_kernels_reconstruct import (  # noqa: F401 - collected here, too
    compiled,
    test_a_pass_gives_what_numpy_gives,
    test_a_pass_gives_what_the_stages_give,
    test_a_result_stays_as_it_is_while_later_frames_come,
    test_another_estimator_s_range_and_light_are_its_own_in_a_pass,
    test_every_order_has_its_pass,
    test_light_is_complete,
    test_moments_are_reconstructed_alike,
    test_moments_whose_density_overflows_are_flagged_alike,
    test_pixels_in_a_row_are_reconstructed_alike,
    test_saturated_pixels_can_be_given,
    test_takes_and_other_images_join_behind_the_smoothing,
)
from transientcam_moments import _gpu
from transientcam_moments._dispatch import KERNELS


@pytest.fixture(scope="module")
def device() -> Iterator[CountingDevice]:
    with software_device("llvmpipe") as found:
        yield found


@pytest.fixture(autouse=True)
def on_the_device(device: CountingDevice, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have reconstructors use the device, but for those that are to do without the pass."""
    begin = tm.Reconstructor.__init__

    def begun(made: tm.Reconstructor, *args: Any, **given: Any) -> None:
        passed = any(key.name == "reconstruct" for key in KERNELS.compiled)
        begin(made, *args, device="gpu" if passed else "cpu", **given)

    monkeypatch.setattr(_gpu, "device_of", lambda name: None if name == "cpu" else device)
    monkeypatch.setattr(tm.Reconstructor, "__init__", begun)
    before = device.frames
    yield
    assert device.frames > before
    assert device.failed == ""

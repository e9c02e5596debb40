"""The likelihood's own tests, with a software device in the place of its kernel."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.gpu_devices import CountingDevice, software_device
from tests.moments.kernels import test_kernels_likelihood as of_the_kernel
from transientcam_moments import _gpu
from transientcam_moments._dispatch import KERNELS, Key
from transientcam_moments._gpu import _kernels
from transientcam_moments._gpu._kernels import kernel_shader

M = of_the_kernel.M


@pytest.fixture(scope="module")
def device() -> Iterator[CountingDevice]:
    with software_device("llvmpipe") as found:
        yield found


@pytest.fixture
def _in_its_place(device: CountingDevice, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the device in the place of the kernel, whose signature it has."""

    def estimate(*given: Any, **_: Any) -> Any:
        return device.kernel("likelihood", M, *given)

    monkeypatch.setitem(KERNELS.compiled, Key.of("likelihood", M, "f"), estimate)
    before = device.frames
    yield
    assert device.frames > before
    assert device.failed == ""


@pytest.mark.usefixtures("_in_its_place")
class TestOfTheKernel:
    """The kernel's own tests."""

    test_odd_pixels = staticmethod(
        of_the_kernel.test_odd_pixels_are_the_same_and_leave_their_neighbours_alone
    )
    test_finds_the_same = staticmethod(
        of_the_kernel.test_the_kernel_finds_what_the_planar_statement_finds
    )


@pytest.mark.parametrize(("m", "hostile"), [(1, True), (2, False), (4, True)])
def test_likelihoods_are_right_with_the_worst_quotients_that_a_device_may_have(
    m: int, hostile: bool
) -> None:
    with software_device("llvmpipe", hostile=hostile) as another:
        assert another._check("likelihood", m).result() == ""


def test_a_device_whose_likelihood_is_spoilt_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    right = kernel_shader

    def spoilt(*args: Any, **given: Any) -> str:
        code = right(*args, **given)
        changed = code.replace("* params.width", "").replace("2.0 - b * near", "2.02 - b * near")
        assert changed != code
        return changed

    monkeypatch.setattr(_kernels, "kernel_shader", spoilt)
    with software_device("llvmpipe") as another:
        assert "computes known frames wrongly" in another._check("likelihood", 2).result()
        assert (
            another.kernel("likelihood", 2, *(each[:3] for each in _images()), 3, (3,), 0.0, 0.1)
            is None
        )


def test_a_reconstruction_has_its_likelihood_from_the_device(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    b, _ = _images()
    settings = tm.Settings(base_frequency_hz=23e6, neighbours="none")
    moments = 1000 * b.reshape(M + 1, 20, 20)
    expected = tm.Reconstructor(settings, calibration=np.ones(M + 1))(moments).likelihood
    monkeypatch.setattr(_gpu, "device_of", lambda name: device)

    found = tm.Reconstructor(settings, calibration=np.ones(M + 1), device="gpu")(moments)
    before = device.frames
    likelihood = found.likelihood

    assert device.frames == before + 1
    close = np.isclose(likelihood.average_rad, expected.average_rad, atol=1e-3, equal_nan=True)
    assert close.mean() > 0.99
    wide = b.astype(complex), np.ones(b.shape)
    assert device.kernel("likelihood", M, *wide, 3, (3,), 0.0, 0.1) is None


def _images() -> tuple[np.ndarray, np.ndarray]:
    b, noise = of_the_kernel.measured(400)
    return b, np.asarray(noise.variance)

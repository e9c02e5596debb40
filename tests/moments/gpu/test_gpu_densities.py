"""Tests of films and integrals of densities, with a software device in the place of kernels."""

from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.gpu.test_host import killed_in_it
from tests.moments.gpu_devices import CountingDevice, software_device
from tests.moments.kernels import test_kernels_compiled as of_films
from tests.moments.moment_problem import test_cumulative, test_maximum_entropy
from tests.stability import test_density as of_stability
from transientcam_moments import _gpu
from transientcam_moments._dispatch import KERNELS, Key, elsewhere
from transientcam_moments._gpu import _device, _host, _kernels
from transientcam_moments._gpu._kernels import ARRANGED, kernel_shader

ORDERS = (1, 2, 3, 4, 8)
DENSITIES = tuple(name for name in ARRANGED if name != "likelihood")


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "hostile"])
def device(request: pytest.FixtureRequest) -> Iterator[CountingDevice]:
    with software_device("llvmpipe", hostile=request.param) as found:
        yield found


@pytest.fixture
def _in_its_place(device: CountingDevice, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the device in the place of kernels, whose signatures it has."""

    def kernel(name: str, m: int) -> Any:
        return lambda *given, **_: device.kernel(name, m, *given)

    for m in ORDERS:
        monkeypatch.setitem(KERNELS.compiled, Key.of("density", m, "f"), kernel("density", m))
    before = device.frames
    yield
    assert device.frames > before
    assert device.failed == ""


@pytest.fixture
def _everywhere(device: CountingDevice, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have calls ask the device, of any number of pixels."""

    def way(name: str, m: int, *given: Any, here: Any) -> Any:
        found = device.kernel(name, m, *given)
        return here() if found is None else found

    monkeypatch.setattr(_host, "LEAST_PIXELS", 1)
    before = device.frames
    with elsewhere(way):
        yield
    assert device.frames > before
    assert device.failed == ""


@pytest.mark.usefixtures("_in_its_place")
class TestOfTheKernels:
    """The kernels' own tests."""

    @pytest.mark.parametrize("kind", of_films.PHASES)
    @pytest.mark.parametrize("phases", [1, 8, 64])
    @pytest.mark.parametrize("m", ORDERS)
    def test_films(self, m: int, phases: int, kind: str) -> None:
        of_films.test_densities_follow_the_planar_statement(m, np.complex64, phases, kind)


@pytest.mark.usefixtures("_everywhere")
class TestOfTheStatements:
    """The statements' own tests in single precision."""

    test_density = staticmethod(test_maximum_entropy.test_single_precision_stays_single_and_close)
    test_border = staticmethod(
        test_maximum_entropy.test_a_pole_at_the_border_gives_a_high_but_finite_peak
    )
    test_cumulative = staticmethod(test_cumulative.test_single_precision_is_integrated_in_double)

    def test_sparse_signals_have_their_light_at_their_returns(self) -> None:
        of_stability.light_of_sparse_signals.cache_clear()
        for case in of_stability.SPARSE:
            given: Any = case.values
            if given[1] == "float32" and given[0] <= 8:
                of_stability.test_the_density_of_a_sparse_signal_is_finite_and_its_light_at_the_returns(
                    *given
                )
        of_stability.light_of_sparse_signals.cache_clear()


@pytest.mark.parametrize("name", DENSITIES)
@pytest.mark.parametrize("m", range(1, 9))
def test_each_order_is_right(device: CountingDevice, m: int, name: str) -> None:
    assert device._check(name, m).result() == ""


@pytest.mark.parametrize("name", DENSITIES)
@pytest.mark.parametrize("m", [1, 3])
def test_another_driver_is_right(m: int, name: str) -> None:
    with software_device("SwiftShader") as another:
        assert another._check(name, m).result() == ""


@pytest.mark.parametrize("m", ORDERS)
def test_integrals_are_those_of_double_precision(device: CountingDevice, m: int) -> None:
    b = tm.bias(of_films.varied_moments(m, np.complex64)).moments
    c = tm.levinson(b)
    phase_rad = np.linspace(-7, 9, 40)

    found = device.kernel("cumulative", m, c.polynomial, c.reflection, c.error, phase_rad)

    off = np.abs(found - tm.cumulative(c, phase_rad)) / c.brightness
    assert found.dtype == np.float32
    assert off.max() < 1e-4
    assert np.quantile(off, 0.99) < 3e-6


@pytest.mark.parametrize("name", DENSITIES)
def test_pixels_without_light_or_number_disturb_no_other(
    device: CountingDevice, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    b = tm.bias(of_films.varied_moments(3, np.complex64, pixels=64)).moments
    b[:, 5], b[1, 9], b[0, 11] = 0, np.nan, np.inf
    phase_rad = np.linspace(0, 6, 7)
    calls: dict[str, Any] = {
        "density": lambda c: tm.density(c, phase_rad),
        "cumulative": lambda c: tm.cumulative(c, phase_rad),
    }
    with np.errstate(all="ignore"):
        c = tm.levinson(b)
        expected = calls[name](c)
        before = device.frames
        choice = _gpu.Choice(device, automatic=False)
        monkeypatch.setattr(device, "require", lambda m: None)
        with elsewhere(choice.kernel):
            found = calls[name](c)

    assert device.frames == before + 1
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    size = np.nanmax(np.abs(expected), axis=1, keepdims=True)
    assert np.nanmax(np.abs(found - expected) / np.maximum(size, 1e-30)) < 2e-3


def test_a_device_whose_film_is_spoilt_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    right = kernel_shader

    def spoilt(*args: Any, **given: Any) -> str:
        code = right(*args, **given)
        assert "2.0 - b * near" in code
        return code.replace("2.0 - b * near", "2.02 - b * near")

    monkeypatch.setattr(_kernels, "kernel_shader", spoilt)
    with software_device("llvmpipe") as another:
        for name in DENSITIES:
            assert "computes known frames wrongly" in another._check(name, 2).result()
        b = of_films.varied_moments(2, np.complex64)
        c = tm.levinson(b)
        assert another.kernel("density", 2, c.polynomial, c.reflection, c.error, np.ones(1)) is None


def test_a_reconstruction_has_its_films_from_its_device(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    b = of_films.varied_moments(2, np.complex64, pixels=400).reshape(3, 20, 20)
    settings = tm.Settings(estimator="pisarenko", base_frequency_hz=23e6, neighbours="none")
    time_s = np.linspace(0, 40e-9, 9)
    made = {name: tm.Reconstructor(settings, calibration=np.ones(3), device="cpu") for name in "ab"}
    monkeypatch.setattr(made["b"]._choice, "device", device)
    monkeypatch.setattr(device, "require", lambda m: None)
    here, there = (each(b) for each in made.values())
    before = device.frames

    film, light = there.density(time_s), there.cumulative(time_s)

    assert device.frames == before + 2
    assert film.shape == (9, 20, 20)
    assert np.allclose(film, here.density(time_s), rtol=1e-2)
    assert np.allclose(light, here.cumulative(time_s), atol=1e-4 * here.brightness.max())


def test_auto_races_films_once_they_are_found_right(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    c = tm.levinson(of_films.varied_moments(2, np.complex64))
    choice, checked = _gpu.Choice(device, automatic=True), Future[str]()
    monkeypatch.setitem(device._checks, ("cumulative", 2), checked)
    before = device.frames

    with elsewhere(choice.kernel):
        for _ in range(8):
            tm.cumulative(c, np.ones(3))
        assert device.frames == before
        checked.set_result("")
        for _ in range(6):
            tm.cumulative(c, np.ones(3))

    assert device.frames == before + 3


def test_calls_use_what_was_said_once(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_gpu, "CHOICE", ["cpu"])
    monkeypatch.setattr(_gpu, "device_of", lambda name: None if name == "cpu" else device)
    c = tm.levinson(of_films.varied_moments(2, np.complex64))
    before = device.frames

    try:
        tm.kernels.use_device("gpu")
        tm.density(c, np.ones(3))
    finally:
        tm.kernels.use_device("cpu")
    tm.density(c, np.ones(3))

    assert device.frames == before + 1


def test_films_that_a_device_does_not_give_are_computed_here(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    c = tm.levinson(of_films.varied_moments(2, np.complex64))
    expected = tm.density(c, np.ones(3))
    before = device.frames
    monkeypatch.setattr(device, "require", lambda m: None)
    choice = _gpu.Choice(device, automatic=False)

    with elsewhere(choice.kernel):
        none = tm.density(c, np.zeros(0))
        tm.density(c, np.ones(3))
        monkeypatch.setattr(device, "_most_bytes", 1000)
        too_large = tm.density(c, np.ones(3))
        monkeypatch.undo()
        monkeypatch.setattr(device, "require", lambda m: None)
        monkeypatch.setattr(_device, "run", killed_in_it)
        killed = tm.density(c, np.ones(3))
        monkeypatch.undo()
        again = tm.density(c, np.ones(3))

    assert none.shape == (0, 1003)
    assert device.frames == before + 2
    assert np.array_equal(too_large, expected)
    assert np.array_equal(killed, expected)
    assert np.allclose(again, expected, rtol=1e-3)

"""Files of tal and arrays of mitransient, written as these write them (not by them)."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from transientcam.cli import run
from transientcam_server.errors import InputError
from transientcam_server.offline import load_measurement

F_HZ = 20e6
LIGHT_M_S = 299_792_458.0
START_M, BIN_M = 2.0, 0.25
ROWS, COLUMNS, BINS = 2, 3, 8
H_FORMATS = {"UNKNOWN": 0, "T_Sx_Sy": 1, "T_Lx_Ly_Sx_Sy": 2, "T_Si": 3, "T_Li_Si": 4}


def of_tal(path: Path, response: Any, *, form: int = 1, **changes: Any) -> Path:
    """Write as tal does: enumerations have the shape (1,), and Empty stands for None."""
    values = {"H": response, "t_start": START_M, "delta_t": BIN_M, "sensor_xyz": np.zeros(3)}
    with h5py.File(path, "w") as file:
        for name, value in (values | changes).items():
            file[name] = h5py.Empty(float) if value is None else value
        kind = h5py.enum_dtype(H_FORMATS, basetype="i")
        file.create_dataset("H_format", (1,), dtype=kind)[0] = form
        file["scene_info"] = "{}"
    return path


def single_returns() -> tuple[Any, Any]:
    """A response (T, x, y) with one return of weight 1 + x + 10 y in bin x + 2 y, and its times."""
    response = np.zeros((BINS, COLUMNS, ROWS), np.float32)
    time_s = np.zeros((ROWS, COLUMNS))
    for x in range(COLUMNS):
        for y in range(ROWS):
            response[x + 2 * y, x, y] = 1 + x + 10 * y
            time_s[y, x] = (START_M + BIN_M * (x + 2 * y)) / LIGHT_M_S
    return response, time_s


def assert_moments(moments: Any, time_s: Any) -> None:
    """Hold moments against b_j = weight exp(2 pi i j f t), row by row."""
    y, x = np.indices((ROWS, COLUMNS))
    orders = np.arange(len(moments))[:, None, None]
    expected = (1 + x + 10 * y) * np.exp(2j * np.pi * F_HZ * orders * time_s)
    np.testing.assert_allclose(moments, expected, rtol=1e-6)


@pytest.mark.parametrize("packing", [{}, {"compression": "gzip"}], ids=["plain", "packed"])
def test_a_response_of_tal_is_read_with_rows_along_y(
    tmp_path: Path, packing: dict[str, str]
) -> None:
    response, time_s = single_returns()
    path = of_tal(tmp_path / "wall.hdf5", response)
    if packing:
        with h5py.File(path, "r+") as file:
            del file["H"]
            file.create_dataset("H", data=response, chunks=response.shape, **packing)

    measured = load_measurement(path, frequency_hz=F_HZ, harmonics=3)

    assert_moments(measured.moments, time_s)


def test_points_of_tal_without_a_grid_are_one_row(tmp_path: Path) -> None:
    path = of_tal(tmp_path / "points.hdf5", np.ones((BINS, 5), np.float32), form=3)

    assert load_measurement(path).moments.shape[1:] == (1, 5)


@pytest.mark.parametrize("channels", [None, 1, 3])
def test_what_mitransient_renders_lies_in_the_middle_of_its_bins(
    tmp_path: Path, channels: int | None
) -> None:
    response, time_s = single_returns()
    transient = np.moveaxis(response, (0, 1, 2), (2, 1, 0))
    if channels is not None:
        # channels that differ, of the same mean
        tint = np.linspace(0.5, 1.5, channels) if channels > 1 else np.ones(1)
        transient = transient[..., None] * tint.astype(np.float32)
    path = tmp_path / "render.npz"
    np.savez(path, transient=transient, start_opl=START_M, bin_width_opl=BIN_M)

    measured = load_measurement(path, frequency_hz=F_HZ, harmonics=3)

    assert_moments(measured.moments, time_s + 0.5 * BIN_M / LIGHT_M_S)


@pytest.mark.parametrize(
    ("response", "changes", "key"),
    [
        (np.ones((4, 2, 2, 2, 2), np.float32), {"form": 2}, "H"),
        (np.ones((4, 2, 2), np.float32), {"form": 4}, "H"),
        (np.full((4, 2, 2), np.nan, np.float32), {}, "H"),
        (np.ones((4, 2, 2), np.float32), {"t_start": None}, "t_start"),
        (np.ones((4, 2, 2), np.float32), {"delta_t": 0.0}, "delta_t"),
        (np.ones((4, 2, 2), np.float32), {"delta_t": "wide"}, "content"),
    ],
)
def test_a_file_of_tal_that_cannot_be_used_names_itself_and_the_key(
    tmp_path: Path, response: Any, changes: dict[str, Any], key: str
) -> None:
    path = of_tal(tmp_path / "wall.hdf5", response, **changes)

    with pytest.raises(InputError, match=r"wall\.hdf5") as caught:
        load_measurement(path)

    assert caught.value.key == key


def test_a_response_that_lies_in_another_file_is_not_followed(tmp_path: Path) -> None:
    of_tal(tmp_path / "other.hdf5", np.ones((4, 2, 2), np.float32))
    path = of_tal(tmp_path / "wall.hdf5", np.ones((4, 2, 2), np.float32))
    with h5py.File(path, "r+") as file:
        del file["H"]
        file["H"] = h5py.ExternalLink("other.hdf5", "H")

    with pytest.raises(InputError, match="link"):
        load_measurement(path)


@pytest.mark.parametrize("shape", [(2, 2), (2, 2, 4, 9)])
def test_an_array_that_is_no_transient_image_is_refused(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    path = tmp_path / "render.npz"
    np.savez(path, transient=np.ones(shape), start_opl=0.0, bin_width_opl=0.1)

    with pytest.raises(InputError) as caught:
        load_measurement(path)

    assert caught.value.key == "transient"


def test_the_command_tells_a_file_of_tal_from_a_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    response, time_s = single_returns()
    path = of_tal(tmp_path / "wall.hdf5", response)
    words = ["reconstruct", str(path), "-o", str(tmp_path / "cube.npz"), "--bins", "8"]

    assert run([*words, "--frequency-hz", "20e6"]) == 0

    with np.load(tmp_path / "cube.npz") as cube:
        # the biasing towards a uniform part moves a single return by nothing
        np.testing.assert_allclose(cube["range_m"], LIGHT_M_S * time_s / 2, rtol=1e-3)

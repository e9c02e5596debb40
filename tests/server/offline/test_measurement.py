import subprocess
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from numpy.typing import NDArray

from tests.programs import needs_octave
from transientcam_server.errors import InputError
from transientcam_server.offline import (
    Measurement,
    TransientCube,
    load_measurement,
    reconstruct_measurement,
    save_cube,
)
from transientcam_server.offline._measurement import moments_of
from transientcam_server.settings import ReconstructionSettings

F_HZ = 23e6
LIGHT_M_S = 299_792_458.0
GOOD: dict[str, Any] = {"moments": np.ones((4, 2, 2), dtype=complex), "base_frequency_hz": F_HZ}
PLAIN = ReconstructionSettings(smoothing_px=0.0, estimator="pisarenko")


def written(path: Path, **arrays: Any) -> Path:
    np.savez(path, **arrays)
    return path


def moments_of_returns(
    delays_s: list[float], weights: list[float], *, uniform: float, harmonics: int
) -> NDArray[np.complex128]:
    """Moments of sharp returns and a uniform part, by their definition; shape (m+1, 1, 1)."""
    b = [
        sum(w * np.exp(2j * np.pi * F_HZ * j * t) for t, w in zip(delays_s, weights, strict=True))
        for j in range(harmonics + 1)
    ]
    b[0] += uniform
    return np.array(b).reshape(-1, 1, 1)


def dense_density(b: NDArray[np.complex128], time_s: NDArray[Any]) -> NDArray[np.float64]:
    """Theorem 1 by a dense solve: h = e' B^-1 e / (2 pi |s* B^-1 e_0|^2), per second."""
    size = len(b)
    matrix = np.array([[b[j - k] if j >= k else b[k - j].conj() for k in range(size)]
                       for j in range(size)])  # fmt: skip
    first = np.linalg.solve(matrix, np.eye(size)[0])
    phase = 2.0 * np.pi * F_HZ * time_s
    s = np.exp(1j * np.outer(phase, np.arange(size)))
    h = first[0].real / (2.0 * np.pi * np.abs(s.conj() @ first) ** 2)
    return np.asarray(2.0 * np.pi * F_HZ * h)


def test_moments_of_an_impulse_response_follow_from_their_definition() -> None:
    time_s = np.arange(5) * 3e-9
    response = np.array([[[0.0, 2.0, 0.0, 1.0, 0.0]]])

    b = moments_of(response, time_s, frequency_hz=F_HZ, harmonics=3)

    expected = moments_of_returns([3e-9, 9e-9], [2.0, 1.0], uniform=0.0, harmonics=3)
    np.testing.assert_allclose(b, expected, atol=1e-12)


def test_returns_range_and_density_match_closed_form_and_dense_solve() -> None:
    delays_s, weights = [11.3e-9, 19.3e-9, 26.7e-9], [5.0, 3.0, 2.0]
    b = moments_of_returns(delays_s, weights, uniform=0.5, harmonics=3)

    result = reconstruct_measurement(Measurement(b, F_HZ), bins=200, settings=PLAIN)

    np.testing.assert_allclose(result.range_m, LIGHT_M_S * delays_s[0] / 2.0, rtol=1e-9)
    np.testing.assert_allclose(result.direct, 5.0, rtol=1e-8)
    np.testing.assert_allclose(result.indirect, 5.0, rtol=1e-8)
    np.testing.assert_allclose(result.uniform, 0.5, rtol=1e-8)
    np.testing.assert_allclose(
        result.density[:, 0, 0], dense_density(b[:, 0, 0], result.time_s), rtol=1e-9
    )
    assert result.flags[0, 0] == 0


def test_the_cumulative_density_is_the_integral_of_the_density() -> None:
    b = moments_of_returns([8e-9, 20e-9], [2.0, 1.0], uniform=1.0, harmonics=4)

    result = reconstruct_measurement(Measurement(b, F_HZ), bins=20_000, settings=PLAIN)

    step_s = result.time_s[1]
    h = result.density[:, 0, 0]
    integral = np.concatenate([[0.0], np.cumsum((h[1:] + h[:-1]) / 2.0) * step_s])
    np.testing.assert_allclose(result.cumulative[:, 0, 0], integral, atol=1e-5)


def test_one_broken_pixel_is_flagged_and_leaves_the_others_as_they_are() -> None:
    b = np.tile(moments_of_returns([8e-9], [2.0], uniform=0.2, harmonics=3), (1, 4, 5))
    healthy = reconstruct_measurement(Measurement(b, F_HZ), bins=16, settings=PLAIN)
    b[2, 1, 3] = np.nan

    result = reconstruct_measurement(Measurement(b, F_HZ), bins=16, settings=PLAIN)

    others = np.ones((4, 5), dtype=bool)
    others[1, 3] = False
    assert result.flags[1, 3] == 8
    assert (result.flags[others] == 0).all()
    np.testing.assert_array_equal(result.density[:, others], healthy.density[:, others])
    np.testing.assert_array_equal(result.range_m[others], healthy.range_m[others])
    assert np.isnan(result.range_m[1, 3])


def test_progress_counts_every_pixel_once() -> None:
    b = np.tile(moments_of_returns([8e-9], [2.0], uniform=0.2, harmonics=2), (1, 70, 90))
    reported: list[tuple[int, int]] = []

    reconstruct_measurement(
        Measurement(b, F_HZ), bins=512, settings=PLAIN, progress=lambda *each: reported.append(each)
    )

    done = [each[0] for each in reported]
    assert len(done) > 1
    assert done == sorted(set(done))
    assert reported[-1] == (6300, 6300)


def test_moments_in_a_file_keep_their_frequency_and_may_lose_harmonics(tmp_path: Path) -> None:
    b = moments_of_returns([8e-9], [2.0], uniform=0.2, harmonics=5)
    file = written(tmp_path / "a.npz", moments=b, base_frequency_hz=F_HZ)

    measurement = load_measurement(file, harmonics=3)

    assert measurement.base_frequency_hz == F_HZ
    assert measurement.harmonics == 3
    np.testing.assert_array_equal(measurement.moments, b[:4])


def test_moments_of_a_single_pixel_are_an_image_of_one(tmp_path: Path) -> None:
    file = written(tmp_path / "a.npz", moments=np.ones(4) + 0j, base_frequency_hz=F_HZ)

    assert load_measurement(file).moments.shape == (4, 1, 1)


def test_a_cube_is_read_along_its_optical_path_length(tmp_path: Path) -> None:
    h = np.zeros((2, 3, 50), dtype=np.float16)
    h[1, 2, 10] = 4.0
    file = written(tmp_path / "a.npz", h=h, start_opl_m=1.5, bin_opl_m=0.05)

    b = load_measurement(file, frequency_hz=F_HZ, harmonics=3).moments

    delay_s = (1.5 + 10 * 0.05) / LIGHT_M_S
    expected = moments_of_returns([delay_s], [4.0], uniform=0.0, harmonics=3)
    np.testing.assert_allclose(b[:, 1, 2], expected[:, 0, 0], rtol=1e-9)
    assert b[0, 0, 0] == 0.0


def test_counts_of_many_pixels_are_an_image(tmp_path: Path) -> None:
    meas = np.zeros((2, 3, 64), dtype=np.uint16)
    meas[1, 2, 7] = 5
    file = written(tmp_path / "a.npz", meas=meas, bin_s=16e-12)

    b = load_measurement(file, frequency_hz=F_HZ, harmonics=2).moments

    expected = moments_of_returns([7.5 * 16e-12], [5.0], uniform=0.0, harmonics=2)
    np.testing.assert_allclose(b[:, 1, 2], expected[:, 0, 0], rtol=1e-9)


def test_photons_that_lie_evenly_in_their_bin_are_not_taken_for_early(tmp_path: Path) -> None:
    bin_s, early_s = 250e-12, 3.1e-9
    times_s = early_s + bin_s * np.random.default_rng(1).random(10_000) * 4
    counts, _ = np.histogram(times_s, bins=np.arange(65) * bin_s)
    file = written(tmp_path / "a.npz", counts=counts, bin_s=bin_s)

    b = load_measurement(file, frequency_hz=F_HZ, harmonics=1).moments[1, 0, 0]

    mean_s = np.angle(b) / (2 * np.pi * F_HZ)
    assert mean_s == pytest.approx(times_s.mean(), abs=0.02 * bin_s)


@pytest.mark.parametrize("vector", [False, True])
def test_arrays_of_matlab_are_turned_back(tmp_path: Path, vector: bool) -> None:
    meas = np.zeros((2, 3, 64))
    meas[1, 2, 7] = meas[0, 1, 9] = 5
    name, array = ("counts", meas[1, 2][None]) if vector else ("meas", meas)
    file = tmp_path / "a.mat"
    with h5py.File(file, "w", userblock_size=512) as opened:
        opened[name], opened["bin_s"] = array.T, np.array([[16e-12]])
    with file.open("r+b") as opened:
        opened.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    plain = written(tmp_path / "a.npz", **{name: meas[1, 2] if vector else meas}, bin_s=16e-12)

    np.testing.assert_array_equal(load_measurement(file).moments, load_measurement(plain).moments)


@pytest.mark.parametrize("form", ["5", "4", "7.3"])
def test_moments_and_counts_of_any_matlab_are_read(tmp_path: Path, form: str) -> None:
    b = np.tile(moments_of_returns([8e-9], [2.0], uniform=0.2, harmonics=3), (1, 2, 3))
    b[:, 1, 2] *= 3.0
    file, plain = tmp_path / "a.mat", b
    if form == "7.3":
        with h5py.File(file, "w", userblock_size=512) as opened:
            pairs = np.empty(b.T.shape, [("real", "<f8"), ("imag", "<f8")])
            pairs["real"], pairs["imag"] = b.T.real, b.T.imag
            opened["moments"], opened["base_frequency_hz"] = pairs, np.array([[F_HZ]])
        with file.open("r+b") as opened:
            opened.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    elif form == "5":
        scipy.io.savemat(file, {"moments": b, "base_frequency_hz": F_HZ, "note": "of us"})
    else:  # what has no header, has no name of its version
        plain = b[:, :1, :1]
        scipy.io.savemat(file, {"moments": plain[:, 0, 0], "base_frequency_hz": F_HZ}, format="4")

    measurement = load_measurement(file)

    np.testing.assert_array_equal(measurement.moments, plain)
    assert measurement.base_frequency_hz == F_HZ


@pytest.mark.parametrize(
    "content", [b"# Created by Octave 7.3.0, Mon", b"Octave-1-L\0", b"MATLAB 5.0 MAT-file, cut"]
)
def test_files_of_octave_alone_and_cut_ones_are_named(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "a.mat"
    file.write_bytes(content)

    with pytest.raises(InputError, match=r"a\.mat: content is (in a format of Octave|unreadable)"):
        load_measurement(file)


@needs_octave
def test_what_octave_writes_is_read_or_named(tmp_path: Path) -> None:
    program = """moments = complex(reshape(1:24, 2, 3, 4), 2); moments(1, :, :) = 99;
        base_frequency_hz = 23e6;
        for each = {'-v7', '-v6', '-text', '-binary', '-hdf5', '-float-hdf5', '-zip'}
            save(each{1}, [each{1}(2:end) '.mat'], 'moments', 'base_frequency_hz');
        end"""
    subprocess.run(
        ["octave-cli", "--quiet", "--norc", "--eval", program],
        cwd=tmp_path,
        check=True,
        timeout=600,
    )
    expected = np.arange(1, 25).reshape(2, 3, 4, order="F") + 2j
    expected[0] = 99

    for readable in ("v7", "v6"):
        found = load_measurement(tmp_path / f"{readable}.mat")
        np.testing.assert_array_equal(found.moments, expected)
        assert found.base_frequency_hz == 23e6
    for refused in ("text", "binary", "hdf5", "float-hdf5", "zip"):
        with pytest.raises(InputError, match=r"\.mat: content is .*`save -v7`"):
            load_measurement(tmp_path / f"{refused}.mat")


def test_hdf5_of_others_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["moments"] = np.ones((3, 2, 2))

    with pytest.raises(InputError, match="content is in HDF5, but not of tal or MATLAB"):
        load_measurement(tmp_path / "a.h5")


def test_a_file_of_other_arrays_says_which(tmp_path: Path) -> None:
    file = tmp_path / "a.mat"
    scipy.io.savemat(file, {"data": np.ones(3), "t": 1.0})

    with pytest.raises(InputError, match="content is data, t, but must be moments, counts"):
        load_measurement(file)


COUNTS = np.ones((4, 5, 900))


@pytest.mark.parametrize(
    ("arrays", "key", "said"),
    [
        ({"meas": COUNTS, "bin_s": 16.0}, "bin_s", "16 s, but must be from 1e-15 to 5.43e-09 s"),
        ({"meas": COUNTS, "bin_s": 16e-18}, "bin_s", "1.6e-17 s"),
        ({"h": COUNTS, "start_opl_m": 0.0, "bin_opl_m": 3.0}, "bin_opl_m", "3 m, but .* 1.63 m"),
        ({"h": COUNTS, "start_opl_m": 1e6, "bin_opl_m": 0.003}, "start_opl_m", "within 0.001 s"),
        ({"meas": COUNTS.T, "bin_s": 16e-12}, "meas", r"4 bins, 6.4e-11 s .* \(H, W, n_bins\)"),
        (GOOD | {"base_frequency_hz": 23.0}, "base_frequency_hz", "23 Hz, but .* 1000 Hz"),
        (GOOD | {"moments": 1j * GOOD["moments"]}, "moments", "without a b_0 in 100%"),
        (GOOD | {"moments": np.arange(4.0)[:, None, None] + GOOD["moments"]}, "moments", "b_0"),
    ],
)
def test_what_physics_excludes_is_refused_with_its_numbers(
    tmp_path: Path, arrays: dict[str, Any], key: str, said: str
) -> None:
    file = written(tmp_path / "a.npz", **arrays)

    with pytest.raises(InputError, match=said) as caught:
        load_measurement(file)

    assert caught.value.key == key


def test_coarse_bins_of_a_flash_lidar_are_read(tmp_path: Path) -> None:
    file = written(tmp_path / "a.npz", meas=np.ones((480, 64, 16)), bin_s=2e-9)

    assert load_measurement(file).moments.shape == (5, 480, 64)


def test_the_background_of_photon_counts_is_removed_where_that_is_wanted(tmp_path: Path) -> None:
    counts = np.full(1000, 7, dtype=np.uint32)
    counts[100] = 107
    file = written(tmp_path / "a.npz", counts=counts, bin_s=8e-12)

    without = load_measurement(file, background="median").moments[0, 0, 0]
    with_ = load_measurement(file).moments[0, 0, 0]

    assert without == pytest.approx(100.0)
    assert with_ == pytest.approx(7100.0)


@pytest.mark.parametrize(
    ("arrays", "key"),
    [
        ({}, "content"),
        ({"something": np.ones(3)}, "content"),
        ({"moments": GOOD["moments"]}, "base_frequency_hz"),
        (GOOD | {"base_frequency_hz": np.nan}, "base_frequency_hz"),
        (GOOD | {"base_frequency_hz": -1.0}, "base_frequency_hz"),
        (GOOD | {"base_frequency_hz": np.ones(2)}, "base_frequency_hz"),
        (GOOD | {"base_frequency_hz": "fast"}, "base_frequency_hz"),
        (GOOD | {"moments": np.ones((4, 2), dtype=complex)}, "moments"),
        (GOOD | {"moments": np.ones((1, 2, 2), dtype=complex)}, "moments"),
        (GOOD | {"moments": np.ones((40, 2, 2), dtype=complex)}, "moments"),
        (GOOD | {"moments": np.ones((4, 0, 2), dtype=complex)}, "moments"),
        (GOOD | {"moments": np.full((4, 2, 2), np.nan)}, "moments"),
        (GOOD | {"moments": np.array([["a"]])}, "moments"),
        (GOOD | {"moments": np.full((4, 2, 2), "a")}, "moments"),
        ({"counts": np.ones(9)}, "bin_s"),
        ({"counts": np.ones(9), "bin_s": 0.0}, "bin_s"),
        ({"counts": np.ones((3, 3)), "bin_s": 1e-9}, "counts"),
        ({"counts": np.array([1.0, np.nan]), "bin_s": 1e-9}, "counts"),
        ({"h": np.ones((2, 2, 4)), "bin_opl_m": 0.1}, "start_opl_m"),
        ({"h": np.ones((2, 2, 4)), "start_opl_m": 0.0}, "bin_opl_m"),
        ({"h": np.ones((2, 4)), "start_opl_m": 0.0, "bin_opl_m": 0.1}, "h"),
        ({"h": np.full((2, 2, 4), np.nan), "start_opl_m": 0.0, "bin_opl_m": 0.1}, "h"),
    ],
)
def test_a_file_that_cannot_be_used_names_itself_and_the_key(
    tmp_path: Path, arrays: dict[str, Any], key: str
) -> None:
    file = written(tmp_path / "bad.npz", **arrays)

    with pytest.raises(InputError) as caught:
        load_measurement(file)

    assert caught.value.key == key
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04broken", b"just text", b"\x93NUMPY"])
def test_a_file_that_is_no_npz_is_named(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "bad.npz"
    file.write_bytes(content)

    with pytest.raises(InputError, match=r"bad\.npz"):
        load_measurement(file)


def test_a_file_with_pickled_objects_is_refused_unread(tmp_path: Path) -> None:
    file = written(tmp_path / "bad.npz", moments=np.array([{"a": 1}], dtype=object))

    with pytest.raises(InputError, match="content"):
        load_measurement(file)


def test_a_single_array_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.npy"
    np.save(file, np.ones(3))

    with pytest.raises(InputError, match="single array"):
        load_measurement(file)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"frequency_hz": 5e6}, "--frequency-hz"),
        ({"harmonics": 4}, "--harmonics"),
        ({"harmonics": 0}, "--harmonics"),
    ],
)
def test_moments_cannot_be_had_at_another_frequency_or_with_more_harmonics(
    tmp_path: Path, options: dict[str, Any], name: str
) -> None:
    file = written(tmp_path / "a.npz", **GOOD)

    with pytest.raises(InputError, match=name):
        load_measurement(file, **options)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"frequency_hz": float("nan")}, "--frequency-hz"),
        ({"frequency_hz": -1.0}, "--frequency-hz"),
        ({"harmonics": 33}, "--harmonics"),
    ],
)
def test_impulse_responses_are_measured_only_with_modulations_that_exist(
    tmp_path: Path, options: dict[str, Any], name: str
) -> None:
    file = written(tmp_path / "a.npz", counts=np.ones(9), bin_s=1e-9)

    with pytest.raises(InputError, match=name):
        load_measurement(file, **options)


def test_what_is_saved_is_complete_and_leaves_no_part_behind(tmp_path: Path) -> None:
    b = np.tile(moments_of_returns([8e-9], [2.0], uniform=0.2, harmonics=3), (1, 2, 3))
    result = reconstruct_measurement(Measurement(b, F_HZ), bins=10, settings=PLAIN)

    save_cube(tmp_path / "out.npz", result)

    assert [each.name for each in tmp_path.iterdir()] == ["out.npz"]
    with np.load(tmp_path / "out.npz") as file:
        assert set(file) == set(TransientCube.__slots__)
        assert file["density"].shape == file["cumulative"].shape == (10, 2, 3)
        assert file["time_s"].shape == (10,)
        for name in ("range_m", "direct", "indirect", "uniform", "flags"):
            np.testing.assert_array_equal(file[name], getattr(result, name))


def composite(data_dir: Path) -> tuple[NDArray[np.float64], float]:
    """0.55 direct at 3 ns + 0.30 behind 1.0 inch at 9 ns + 0.5 behind 3.0 inch of foam at 20 ns.

    Wrapped to one period of 23 MHz, as the modulated camera sees it.
    """
    total, bin_s, peak = np.zeros(0), 0.0, 0
    for name, weight, delay_s in (
        ("direct", 0.55, 3e-9),
        ("1_0_inch", 0.30, 9e-9),
        ("3_0_inch", 0.5, 20e-9),
    ):
        with np.load(data_dir / "measured" / f"capture_{name}.npz") as file:
            counts, bin_s = file["counts"].astype(float), float(file["bin_s"])
        if not total.size:
            total, peak = np.zeros(round(1.0 / (F_HZ * bin_s))), int(np.argmax(counts))
        counts = np.maximum(counts - np.median(counts), 0.0)
        bins = np.arange(counts.size) - peak + round(delay_s / bin_s)
        np.add.at(total, bins % total.size, weight * counts / counts.sum())
    return total, bin_s


@pytest.mark.data
@pytest.mark.parametrize(
    ("harmonics", "peaks_ns"), [(3, (3.18, 9.73, 22.22)), (4, (3.07, 9.31, 21.68))]
)
def test_three_measured_responses_are_resolved_where_the_reference_says(
    data_dir: Path, tmp_path: Path, harmonics: int, peaks_ns: tuple[float, ...]
) -> None:
    counts, bin_s = composite(data_dir)
    file = written(tmp_path / "composite.npz", counts=counts, bin_s=bin_s)
    measurement = load_measurement(file, frequency_hz=F_HZ, harmonics=harmonics)

    result = reconstruct_measurement(measurement, bins=8192, settings=PLAIN)

    h = result.density[:, 0, 0]
    peaks = np.flatnonzero((h[1:-1] > h[:-2]) & (h[1:-1] > h[2:])) + 1
    for expected_ns in peaks_ns:
        assert np.abs(result.time_s[peaks] * 1e9 - expected_ns).min() < 0.05


@pytest.mark.data
def test_a_rendered_box_is_as_deep_as_its_first_light_says(data_dir: Path) -> None:
    file = data_dir / "rendered" / "mitransient_cornell_163x120x300.npz"
    with np.load(file) as arrays:
        h, start_m, bin_m = arrays["h"], float(arrays["start_opl_m"]), float(arrays["bin_opl_m"])
    light = h.sum(axis=-1, dtype=float)
    lit = light > 0.1 * np.median(light[light > 0.0])
    first = np.argmax(h > 0.2 * h.max(axis=-1, keepdims=True), axis=-1)

    result = reconstruct_measurement(
        load_measurement(file, frequency_hz=F_HZ, harmonics=8), bins=8, settings=PLAIN
    )

    error_m = np.abs(result.range_m - (start_m + first * bin_m) / 2.0)[lit]
    assert lit.sum() > 10_000
    assert np.median(error_m) < 0.04

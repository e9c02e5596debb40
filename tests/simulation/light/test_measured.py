"""Impulse responses from files, against plain sums over their bins."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import SceneError, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.light import load_responses
from transientcam_simulation.light._measured import area_weights
from transientcam_simulation.scene import BUILT_IN, Light, ResponseFile, Scene, load_scene

C = 299_792_458.0
WIDTH, HEIGHT = 8, 6


def scene(*responses: ResponseFile) -> Scene:
    light = Light(1e7, np.zeros(3), np.zeros(3), 0.0)
    return Scene("m", "", None, light, responses=responses)


def counts_file(folder: Path, counts: Any, bin_s: float = 1e-10, name: str = "counts.npz") -> Path:
    path = folder / name
    np.savez(path, counts=np.array(counts), bin_s=bin_s)
    return path


def naive_moment(counts: list[float], bin_s: float, shift_s: float, f_hz: float) -> complex:
    total = sum(counts)
    angles = [2 * math.pi * f_hz * ((k + 0.5) * bin_s + shift_s) for k in range(len(counts))]
    return sum(
        n / total * complex(math.cos(a), math.sin(a)) for n, a in zip(counts, angles, strict=True)
    )


def test_one_response_fills_all_pixels_with_its_discrete_fourier_transform(tmp_path: Path) -> None:
    counts = [0.0, 3.0, 10.0, 4.0, 1.0, 0.0]
    file = ResponseFile(counts_file(tmp_path, counts), weight=0.7, delay_s=5e-9)

    moments = load_responses(scene(file), width=WIDTH, height=HEIGHT).moments(23e6)

    assert moments.shape == (HEIGHT, WIDTH)
    assert moments == pytest.approx(
        np.full((HEIGHT, WIDTH), 0.7 * naive_moment(counts, 1e-10, 5e-9, 23e6))
    )


def test_the_median_is_taken_for_background_and_nothing_falls_below_zero(tmp_path: Path) -> None:
    path = counts_file(tmp_path, [5, 4, 5, 105, 55, 5, 6])
    file = ResponseFile(path, background="median")

    time_s, density = load_responses(scene(file), width=2, height=2).of_pixel(0, 0)

    assert density * 1e-10 == pytest.approx(np.array([0, 0, 0, 100, 50, 0, 1]) / 151, abs=1e-6)
    assert time_s == pytest.approx((np.arange(7) + 0.5) * 1e-10)


@pytest.mark.parametrize(
    ("choice", "zero_s"),
    [({}, 0.0), ({"time_zero": "peak"}, 2.5e-10), ({"time_zero_s": 7e-10}, 7e-10)],
)
def test_time_zero_begins_the_first_bin_or_is_the_peak_or_a_time(
    tmp_path: Path, choice: dict[str, Any], zero_s: float
) -> None:
    counts = [0.0, 1.0, 9.0, 2.0]
    file = replace(ResponseFile(counts_file(tmp_path, counts)), **choice)

    moment = load_responses(scene(file), width=1, height=1).moments(500e6)[0, 0]

    assert moment == pytest.approx(naive_moment(counts, 1e-10, -zero_s, 500e6), rel=1e-6)


def test_time_zero_may_be_the_peak_of_another_file(tmp_path: Path) -> None:
    counts = [1.0, 2.0, 1.0]
    other = counts_file(tmp_path, [0, 0, 0, 0, 8, 1], name="other.npz")
    file = ResponseFile(counts_file(tmp_path, counts), time_zero_file=other)

    moment = load_responses(scene(file), width=1, height=1).moments(500e6)[0, 0]

    assert moment == pytest.approx(naive_moment(counts, 1e-10, -4.5e-10, 500e6), rel=1e-6)


def test_responses_add_up_and_each_is_a_return_of_the_truth(tmp_path: Path) -> None:
    near = ResponseFile(counts_file(tmp_path, [0, 4, 0]), weight=0.5, delay_s=9e-9)
    far = ResponseFile(counts_file(tmp_path, [0, 4, 0]), weight=0.2, delay_s=3e-9)

    responses = load_responses(scene(near, far), width=WIDTH, height=HEIGHT)
    delay_s, weight = responses.returns()

    assert delay_s[:, 0, 0] == pytest.approx([3.15e-9, 9.15e-9])
    assert weight[:, 0, 0] == pytest.approx([0.2, 0.5])
    assert responses.moments(0.0) == pytest.approx(np.full((HEIGHT, WIDTH), 0.7))


def test_without_normalisation_counts_are_brightness(tmp_path: Path) -> None:
    file = ResponseFile(counts_file(tmp_path, [1, 2, 3]), normalise=False, weight=2.0)

    assert load_responses(scene(file), width=1, height=1).moments(0.0)[0, 0] == pytest.approx(12)


def test_optical_path_length_becomes_time(tmp_path: Path) -> None:
    cube = np.zeros((HEIGHT, WIDTH, 5))
    cube[..., 2] = 1.0
    path = tmp_path / "cube.npz"
    np.savez(path, h=cube, start_opl_m=3.0, bin_opl_m=0.02)

    delay_s, weight = load_responses(
        scene(ResponseFile(path)), width=WIDTH, height=HEIGHT
    ).returns()

    assert delay_s[0] == pytest.approx(np.full((HEIGHT, WIDTH), 3.04 / C))
    assert weight[0] == pytest.approx(np.ones((HEIGHT, WIDTH)))


def test_a_cube_at_the_sensors_resolution_is_taken_pixel_by_pixel(tmp_path: Path) -> None:
    cube = np.random.default_rng(1).random((HEIGHT, WIDTH, 9)).astype(np.float32)
    path = tmp_path / "cube.npz"
    np.savez(path, meas=cube, bin_s=2e-10)

    responses = load_responses(
        scene(ResponseFile(path, normalise=False)), width=WIDTH, height=HEIGHT
    )

    phasors = np.exp(2j * np.pi * 70e6 * 2e-10 * (np.arange(9) + 0.5))
    assert responses.moments(70e6) == pytest.approx((cube * phasors).sum(axis=-1), rel=1e-5)
    _, density = responses.of_pixel(3, 2)
    assert density * 2e-10 == pytest.approx(cube[2, 3], rel=1e-5)


def test_first_return_of_a_cube_is_its_first_peak_with_the_mass_of_its_lobe(tmp_path: Path) -> None:
    responses_ = [
        [0.0, 0.0, 8.0, 2.0, 1.0, 3.0, 3.5, 1.0],  # peak, valley, tail
        [0.2, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0],  # a speck below a tenth, one peak
        [0.0] * 8,
    ]
    path = tmp_path / "cube.npz"
    np.savez(path, meas=np.array([responses_]), bin_s=1e-9)

    delay_s, weight = load_responses(
        scene(ResponseFile(path, normalise=False)), width=3, height=1
    ).returns()

    assert delay_s[0, 0, :2] == pytest.approx([2.5e-9, 4.5e-9])
    assert weight[0, 0] == pytest.approx([11.0, 5.2, 0.0])
    assert (delay_s[1, 0, 0], weight[1, 0, 0]) == pytest.approx((6.5e-9, 7.5))
    assert np.isnan(delay_s[:, 0, 2]).all()


def naive_area(image: NDArray[np.float64], height: int, width: int) -> NDArray[np.float64]:
    """Repeat to a common multiple, then average blocks."""
    h, w = image.shape
    fine = np.repeat(np.repeat(image, height, axis=0), width, axis=1)
    return np.asarray(fine.reshape(height, h, width, w).mean(axis=(1, 3)))


@pytest.mark.parametrize("size", [(6, 8), (3, 4), (12, 16), (5, 7), (13, 3), (1, 1)])
def test_placing_a_cube_averages_by_area(size: tuple[int, int]) -> None:
    image = np.random.default_rng(2).random((6, 8))

    placed = area_weights(size[0], 6) @ image @ area_weights(size[1], 8).T

    assert placed == pytest.approx(naive_area(image, *size))
    assert placed.mean() == pytest.approx(image.mean())


@pytest.mark.parametrize(
    ("arrays", "key", "allowed"),
    [
        ({"x": [1]}, "its arrays", "counts or meas with bin_s"),
        ({"counts": [1, 2]}, "bin_s", "present"),
        ({"counts": [1, 2], "bin_s": 0.0}, "bin_s", "above 0"),
        ({"counts": [1, 2], "bin_s": [1e-9, 1e-9]}, "bin_s", "one finite number"),
        ({"counts": [[1, 2]], "bin_s": 1e-9}, "counts", "1 dimension"),
        ({"counts": [], "bin_s": 1e-9}, "counts", "1 dimension"),
        ({"counts": [1.0, math.nan], "bin_s": 1e-9}, "counts", "at least 0"),
        ({"counts": [1, -2], "bin_s": 1e-9}, "counts", "at least 0"),
        ({"counts": ["a"], "bin_s": 1e-9}, "counts", "numbers"),
        ({"counts": [0, 0], "bin_s": 1e-9}, "sum of the responses", "above 0"),
        ({"meas": [1.0], "bin_s": 1e-9}, "meas", "3 dimension"),
        ({"h": np.ones((2, 2, 2))}, "start_opl_m", "present"),
        ({"h": np.ones((2, 2, 2)), "start_opl_m": 1.0, "bin_opl_m": -1.0}, "bin_opl_m", "above 0"),
        ({"counts": np.array([{}], dtype=object), "bin_s": 1e-9}, "the file", "a readable .npz"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_says_what_is_wrong(
    tmp_path: Path, arrays: dict[str, Any], key: str, allowed: str
) -> None:
    path = tmp_path / "bad.npz"
    np.savez(path, **arrays)

    with pytest.raises(SceneError) as caught:
        load_responses(scene(ResponseFile(path)), width=WIDTH, height=HEIGHT)

    assert (caught.value.file, caught.value.key) == (str(path), key)
    assert allowed in caught.value.allowed


def test_an_array_without_a_name_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "array.npy"
    np.save(path, np.ones(3))

    with pytest.raises(SceneError, match="without a name"):
        load_responses(scene(ResponseFile(path)), width=WIDTH, height=HEIGHT)


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 no zip", b"plain text"])
def test_a_file_that_is_no_npz_is_reported(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "bad.npz"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(SceneError, match=r"a readable \.npz"):
        load_responses(scene(ResponseFile(path)), width=WIDTH, height=HEIGHT)


COMPOSITE = """
[light]
electrons_per_s = 6e6

[[response]]
file = "{folder}/capture_direct.npz"
weight = 0.55
delay_s = 3e-9
background = "median"
time_zero_file = "{folder}/capture_direct.npz"

[[response]]
file = "{folder}/capture_1_0_inch.npz"
weight = 0.30
delay_s = 9e-9
background = "median"
time_zero_file = "{folder}/capture_direct.npz"

[[response]]
file = "{folder}/capture_3_0_inch.npz"
weight = 0.5
delay_s = 20e-9
background = "median"
time_zero_file = "{folder}/capture_direct.npz"
"""


def dense_peaks_ns(moments: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Peaks of Eq. (2) by a dense solve on a fine grid."""
    m = len(moments) - 1
    hermitian = np.concatenate([np.conj(moments[:0:-1]), moments])  # b_-m ... b_m
    b = np.array([hermitian[m - k : 2 * m + 1 - k] for k in range(m + 1)]).T
    q = np.linalg.solve(b, np.eye(m + 1)[0])
    phase_rad = np.linspace(0, 2 * np.pi, 200_001)
    density = 1 / np.abs(np.conj(q) @ np.exp(1j * np.outer(np.arange(m + 1), phase_rad))) ** 2
    inner = density[1:-1]
    peaks = phase_rad[1:-1][(inner > density[:-2]) & (inner > density[2:])]
    return np.asarray(peaks / (2 * np.pi * 23e6) * 1e9)


@pytest.mark.data
@pytest.mark.parametrize(
    ("harmonics", "peaks_ns"), [(3, [3.18, 9.73, 22.22]), (4, [3.07, 9.31, 21.68])]
)
def test_the_composite_of_measured_responses_comes_over_usb_with_its_known_peaks(
    tmp_path: Path, data_dir: Path, harmonics: int, peaks_ns: list[float]
) -> None:
    path = tmp_path / "composite.toml"
    path.write_text(COMPOSITE.format(folder=(data_dir / "measured").resolve()))
    sequence = Sequence(23e6, harmonics, "on-off")

    with open_camera(f"sim:{path}?noise=off", clock=VirtualClock()) as camera:
        camera.configure(sequence)
        camera.start()
        images = camera.read_frame().images.astype(np.float64)

    shift = sum(
        w * np.exp(-1j * p)
        for w, p in zip(sequence.sub_phases.weights, sequence.sub_phases.phases_rad, strict=True)
    )
    buckets = images[2:].reshape(harmonics, 4, 120, 163)
    of_harmonics = (buckets[:, 0] - buckets[:, 2] + 1j * (buckets[:, 1] - buckets[:, 3])) / shift
    moments = np.concatenate([2 * (images[:1] - images[1:2]), of_harmonics])[:, 60, 80]
    found = dense_peaks_ns(moments)
    for peak_ns in peaks_ns:
        assert np.abs(found - peak_ns).min() < 0.05
    assert images.max() < 65_535


@pytest.mark.data
def test_a_rendered_cornell_box_is_seen_with_its_walls_at_their_distance(data_dir: Path) -> None:
    path = data_dir / "rendered" / "mitransient_cornell_163x120x300.npz"
    with np.load(path) as archive:
        cube = archive["h"].astype(np.float64)

    with open_camera(f"sim:measured:{path}?noise=off", clock=VirtualClock()) as camera:
        camera.configure(Sequence(23e6, 1, "on-off"))
        camera.start()
        images = camera.read_frame().images.astype(np.float64)
        assert camera.simulation is not None
        truth = camera.simulation.truth()

    brightness = 2 * (images[0] - images[1])
    lit = (cube.sum(axis=-1) > 0.05) & (images.max(axis=0) < 65_535)
    scale = brightness[lit].sum() / cube.sum(axis=-1)[lit].sum()
    assert brightness[lit] == pytest.approx(scale * cube.sum(axis=-1)[lit], abs=2 + 1e-4 * scale)
    assert np.nanmedian(truth.range_m[lit]) == pytest.approx(2.5, abs=1.0)
    assert truth.kind == "dense"


@pytest.mark.data
def test_the_scan_through_foam_is_placed_on_the_sensors_pixels(data_dir: Path) -> None:
    path = data_dir / "measured" / "scene_letter_s.npz"

    with open_camera(f"sim:measured:{path}?background=median", clock=VirtualClock()) as camera:
        camera.start()

        assert camera.read_frame().images.shape == (16, 120, 163)


def test_the_template_of_measured_scenes_names_the_file_to_replace() -> None:
    (response,) = load_scene(BUILT_IN / "measured.toml").responses

    assert response.path.name == "PATH.npz"

"""A diffuser is distinguished from a scene, by images made from the measurement's equations."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import CalibrationCapture, Sequence, capture_calibration, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Verdict, evaluate, judge
from transientcam_server.imaging._calibrations.diffuser import smooth_field

_Array = NDArray[Any]
HEIGHT, WIDTH = 90, 120
DARK_DN = 64.0
LIT_DN = 2000.0
SPEED_M_S = 299_792_458.0
SEQUENCE = Sequence(harmonics=4, zeroth="estimated")
LOW_HZ = 0.9e6
Y, X = np.meshgrid(np.linspace(-1, 1, HEIGHT), np.linspace(-1, 1, WIDTH), indexing="ij")


def measurement(
    delays_s: _Array | float = 0.0,
    weights: _Array | float = 1.0,
    *,
    sequence: Sequence = SEQUENCE,
    noise_dn: float = 3.0,
    gains: dict[int, complex] | None = None,
    spoil: Callable[[_Array], None] = lambda images: None,
) -> CalibrationCapture:
    """Images of returns (K, H, W) or (H, W) of these weights after these delays."""
    delay_s = np.broadcast_to(delays_s, np.broadcast_shapes(np.shape(delays_s), (1, HEIGHT, WIDTH)))
    weight = LIT_DN * np.broadcast_to(weights, delay_s.shape)
    random = np.random.default_rng(3)
    sub_phases = sequence.sub_phases
    mixed = np.sum(sub_phases.weights * np.exp(-1j * np.array(sub_phases.phases_rad)))
    images = []
    for label in sequence.labels:
        if not label.illumination:
            clean = np.zeros((HEIGHT, WIDTH))
        elif label.frequency_hz == 0:
            clean = weight.sum(axis=0) / 2
        else:
            angle = 2 * np.pi * label.frequency_hz * delay_s
            moment = (weight * np.exp(1j * angle)).sum(axis=0)
            moment = moment * mixed * (gains or {}).get(label.harmonic, 1.0)
            clean = (weight.sum(axis=0) + (moment * np.exp(-1j * label.phase_rad)).real) / 2
        images.append(DARK_DN + clean + noise_dn * random.standard_normal((HEIGHT, WIDTH)))
    stack = np.stack(images).astype(np.float32)
    spoil(stack)
    return CalibrationCapture(
        images=stack,
        kept=np.ones((2, len(images)), dtype=bool),
        sequence=sequence,
        low_frequency_hz=LOW_HZ,
        serial="SIM",
        model="",
        firmware="",
        temperature_c=30.0,
        captured_unix_s=0.0,
        dark=np.full((HEIGHT, WIDTH), DARK_DN, np.float32),
        dark_deviation=np.ones((HEIGHT, WIDTH), np.float32),
    )


def judged(capture: CalibrationCapture, **options: Any) -> Verdict:
    return judge(capture, evaluate(capture).gains.bad, full_scale=4095.0, **options)


def metres(distance_m: _Array | float) -> Any:
    """The delay of light from there and back."""
    return 2 * np.asarray(distance_m) / SPEED_M_S


def value(verdict: Verdict, test: str) -> float:
    return {each.test: each.value for each in verdict.findings}[test]


RANDOM = np.random.default_rng(11)
PATTERN_S = RANDOM.normal(0.0, 1.2e-9, (HEIGHT, WIDTH))
"""As on the prototype: 10 degrees at 23 MHz."""
FIELD_S = metres(0.15 * X + 0.1 * X * Y - 0.2 * Y**2 + 0.05 * X**3)
FIELD_S -= np.median(FIELD_S)


def dirt(images: _Array) -> None:
    random = np.random.default_rng(5)
    for _ in range(25):
        y, x, radius = random.uniform((-1, -1, 0.02), (1, 1, 0.09))
        grain = (Y - y) ** 2 + (X - x) ** 2 < radius**2
        images[:, grain] = DARK_DN + 0.2 * (images[:, grain] - DARK_DN)


def five_percent_bad(images: _Array) -> None:
    random = np.random.default_rng(6)
    chosen = random.random((HEIGHT, WIDTH)) < 0.05
    images[:, chosen] = random.uniform(0, 4095, (len(images), int(chosen.sum())))


@pytest.mark.parametrize(
    "capture",
    [
        pytest.param(lambda: measurement(), id="plain"),
        pytest.param(lambda: measurement(PATTERN_S), id="pattern"),
        pytest.param(lambda: measurement(FIELD_S + PATTERN_S), id="field and pattern"),
        pytest.param(lambda: measurement(weights=1 - 0.4 * (X**2 + Y**2)), id="vignetting"),
        pytest.param(lambda: measurement(PATTERN_S, spoil=dirt), id="dirt"),
        pytest.param(lambda: measurement(PATTERN_S, spoil=five_percent_bad), id="bad pixels"),
        pytest.param(lambda: measurement(PATTERN_S + 48e-12), id="drift"),
        pytest.param(lambda: measurement(noise_dn=150.0), id="noise"),
        pytest.param(lambda: measurement(gains={1: 1.0, 2: 0.9, 3: 0.5, 4: 0.2}), id="roll-off"),
        pytest.param(
            lambda: measurement(PATTERN_S, sequence=replace(SEQUENCE, harmonics=1)), id="m = 1"
        ),
        pytest.param(
            lambda: measurement(PATTERN_S, sequence=Sequence(harmonics=3)), id="low frequency"
        ),
        pytest.param(
            lambda: measurement(PATTERN_S, sequence=Sequence(harmonics=3, zeroth="on-off")),
            id="on-off",
        ),
    ],
)
def test_a_real_diffuser_is_trusted(capture: Callable[[], CalibrationCapture]) -> None:
    verdict = judged(capture())

    assert verdict.trusted, verdict.reason
    assert verdict.reason is None
    assert not any("#" in row for row in verdict.blocks)


def test_steps_in_the_range_make_a_scene_and_the_map_shows_where() -> None:
    box = np.zeros((HEIGHT, WIDTH), dtype=bool)
    box[18:54, 66:102] = True  # whole blocks of 6 pixels

    verdict = judged(measurement(metres(np.where(box, 3.0, 2.0))))

    assert verdict.word == "scene"
    assert verdict.block_px == 6
    expected = box[::6, ::6]
    assert verdict.blocks == tuple("".join(np.where(row, "#", ".")) for row in expected)
    assert value(verdict, "unlike_share") == pytest.approx(expected.mean())
    assert "unlike a diffuser" in str(verdict.reason)


def test_a_second_return_is_found_though_the_phase_of_one_frequency_is_smooth() -> None:
    delays_s = np.stack([np.zeros_like(X), metres(1.6) + 0 * X])
    weights = np.stack([np.ones_like(X), np.where(X > 0, 0.5, 0.0)])

    verdict = judged(measurement(delays_s, weights))

    assert not verdict.trusted
    assert value(verdict, "magnitude_share") > 0.15


def test_the_same_returns_in_all_pixels_belong_to_no_single_time() -> None:
    delays_s = np.stack([metres(-0.5) + 0 * X, metres(0.9) + 0 * X])

    verdict = judged(measurement(delays_s, np.stack([1 + 0 * X, 0.55 + 0 * X])))

    assert not verdict.trusted
    assert abs(value(verdict, "common_phase_rad")) > 0.3
    assert value(verdict, "unlike_share") == 0.0


def test_a_flat_wall_is_in_doubt_and_the_reason_says_what_it_looks_like() -> None:
    verdict = judged(measurement(metres(2.0 * np.sqrt(1 + 0.13 * (X**2 + 0.56 * Y**2)))))

    assert verdict.word == "in-doubt"
    assert value(verdict, "offset_m") == pytest.approx(2.1, abs=0.05)
    assert "flat wall" in str(verdict.reason)


def test_a_delay_of_the_electronics_is_in_doubt_until_it_is_known() -> None:
    capture = measurement(PATTERN_S + 3e-9)
    known = evaluate(measurement(PATTERN_S + 3.02e-9))

    assert judged(capture).word == "in-doubt"
    compared = judged(capture, reference=known)
    assert compared.trusted
    assert compared.reference == known.gains.id
    moved = judged(measurement(PATTERN_S + 3e-9 + metres(1.0)), reference=known)
    assert not moved.trusted


def test_a_wall_at_the_unambiguous_range_is_found_where_the_low_frequency_is_measured() -> None:
    period_m = SPEED_M_S / (2 * 23e6)

    verdict = judged(measurement(metres(period_m), sequence=Sequence(harmonics=3)))

    assert verdict.word == "in-doubt"
    assert abs(value(verdict, "offset_m")) < 0.01
    assert value(verdict, "low_frequency_m") == pytest.approx(period_m, abs=0.1)


@pytest.mark.parametrize(
    "capture",
    [
        pytest.param(lambda: measurement(weights=0.0), id="no light"),
        pytest.param(lambda: measurement(weights=0.0, noise_dn=0.0), id="nothing at all"),
        pytest.param(lambda: measurement(weights=2.5), id="saturated"),
        pytest.param(lambda: measurement(weights=np.where(X > 0, 1.0, 0.0)), id="half covered"),
    ],
)
def test_what_cannot_be_judged_is_in_doubt(capture: Callable[[], CalibrationCapture]) -> None:
    found = capture()
    images = np.minimum(found.images, 4095.0)

    verdict = judged(replace(found, images=images))

    assert verdict.word == "in-doubt"
    assert verdict.reason is not None
    assert "nan" not in verdict.reason


def test_a_smooth_field_is_followed_and_what_stands_out_of_it_is_not() -> None:
    y, x = np.mgrid[-1:1:15j, -1:1:20j]
    smooth = 0.3 * x**2 - 0.2 * x * y + 0.1 * y**3
    values = smooth.copy()
    values[3:5, 4:7] += 1.0
    values[9, 9] = np.nan

    np.testing.assert_allclose(smooth_field(values), smooth, atol=1e-6)


def captured(spec: str, sequence: Sequence = SEQUENCE) -> CalibrationCapture:
    with open_camera(spec, clock=VirtualClock()) as camera:
        camera.configure(sequence)
        return capture_calibration(camera, takes=2)


@pytest.mark.parametrize("scene", ["mirrors", "translucent", "wall"])
def test_no_built_in_scene_is_trusted(scene: str) -> None:
    capture = captured(f"sim:{scene}?device=prototype")

    assert not judge(capture, evaluate(capture).gains.bad, full_scale=65535.0).trusted


def test_the_simulated_diffuser_is_trusted() -> None:
    capture = captured("sim:calibration?device=prototype")

    verdict = judge(capture, evaluate(capture).gains.bad, full_scale=65535.0)

    assert verdict.trusted, verdict.reason


def test_the_phases_of_a_real_board_are_a_smooth_field(data_dir: Path) -> None:
    file = data_dir / "modulation" / "TintinCDKCameraPhaseOffset.bin"
    words = np.frombuffer(file.read_bytes(), dtype="<i2")[2:].reshape(240, 320)
    rad = (words - np.median(words))[::2, ::2][:HEIGHT, :WIDTH] * (2 * np.pi / 4096)

    verdict = judged(measurement(rad / (2 * np.pi * 23e6)))

    assert verdict.trusted, verdict.reason
    assert value(verdict, "field_m") > 0.2


def test_no_scene_file_of_the_audit_is_trusted(data_dir: Path) -> None:
    for name in ("dark5", "object", "sunny"):
        path = data_dir / "scenes" / f"{name}.toml"
        capture = captured(f"sim:{path}")
        bad = evaluate(capture).gains.bad
        assert not judge(capture, bad, full_scale=65535.0).trusted, path.name

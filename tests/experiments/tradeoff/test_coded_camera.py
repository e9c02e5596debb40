"""The simulated camera takes a code as its waveform; what it captures is deconvolved."""

from pathlib import Path

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence, SubPhases, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.capture import capture
from transientcam_moments.comparisons import Code, coded, maximum_length_code
from transientcam_simulation import scenes

BASE_HZ = 11.5e6
HIGHEST = 9  # harmonic of a waveform that the simulated camera has
PIXELS = 60


def test_frames_of_a_coded_light_are_deconvolved_into_the_mirrors_returns(tmp_path: Path) -> None:
    contents = maximum_length_code(4).contents[:HIGHEST]
    contents = contents / contents[0]  # as the camera has it: relative to the fundamental
    period = np.arange(64) * 2 * np.pi / 64
    np.save(tmp_path / "code.npy", Code(contents).correlation(period))
    mirrors = Path(scenes.__path__[0], "mirrors.toml").read_text(encoding="utf-8")
    scene = tmp_path / "coded.toml"
    scene.write_text(mirrors + '\n[device]\nwaveform_file = "code.npy"\n', encoding="utf-8")
    sequence = Sequence(
        base_frequency_hz=BASE_HZ, harmonics=8, zeroth="estimated", sub_phases=SubPhases("none", 1)
    )
    with open_camera(f"sim:{scene}?noise=off", clock=VirtualClock()) as camera:
        camera.configure(sequence)
        (shot,) = capture(camera, 1)

    lit = np.flatnonzero(shot.truth.brightness.ravel() > 0)
    chosen = np.random.default_rng(0).permutation(lit)[:PIXELS]
    images = shot.raw.images.reshape((8, 4, -1))[:, :, chosen].astype(float)
    # opposite phases: what is left are the code's odd harmonics, at 0 and 90 degrees
    samples = (images[:, :2] - images[:, 2:]).reshape((16, PIXELS))
    odd = np.where(np.arange(1, HIGHEST + 1) % 2, contents, 0)
    found = coded(
        samples,
        code=Code(odd),
        shifts_rad=np.tile([0.0, np.pi / 2], 8),
        harmonics=np.repeat(np.arange(1, 9), 2),
        sparsity=0.01,
    )

    truth_m = shot.truth.range_m.ravel()[chosen]
    error_m = np.abs(tm.range_m(found.first_phase_rad(), BASE_HZ) - truth_m)
    # taken for a sinusoid the same frames give the mixture's range
    phasor = samples[0] + 1j * samples[1]
    mixed_m = np.abs(tm.range_m(np.angle(phasor) % (2 * np.pi), BASE_HZ) - truth_m)
    assert np.median(error_m) < 0.01
    assert np.median(error_m) < 0.02 * np.median(mixed_m)

"""Light in flight: stream coefficients, evaluate Eq. (2) here, write a film.

    python examples/transient_video.py http://127.0.0.1:8000 film.gif

A frame's coefficients are a few numbers a pixel and hold every instant, so the camera sends 0.5 MB
where the film would be many times that. A film.npy is the array itself; a GIF needs Pillow.
"""
# ruff: noqa: T201 - an example prints what it finds

import sys
import time
from pathlib import Path

import numpy as np

import transientcam

FRAMES = 5
INSTANTS = 120


def film_of(frame: transientcam.Frame, time_s: np.ndarray) -> np.ndarray:
    """Return the impulse response (T, H, W) in DN per s at some times of flight."""
    frequency_hz = frame.meta["base_frequency_hz"]
    return transientcam.transient(frame, time_s, base_frequency_hz=frequency_hz)


def save(film: np.ndarray, path: Path) -> None:
    """Write a film (T, H, W) as a GIF, or as the array itself."""
    if path.suffix == ".npy":
        np.save(path, film)
        return
    from PIL import Image

    # peaks are thousands of times brighter than what glows between them: show the square root
    bright = np.sqrt(np.nan_to_num(film) / np.nanpercentile(film, 99.9))
    images = [Image.fromarray(each) for each in (255 * np.clip(bright, 0, 1)).astype(np.uint8)]
    images[0].save(path, save_all=True, append_images=images[1:], duration=40, loop=0)


def main(url: str, path: str = "film.gif") -> None:
    """Watch a few frames, and write the last one as a film."""
    with transientcam.Camera(url) as camera, camera.stream("coefficients") as stream:
        for _ in range(FRAMES):
            frame = stream.receive(timeout_s=30.0)
            period_s = 1.0 / frame.meta["base_frequency_hz"]
            time_s = np.arange(INSTANTS) * period_s / INSTANTS
            start = time.perf_counter()
            film = film_of(frame, time_s)
            took_s = time.perf_counter() - start
            brightest_s = time_s[np.nansum(film, axis=(1, 2)).argmax()]
            print(
                f"frame {frame.frame}: {frame.array.nbytes / 1e6:.2f} MB came, {INSTANTS} instants "
                f"took {took_s * 1e3:.0f} ms, brightest at {brightest_s * 1e9:.1f} ns of flight"
            )
    save(film, Path(path))
    print(f"wrote {path}: {film.shape[0]} instants of {film.shape[2]} x {film.shape[1]} pixels")


if __name__ == "__main__":
    main(*sys.argv[1:3] or ["http://127.0.0.1:8000"])

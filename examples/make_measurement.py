"""Keep the moments of a frame as a measurement, with the true range where the camera is simulated.

    transientcam demo corner &
    python examples/make_measurement.py http://127.0.0.1:8000 examples/measurement.npz

``transientcam reconstruct`` reads what it writes; this made the measurement.npz beside it.
"""
# ruff: noqa: T201 - an example prints what it finds

import sys

import numpy as np

import transientcam

STEP = 2
"""Every second pixel of every second row is kept, for a small file."""


def main(url: str, path: str = "measurement.npz") -> None:
    """Write a frame's moments (m + 1, H, W), their frequency, and the true range (H, W)."""
    with transientcam.Camera(url) as camera:
        moments = camera.frame("moments", wait_s=10.0)
        arrays = {
            "moments": moments.array[:, ::STEP, ::STEP],
            "base_frequency_hz": np.float64(moments.meta["base_frequency_hz"]),
        }
        if "truth" not in {each["name"] for each in camera.info["absent_products"]}:
            truth = camera.frame("truth", number=moments.frame)
            arrays["range_m"] = truth.array[::STEP, ::STEP]
    np.savez_compressed(path, **arrays)
    print(f"wrote {path}: " + ", ".join(f"{name} {each.shape}" for name, each in arrays.items()))


if __name__ == "__main__":
    main(*sys.argv[1:3] or ["http://127.0.0.1:8000"])

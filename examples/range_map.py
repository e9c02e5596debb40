"""How far away everything is: one range map, as numbers and as a picture in the terminal.

python examples/range_map.py http://127.0.0.1:8000
"""
# ruff: noqa: T201 - an example prints what it finds

import sys

import numpy as np

import transientcam

SHADES = "@%#*+=-:. "
"""Near to far."""
COLUMNS, ROWS = 60, 24


def picture(range_m: np.ndarray, near_m: float, far_m: float) -> str:
    """Return a range map (H, W) in metres as lines of characters, ``?`` where there is no range."""
    rows = np.linspace(0, range_m.shape[0] - 1, ROWS).round().astype(int)
    columns = np.linspace(0, range_m.shape[1] - 1, COLUMNS).round().astype(int)
    coarse = range_m[np.ix_(rows, columns)]
    depth = np.nan_to_num((coarse - near_m) / max(far_m - near_m, 0.01))
    shade = np.clip(depth * len(SHADES), 0, len(SHADES) - 1).astype(int)
    return "\n".join(
        "".join(SHADES[s] if np.isfinite(r) else "?" for s, r in zip(*line, strict=True))
        for line in zip(shade, coarse, strict=True)
    )


def main(url: str) -> None:
    """Take one range map and describe it."""
    with transientcam.Camera(url) as camera:
        sequence = camera.sequence
        frame = camera.frame("range", wait_s=10.0)
    range_m = frame.array
    valid = np.isfinite(range_m)
    print(f"frame {frame.frame}: {range_m.shape[1]} x {range_m.shape[0]} pixels")
    reach_m = sequence["unambiguous_range_m"]
    print(f"{valid.mean():.1%} have a range; the camera sees {reach_m:.2f} m without ambiguity")
    if valid.any():
        near_m, median_m, far_m = np.percentile(range_m[valid], [1, 50, 99])
        print(f"nearest {near_m:.3f} {frame.unit}, median {median_m:.3f}, farthest {far_m:.3f}")
        print(picture(range_m, near_m, far_m))


if __name__ == "__main__":
    main(*sys.argv[1:2] or ["http://127.0.0.1:8000"])

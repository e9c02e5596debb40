"""The predicted error of each pixel: as a plane, a file, or a picture for eyes."""

import io
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from transientcam.notebook import palette

_AROUND_PX: Final = 3


def error_map(
    amplification_m: NDArray[Any], bias_m: NDArray[Any], noise: NDArray[Any]
) -> NDArray[np.float32]:
    """Return noise and bias together of each pixel (H, W) in m; NaN where either is not known.

    ``amplification_m``: (H, W) deviation of the range over ``noise``, by few draws; neighbours have
    nearly the same, and their geometric mean is known better.
    ``bias_m``, ``noise``: (H, W) of the range in m, and of the moments over the light.
    """
    there = np.isfinite(amplification_m) & (amplification_m > 0)
    log = np.log(amplification_m, where=there, out=np.zeros_like(amplification_m))
    count = uniform_filter(there.astype(float), _AROUND_PX)
    mean = uniform_filter(log, _AROUND_PX) / np.maximum(count, 1e-9)
    error_m = np.hypot(np.exp(mean) * noise, bias_m)
    return np.where(there & np.isfinite(bias_m), error_m, np.nan).astype(np.float32)


def map_files(error_m: NDArray[Any], target_m: float | None) -> dict[str, bytes]:
    """Return errors (H, W) in m by format: ``npy`` has the values, and ``png`` colours for eyes.

    They go from dark at 0 over their middle at the target to the brightest at twice that, or at the
    worst pixel of twenty; grey is where no light is.
    """
    from PIL import Image  # 60 ms that no other plan need wait for

    values, picture = io.BytesIO(), io.BytesIO()
    np.save(values, error_m)
    known = error_m[np.isfinite(error_m)]
    most_m = 2 * target_m if target_m else float(np.quantile(known, 0.95)) if known.size else 1.0
    index = 1.0 + 254.0 * np.clip(np.nan_to_num(error_m, nan=0.0) / max(most_m, 1e-12), 0.0, 1.0)
    image = Image.fromarray(np.where(np.isfinite(error_m), index, 0).astype(np.uint8), mode="P")
    image.putpalette(palette())
    image.save(picture, format="PNG")
    return {"npy": values.getvalue(), "png": picture.getvalue()}

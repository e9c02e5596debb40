import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from transientcam_server.errors import MissingExtra
from transientcam_server.offline import Measurement, plot, reconstruct_measurement
from transientcam_server.settings import ReconstructionSettings


@pytest.mark.parametrize("shape", [(1, 1), (6, 8)])
def test_a_picture_is_drawn_of_one_pixel_and_of_many(
    tmp_path: Path, shape: tuple[int, int]
) -> None:
    random = np.random.default_rng(1)
    delay_rad = random.uniform(0.5, 5.0, shape)
    b = np.stack([np.exp(1j * j * delay_rad) for j in range(4)])
    b[0] += 0.3
    b[:, 0, 0] *= 0.0 if shape != (1, 1) else 1.0  # a pixel without light is no obstacle
    result = reconstruct_measurement(
        Measurement(b, 23e6), bins=32, settings=ReconstructionSettings(smoothing_px=0.0)
    )

    plot.save_picture(tmp_path / "a.png", result)

    with Image.open(tmp_path / "a.png") as image:
        assert image.width > 1000
        assert len(set(image.convert("L").get_flattened_data())) > 10


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)

    with pytest.raises(MissingExtra, match=r"pip install 'transientcam\[plot\]'"):
        plot.require("--plot")

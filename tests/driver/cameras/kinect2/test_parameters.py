"""The lens of a Kinect v2: against libfreenect2's tables of rays."""

import struct

import numpy as np
import pytest

from tests.driver.cameras.kinect2.conftest import Load
from transientcam_driver import ProtocolError
from transientcam_driver.cameras.kinect2 import DepthParameters, Rows


@pytest.mark.data
@pytest.mark.parametrize("rows", ["top", "bottom"])
def test_rays_are_those_of_libfreenect2s_tables(vectors: Load, rows: Rows) -> None:
    parameters = DepthParameters.unpack(vectors("ramp")["depth_parameters_response"].tobytes())
    stored = vectors("tables")

    x, y = parameters.lens(rows).slopes(512, 424)

    # 8192 x, and z of a ray as long as one cycle of the three frequencies; counted from the bottom,
    # displayed row v has row 423 - v of the tables
    place = stored["rows"] if rows == "top" else 423 - stored["rows"]
    z_mm = 6250 / 3 / np.sqrt(x**2 + y**2 + 1)
    np.testing.assert_allclose(8192 * x[place], stored["xtable"], atol=5e-4)
    np.testing.assert_allclose(z_mm[place], stored["ztable"], atol=5e-4)


@pytest.mark.data
def test_the_answer_of_a_camera_is_read_and_written(vectors: Load) -> None:
    response = vectors("ramp")["depth_parameters_response"].tobytes()

    assert DepthParameters.unpack(response).pack() == response


def test_rows_counted_from_the_other_side_are_a_mirror_image() -> None:
    parameters = DepthParameters(365.0, 366.0, 257.0, 205.0, 0.09, -0.27, 0.01, -0.02, 0.09)

    x, y = parameters.lens("top").slopes(512, 424)
    x_mirrored, y_mirrored = parameters.lens("bottom").slopes(512, 424)

    np.testing.assert_allclose(x_mirrored, x[::-1], atol=1e-12)
    np.testing.assert_allclose(y_mirrored, -y[::-1], atol=1e-12)


@pytest.mark.parametrize(
    ("response", "says"),
    [
        (bytes(91), "91 bytes, not 92"),
        (bytes(92), "no lens"),
        (struct.pack("<23f", 365, 365, 0, float("nan"), *[0] * 19), "no lens"),
    ],
)
def test_what_is_no_lens_is_refused(response: bytes, says: str) -> None:
    with pytest.raises(ProtocolError, match=says):
        DepthParameters.unpack(response)

"""P0 tables of a Kinect v2 as gains."""

import numpy as np
import pytest

from tests.driver.cameras.kinect2.conftest import Load
from transientcam_driver import ProtocolError
from transientcam_driver.cameras.kinect2 import P0Tables


@pytest.mark.data
def test_the_answer_of_a_camera_is_read_and_written(vectors: Load) -> None:
    response = vectors("ramp")["p0_response"].tobytes()

    tables = P0Tables.unpack(response)

    assert tables.pack() == response
    # by hand: the third table, row 100, column 7
    at = 34 + 2 * 434_180 + 2 * (100 * 512 + 7)
    assert tables.units[2, 100, 7] == int.from_bytes(response[at : at + 2], "little")


def test_gains_are_the_response_and_the_phase_of_each_frequency() -> None:
    units = np.random.default_rng(1).integers(0, 65_536, (3, 424, 512)).astype(np.uint16)

    gains = P0Tables(units).gains()

    assert gains.shape == (4, 424, 512)
    assert (gains[0] == 1).all()
    # 16, 80 and 120 MHz; the tables are those of 80, 16 and 120 MHz
    for k, (table, response) in enumerate([(1, 1.0), (0, 1.322581), (2, 1.612903)]):
        expected = 2 / response * np.exp(-1j * 31e-6 * np.pi * units[table, 3, 5])
        assert gains[k + 1, 3, 5] == pytest.approx(expected, rel=1e-6)


def test_a_short_answer_is_refused() -> None:
    with pytest.raises(ProtocolError, match="100 bytes, not 1302572"):
        P0Tables.unpack(bytes(100))

"""What a capture costs, item by item."""

import pytest

from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning._search.price import price


def test_the_items_of_a_capture_add_up_to_it(capabilities: Capabilities) -> None:
    applied = capabilities.apply(Sequence(harmonics=3, exposure_s=2e-3, takes=5))

    items = price(applied, 1e-3, None)

    assert items["light_s"] == pytest.approx(applied.images * 2e-3)
    assert items["readout_s"] == pytest.approx(
        applied.images * capabilities.streaming_readout_s - 1e-3
    )
    assert items["sum_s"] == applied.capture_s
    assert items["light_share"] == pytest.approx(items["light_s"] / applied.capture_s)
    assert items["data_bytes"] == applied.images * (capabilities.image_bytes + 64)
    assert price(applied, 1e-3, 0.25)["sum_s"] == applied.capture_s + 0.25

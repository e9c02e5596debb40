"""What becomes of the messages of a stream: captures, or nothing where a part is missing."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import transientcam
import transientcam_moments as tm
from transientcam_driver import ProtocolError, RawFrame
from transientcam_server.imaging import OF_IMAGES, MomentFrame
from transientcam_server.relay._frames import MOMENTS, SUBSCRIBED, Collector, Parts, capture_of

HEIGHT, WIDTH, M = 2, 3, 2
TIMES = dict.fromkeys(("device_time_s", "host_time_s", "capture_s", "temperature_c"), 0.0)
TREATED = {"rejected_images": 1, "repaired_images": 2, "unrepaired_images": 0, "filled_images": [5]}


def message(product: str, number: int = 7, array: Any = None) -> transientcam.Frame:
    meta = cast("Any", {"frame": number, **TREATED, **TIMES})
    shown = np.zeros((HEIGHT, WIDTH), np.uint8) if array is None else array
    return transientcam.Frame(product, "1", ("y", "x"), meta, shown)


def moments(shape: tuple[int, ...] = (M + 1, HEIGHT, WIDTH)) -> Any:
    return np.arange(np.prod(shape)).reshape(shape).astype(np.complex64)


def captured(parts: Parts, images: int = 8) -> RawFrame:
    applied: Any = SimpleNamespace(
        images=images, epoch=1, labels=(), sequence=SimpleNamespace(harmonics=M)
    )
    camera: Any = SimpleNamespace(height=HEIGHT, width=WIDTH)
    return capture_of(parts, applied, camera, number=3, lost_images=0, hops=())


def test_a_frame_is_complete_with_its_last_product() -> None:
    collector = Collector(SUBSCRIBED[MOMENTS])
    assert collector.add(message(MOMENTS)) is None
    parts = collector.add(message("flags"))
    assert parts is not None
    assert [*parts] == [MOMENTS, "flags"]
    assert {each.frame for each in parts.values()} == {7}


def test_what_lacks_a_product_is_dropped_and_never_mixed_with_another_frame() -> None:
    collector = Collector(SUBSCRIBED[MOMENTS])
    assert collector.add(message(MOMENTS, 7)) is None  # flags of 7 could not be computed
    assert collector.add(message("flags", 8)) is None  # and the moments of 8
    assert collector.add(message(MOMENTS, 9)) is None
    parts = collector.add(message("flags", 9))
    assert parts is not None
    assert {each.frame for each in parts.values()} == {9}


@pytest.mark.parametrize(("stated", "ambient_dn"), [({"ambient_dn": 80.5}, 80.5), ({}, 0.0)])
def test_moments_keep_the_light_that_is_not_the_cameras(
    stated: dict[str, float], ambient_dn: float
) -> None:
    first = message(MOMENTS, array=moments())
    first.meta.update(cast("Any", stated))  # older daemons state none
    found = captured({MOMENTS: first, "flags": message("flags")})
    assert isinstance(found, MomentFrame)
    assert found.ambient_dn == ambient_dn


def test_moments_keep_what_was_done_to_their_images() -> None:
    flags = np.zeros((HEIGHT, WIDTH), np.uint8)
    flags[0, 1] = tm.Flags.SATURATED | tm.Flags.BIASED
    flags[1, 2] = tm.Flags.BIASED
    found = captured(
        {MOMENTS: message(MOMENTS, array=moments()), "flags": message("flags", 7, flags)}
    )
    assert isinstance(found, MomentFrame)
    np.testing.assert_array_equal(found.moments, moments())
    assert np.argwhere(found.saturated).tolist() == [[0, 1]]
    assert found.treated == TREATED
    assert tuple(TREATED) == OF_IMAGES
    assert found.images.shape == (0, HEIGHT, WIDTH)


@pytest.mark.parametrize(
    "parts",
    [
        {"raw": message("raw", array=np.zeros((8, HEIGHT, WIDTH), np.float32))},
        {"raw": message("raw", array=np.zeros((7, HEIGHT, WIDTH), np.uint16))},
        {MOMENTS: message(MOMENTS, array=moments((M, HEIGHT, WIDTH))), "flags": message("flags")},
        {
            MOMENTS: message(MOMENTS, array=moments()),
            "flags": message("flags", array=np.zeros((HEIGHT, 1), np.uint8)),
        },
    ],
    ids=["type", "images", "moments", "flags"],
)
def test_arrays_of_another_shape_or_type_are_refused(parts: Parts) -> None:
    with pytest.raises(ProtocolError, match="expected"):
        captured(parts)

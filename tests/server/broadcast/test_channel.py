from hypothesis import given, strategies as st

from transientcam_server.broadcast import UNNUMBERED, Channel
from transientcam_server.broadcast._channel import ChannelNumbers
from transientcam_server.imaging import MSGPACK, PRODUCTS, WHOLE, Crop, Encoding, stream_encoding

_U16 = stream_encoding("u16")


def channel(
    product: str = "range",
    *,
    rate_hz: float | None = None,
    encoding: Encoding = MSGPACK,
    crop: Crop = WHOLE,
) -> Channel:
    return Channel(UNNUMBERED, PRODUCTS[product], rate_hz, encoding, crop)


def test_channels_of_the_same_bytes_have_one_number_whatever_their_rate() -> None:
    numbers = ChannelNumbers()
    one, other = channel(), channel(rate_hz=2.0)

    numbers.assign([one])
    numbers.assign([other])

    assert one.number == other.number == 0


def test_product_encoding_region_and_decimation_each_make_another_number() -> None:
    numbers = ChannelNumbers()
    channels = [
        channel(),
        channel("direct"),
        channel(encoding=_U16),
        channel(crop=Crop((0, 0, 4, 4))),
        channel(crop=Crop(None, 2)),
    ]

    numbers.assign(channels)

    assert [each.number for each in channels] == [0, 1, 2, 3, 4]


def test_a_number_is_kept_until_its_last_user_is_gone() -> None:
    numbers = ChannelNumbers()
    one, other, later, last = channel(), channel(), channel("direct"), channel("flags")
    numbers.assign([one, other])
    numbers.release([one])
    numbers.assign([later])
    numbers.release([other])
    numbers.assign([last])

    assert (later.number, last.number) == (1, 0)


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 9)), max_size=60))
def test_numbers_in_use_are_unique_and_nothing_stays_behind(
    changes: list[tuple[bool, int]],
) -> None:
    numbers = ChannelNumbers()
    used: list[Channel] = []
    for comes, decimation in changes:
        if comes or not used:
            used.append(channel(crop=Crop(None, decimation)))
            numbers.assign(used[-1:])
        else:
            numbers.release([used.pop(0)])
        by_crop = {each.crop: each.number for each in used}
        assert len(set(by_crop.values())) == len(by_crop) == len(numbers)
        assert all(by_crop[each.crop] == each.number for each in used)
    numbers.release(used)

    assert len(numbers) == 0

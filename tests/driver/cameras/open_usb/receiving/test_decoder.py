from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from transientcam_driver.cameras.open_usb._receiving.decoder import ImagePacket, PacketDecoder
from transientcam_driver.cameras.open_usb.protocol import ImageFlag, ImageHeader, payload_checksum

PAYLOAD_BYTES = 96


def packet(number: int, payload: bytes | None = None) -> bytes:
    pixels = bytes([number % 251] * PAYLOAD_BYTES) if payload is None else payload
    header = ImageHeader(
        flags=ImageFlag.ILLUMINATION,
        epoch=1,
        frame=0,
        number=number,
        index=0,
        count=1,
        tuning_word=0,
        phase=0,
        harmonic=0,
        exposure_ns=1,
        device_time_ns=number,
        temperature_c=20.0,
        payload_bytes=len(pixels),
        payload_crc=payload_checksum(pixels),
    )
    return header.pack() + pixels


def decode(data: bytes, boundaries: list[int]) -> tuple[list[ImagePacket], PacketDecoder]:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)
    cuts = sorted({0, len(data), *(cut % (len(data) + 1) for cut in boundaries)})
    packets = []
    for start, end in pairwise(cuts):
        packets += decoder.feed(memoryview(data)[start:end])
    return packets, decoder


def numbers(packets: list[ImagePacket]) -> list[int]:
    return [found.header.number for found in packets if found.intact]


boundaries = st.lists(st.integers(0, 10_000), max_size=30)
# no magic inside, so that garbage stays garbage
garbage = st.binary(max_size=300).map(lambda data: data.replace(b"TCIM", b"...."))


@given(count=st.integers(0, 8), boundaries=boundaries)
def test_packets_are_found_whatever_the_read_boundaries(count: int, boundaries: list[int]) -> None:
    packets, decoder = decode(b"".join(packet(k) for k in range(count)), boundaries)

    assert numbers(packets) == list(range(count))
    assert [found.payload for found in packets] == [bytes([k] * 96) for k in range(count)]
    assert decoder.resyncs == 0


@given(boundaries=boundaries)
def test_pixels_stay_as_they_are_while_later_bytes_come(boundaries: list[int]) -> None:
    data = bytearray(b"".join(packet(k) for k in range(8)))
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)
    packets = []
    cuts = sorted({0, len(data), *(cut % (len(data) + 1) for cut in boundaries)})
    for start, end in pairwise(cuts):
        read = data[start:end]
        packets += decoder.feed(memoryview(read))
        read[:] = bytes(len(read))  # the next read overwrites it
    decoder.reset()

    assert [found.payload for found in packets] == [bytes([k] * 96) for k in range(8)]


@given(data=st.lists(st.binary(max_size=400) | st.just(b"TCIM")), boundaries=boundaries)
def test_arbitrary_bytes_never_raise_and_yield_nothing(
    data: list[bytes], boundaries: list[int]
) -> None:
    packets, _ = decode(b"".join(data), boundaries)

    assert packets == []


@given(between=st.lists(garbage, min_size=1, max_size=6), boundaries=boundaries)
def test_good_packets_between_garbage_are_always_found(
    between: list[bytes], boundaries: list[int]
) -> None:
    data = b"".join(part + packet(k) for k, part in enumerate(between))

    packets, decoder = decode(data, boundaries)

    assert numbers(packets) == list(range(len(between)))
    assert decoder.resyncs == sum(1 for part in between if part)


@given(cut=st.integers(1, 63), boundaries=boundaries)
def test_a_truncated_header_costs_that_packet_only(cut: int, boundaries: list[int]) -> None:
    packets, _ = decode(packet(0)[:cut] + packet(1) + packet(2), boundaries)

    assert numbers(packets) == [1, 2]


@given(cut=st.integers(64, 64 + PAYLOAD_BYTES - 1), boundaries=boundaries)
def test_a_truncated_payload_costs_that_image_only(cut: int, boundaries: list[int]) -> None:
    packets, _ = decode(packet(0)[:cut] + packet(1) + packet(2), boundaries)

    assert numbers(packets) == [1, 2]
    assert [found.header.number for found in packets if not found.intact] == [0]


@given(bit=st.integers(0, 64 * 8 - 1))
def test_a_damaged_header_costs_that_packet_only(bit: int) -> None:
    damaged = bytearray(packet(0))
    damaged[bit // 8] ^= 1 << bit % 8

    packets, decoder = decode(bytes(damaged) + packet(1), [])

    assert numbers(packets) == [1]
    assert decoder.resyncs == 1


@given(bit=st.integers(64 * 8, (64 + PAYLOAD_BYTES) * 8 - 1))
def test_a_damaged_payload_is_reported_and_costs_that_image_only(bit: int) -> None:
    damaged = bytearray(packet(0))
    damaged[bit // 8] ^= 1 << bit % 8

    packets, _ = decode(bytes(damaged) + packet(1), [])

    assert [(found.header.number, found.intact) for found in packets] == [(0, False), (1, True)]


@given(
    edits=st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), max_size=12),
    boundaries=boundaries,
)
def test_whatever_is_damaged_the_undamaged_packets_arrive_in_order(
    edits: list[tuple[int, int]], boundaries: list[int]
) -> None:
    size = 64 + PAYLOAD_BYTES
    data = bytearray(b"".join(packet(k) for k in range(8)))
    for at, value in edits:
        data[at % len(data)] = value
    untouched = [k for k in range(8) if bytes(data[k * size : (k + 1) * size]) == packet(k)]

    packets, _ = decode(bytes(data), boundaries)

    assert numbers(packets) == untouched


def test_a_header_that_announces_another_length_is_noise() -> None:
    packets, _ = decode(packet(0, bytes(2**16)) + packet(1), [])

    assert numbers(packets) == [1]


def test_a_packet_inside_the_pixels_of_another_is_not_one() -> None:
    inner = packet(7, bytes(16))[:PAYLOAD_BYTES]

    packets, _ = decode(packet(0, inner.ljust(PAYLOAD_BYTES)) + packet(1), [])

    assert numbers(packets) == [0, 1]


@pytest.mark.parametrize("kept", range(1, 64, 7))
def test_reset_forgets_the_bytes_of_a_stream_that_was_cut_off(kept: int) -> None:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)
    assert decoder.feed(packet(0)[:kept]) == []

    decoder.reset()

    assert numbers(decoder.feed(packet(1))) == [1]
    assert decoder.resyncs == 0


@pytest.mark.parametrize("noise", ["x" * count for count in range(9)])
def test_bytes_that_cannot_begin_a_packet_are_passed_over_at_once(noise: str) -> None:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)

    assert decoder.feed(noise.encode()) == []

    assert decoder.resyncs == (len(noise) >= len(b"TCIM"))
    assert numbers(decoder.feed(packet(0))) == [0]
    assert decoder.resyncs == (len(noise) > 0)


@pytest.mark.parametrize("before", [b"", packet(0), b"noise", b"noise" + packet(0)])
def test_noise_is_counted_again_after_a_reset(before: bytes) -> None:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)
    decoder.feed(before)
    counted = decoder.resyncs
    assert counted == before.startswith(b"noise")

    decoder.reset()
    decoder.feed(b"noise" + packet(1))

    assert decoder.resyncs == counted + 1


def test_the_length_that_an_intact_header_announced_is_kept_until_a_reset() -> None:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)
    announced = [decoder.odd_payload_bytes]

    for data in (packet(0), packet(1, bytes(90)) + packet(2, bytes(91)), packet(3)):
        decoder.feed(data)
        announced.append(decoder.odd_payload_bytes)
    decoder.reset()
    announced.append(decoder.odd_payload_bytes)

    assert announced == [None, None, 91, 91, None]


def test_memory_stays_bounded_under_endless_garbage() -> None:
    decoder = PacketDecoder(payload_bytes=PAYLOAD_BYTES)

    for _ in range(200):
        decoder.feed(b"TCIM and no more of a header than this, over and over " * 20)

    assert len(decoder._buffer) < 64 + PAYLOAD_BYTES + 2000

"""Whatever comes over the network, the driver ends in time and says what was wrong."""

import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from transientcam_driver import CameraError, CameraLost, CameraNotFound, ImagesLost
from transientcam_driver.cameras.tofcam660 import (
    AnswerType,
    Command,
    ControlConnection,
    DeviceOptions,
    PacketHeader,
    Tofcam660,
    pack_answer,
)
from transientcam_driver.cameras.tofcam660._images import TcpImages, UdpImages

ANSWER_S = 0.2
HEAD = struct.pack("!II", 0xFFFFAA55, 2)


@contextmanager
def peer(serve: Callable[[socket.socket], None]) -> Iterator[int]:
    """Let ``serve`` have one connection; its end is awaited."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def run() -> None:
            connection, _ = listener.accept()
            with connection, suppress(OSError):  # the driver has had enough
                serve(connection)

        thread = threading.Thread(target=run, name="peer")
        thread.start()
        yield listener.getsockname()[1]
        thread.join()


def send(data: bytes) -> Callable[[socket.socket], None]:
    def serve(connection: socket.socket) -> None:
        connection.recv(64)
        connection.sendall(data)
        connection.recv(64)

    return serve


def trickle(connection: socket.socket) -> None:
    """A byte at a time, each in time for a wait of its own."""
    connection.recv(64)
    pause = threading.Event()
    for _ in range(200):
        connection.sendall(HEAD[:1])
        pause.wait(ANSWER_S / 10)


def endless(connection: socket.socket) -> None:
    while True:
        connection.sendall(bytes(65536))


@pytest.mark.parametrize(
    ("serve", "reason"),
    [
        (send(b"HTTP/1.1 400 Bad Request\r\n\r\n"), "in place of the start marker"),
        (send(HEAD + b"\0"), "no answer within 0.2 s"),
        (send(HEAD + b"\0\0" + b"\0\0\0\0"), "in place of the end marker"),
        (send(struct.pack("!II", 0xFFFFAA55, 2**32 - 1)), "a payload of 4294967295 bytes"),
        (send(b""), "no answer within 0.2 s"),
        (lambda connection: None, "closed|reset"),
        (trickle, "start marker|no answer"),
        (endless, "in place of the start marker"),
    ],
    ids=["http", "half", "no-end", "huge", "silent", "closed", "trickle", "endless"],
)
def test_what_is_no_answer_ends_the_connection_with_a_reason(
    serve: Callable[[socket.socket], None], reason: str
) -> None:
    with peer(serve) as port:
        control = ControlConnection("127.0.0.1", port, answer_s=ANSWER_S)
        with pytest.raises(CameraLost, match=reason):
            control.exchange(Command.READ_CHIP)
        with pytest.raises(CameraLost):
            control.exchange(Command.READ_CHIP)


def test_an_address_without_a_device_is_no_camera() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(CameraNotFound, match=f"no camera answers at 127.0.0.1:{port}"):
        ControlConnection("127.0.0.1", port, answer_s=ANSWER_S)


@pytest.mark.parametrize(
    ("version", "data_over", "reason"),
    [((3, 9), "auto", "firmware is 3.9; 3.27 or newer"), ((3, 40), "tcp", "over UDP only")],
)
def test_firmware_that_lacks_something_is_named(
    version: tuple[int, int], data_over: str, reason: str
) -> None:
    answers = {
        Command.READ_FIRMWARE: pack_answer(AnswerType.FIRMWARE, struct.pack("!HH", *version)),
        Command.READ_CHIP: pack_answer(AnswerType.CHIP, bytes(4)),
        Command.READ_CALIBRATION: pack_answer(AnswerType.CALIBRATION),
    }

    def serve(connection: socket.socket) -> None:
        while request := connection.recv(64):
            connection.sendall(answers[Command(request[9])])

    with peer(serve) as port:
        options = DeviceOptions(data_over=data_over, control_port=port)  # type: ignore[arg-type]
        with pytest.raises(CameraError, match=reason):
            Tofcam660("127.0.0.1", options)


# --- images over UDP ---------------------------------------------------------------------------

IMAGE = bytes(range(200))


def packet(measurement: int, number: int, *, data: bytes | None = None, **changes: int) -> bytes:
    offset = 50 * number
    data = IMAGE[offset : offset + 50] if data is None else data
    fields = {"image_bytes": 200, "bytes_here": len(data), "offset": offset} | changes
    return PacketHeader(measurement=measurement, packets=4, number=number, **fields).pack() + data


@pytest.fixture
def udp() -> Iterator[tuple[UdpImages, Callable[..., None]]]:
    images = UdpImages("127.0.0.1", 0, image_s=0.1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

        def deliver(*packets: bytes) -> None:
            for each in packets:
                sender.sendto(each, ("127.0.0.1", images.port))

        yield images, deliver
    images.close()


Udp = tuple[UdpImages, Callable[..., None]]


@pytest.mark.parametrize(
    "order", [(0, 1, 2, 3), (3, 1, 0, 2), (0, 0, 1, 1, 2, 3)], ids=["in-order", "mixed", "doubled"]
)
def test_packets_make_an_image_in_any_order(udp: Udp, order: tuple[int, ...]) -> None:
    images, deliver = udp
    images.expect(200)
    deliver(*(packet(7, number) for number in order))

    assert images.receive(1.0) == IMAGE


@pytest.mark.parametrize(
    "junk",
    [
        b"",
        b"short",
        packet(7, 3, image_bytes=400),
        packet(7, 3, offset=190),
        packet(7, 3, offset=2**32 - 1),
        packet(7, 3, bytes_here=49),
        packet(7, 3, data=b""),
        packet(6, 3),
        packet(7, 2, offset=120),
    ],
    ids=["empty", "short", "size", "beyond", "far", "length", "none", "older", "overlap"],
)
def test_a_missing_packet_is_not_made_up_for_by_others(udp: Udp, junk: bytes) -> None:
    images, deliver = udp
    images.expect(200)
    deliver(packet(7, 0), packet(7, 1), packet(7, 2), junk)

    with pytest.raises(ImagesLost, match=r"bytes are missing after 0\.1 s"):
        images.receive(5.0)


def test_packets_of_an_earlier_image_do_not_get_into_the_next(udp: Udp) -> None:
    images, deliver = udp
    images.expect(200)
    deliver(packet(65535, 0, data=bytes(50)), packet(65535, 1, data=bytes(50)))
    deliver(*(packet(0, number) for number in range(4)))
    assert images.receive(1.0) == IMAGE

    deliver(packet(1, 0, data=bytes(50)))
    images.expect(200)
    deliver(*(packet(2, number) for number in range(4)))
    assert images.receive(1.0) == IMAGE


def test_another_sender_is_not_the_camera() -> None:
    images = UdpImages("127.0.0.9", 0, image_s=0.1)
    images.expect(200)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(4):
            sender.sendto(packet(1, number), ("127.0.0.1", images.port))
        with pytest.raises(ImagesLost):
            images.receive(1.0)
    images.close()


def test_a_wait_that_is_shorter_than_an_image_goes_on_with_the_next(udp: Udp) -> None:
    images, deliver = udp
    images.expect(200)
    deliver(packet(7, 0), packet(7, 1))
    assert images.receive(0.0) is None
    deliver(packet(7, 2), packet(7, 3))

    assert images.receive(1.0) == IMAGE


def test_a_port_that_another_program_has_is_named() -> None:
    first = UdpImages("127.0.0.1", 0, image_s=0.1)
    with pytest.raises(CameraError, match=f"UDP port {first.port} .* use data=tcp"):
        UdpImages("127.0.0.1", first.port, image_s=0.1)
    first.close()


# --- images over TCP ---------------------------------------------------------------------------


def test_the_rest_of_a_lost_image_is_left_with_its_connection() -> None:
    connections: list[socket.socket] = []
    with socket.create_server(("127.0.0.1", 0)) as listener:
        images = TcpImages("127.0.0.1", listener.getsockname()[1], image_s=0.1)
        connections.append(listener.accept()[0])
        images.expect(200)
        connections[0].sendall(IMAGE[:120])
        with pytest.raises(ImagesLost, match="80 of 200 bytes"):
            images.receive(5.0)
        images.expect(200)
        connections.append(listener.accept()[0])
        connections[1].sendall(IMAGE)
        assert images.receive(1.0) == IMAGE

        connections[1].sendall(b"more than was asked for")
        images._socket.recv(1, socket.MSG_PEEK)  # it has arrived
        images.expect(200)
        connections.append(listener.accept()[0])
        connections[2].sendall(IMAGE)
        assert images.receive(1.0) == IMAGE

        images.expect(200)
        connections[2].close()
        with pytest.raises(CameraLost, match=r"images at 127\.0\.0\.1: the connection was closed"):
            images.receive(1.0)
        images.close()
    for each in connections:
        each.close()

"""A mock of BECOM's Argos3D P320: the UDP stream of its raw phases, and what reads it.

Packets and frames are those of its software user manual (version 14, tables 3-23 to 3-25); BECOM's
own client (bta 3.3.11) reads the same of them. It repeats sequences of 10, 20 and 30 MHz. Nobody
states how its phases turn, or its noise: the former is assumed. Its registers (TCP) are not mocked.
"""

import socket
import struct
import threading
from binascii import crc_hqx
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_driver as driver
from transientcam_supervisor import OffSwitch

WIDTH, HEIGHT, RATE_HZ, C_M_S = 160, 120, 5.0, 299_792_458.0
RANGE_M = 3.0 + 4.0 * np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
F_HZ, EXPOSURE_S, RAW_PHASES = (10e6, 20e6, 30e6), 2e-3, 24 << 3
PACKET, FRAME = struct.Struct(">HHHHIII12x"), struct.Struct(">HHHHBBHIH8xBBHHHHBB4xB5xI10xH")
PART, NOT_CHECKED, OF_12_BITS, LIGHT_DN, NOISE_DN = 1400, 1, 0x3333, 1800.0, 8.0
MEASURED = tuple(driver.Exposure(f, k * np.pi / 2, EXPOSURE_S) for f in F_HZ for k in range(4))


def frame_of(counter: int, time_us: int, images: NDArray[np.uint16]) -> bytes:
    """Return a frame of four phases (4, H, W) as the device sends it: header, then the pixels."""
    turn, modulation = counter % 3, int(F_HZ[counter % 3] / 1e4)
    size, at = (3, WIDTH, HEIGHT, 4, 2, RAW_PHASES), (time_us % 2**32, counter % 2**16)
    state = 50 + 41, 50 + 38, 0x0801, 0x3331, int(EXPOSURE_S * 1e6), modulation, 50 + 35, 0
    head = FRAME.pack(0xFFFF, *size, *at, *state, turn, OF_12_BITS, 0)
    return head[:62] + struct.pack(">H", crc_hqx(head[2:62], 0)) + images.astype("<u2").tobytes()


class Sender(threading.Thread):
    """The device: sends each frame in packets, as long as its light is on."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self._port, self.ended = port, threading.Event()

    def run(self) -> None:
        rng, counter = np.random.default_rng(4), 3 * 21_844  # two of them before it overruns
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as to:
            while not self.ended.wait(1 / RATE_HZ / len(F_HZ)):
                time_us = 4_294_400_000 + round(counter % 65_532 * 1e6 / RATE_HZ / 3)
                turn = 4 * np.pi * F_HZ[counter % 3] * RANGE_M / C_M_S
                light = LIGHT_DN * (1 + np.cos(turn - np.pi / 2 * np.arange(4)[:, None, None])) / 2
                seen = 600.0 + light + NOISE_DN * rng.standard_normal(light.shape)
                data = frame_of(counter, time_us, np.rint(seen).astype(np.uint16))
                for number, first in enumerate(range(0, len(data), PART)):
                    part = data[first : first + PART]
                    about = 1, counter % 2**16, number, len(part), len(data), 0, NOT_CHECKED
                    to.sendto(PACKET.pack(*about) + part, ("127.0.0.1", self._port))
                counter += 1


class Device:
    off_switch = OffSwitch()

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self._socket.bind(("127.0.0.1", 0))
        self._sender: Sender | None = None
        self._frame, self._parts, self._images = -1, dict[int, bytes](), list[Any]()
        self._counter, self._time_us = 0, 0  # both go on where those of the device begin anew
        self.description = driver.Description(
            model="Argos3D P320 (mock)", serial="0", firmware="1.0.1", width=WIDTH, height=HEIGHT,
            frame_rate_hz=RATE_HZ, measurements=MEASURED,
        )  # fmt: skip

    def start(self, exposure_s: float) -> None:
        self._sender = Sender(self._socket.getsockname()[1])
        self._sender.start()

    def receive(self, timeout_s: float) -> driver.Capture | None:
        self._socket.settimeout(timeout_s)
        found = None
        with suppress(TimeoutError):
            while found is None:
                packet = self._socket.recv(2048)
                _, frame, number, length, size, _, _ = PACKET.unpack_from(packet)
                self._parts = self._parts if frame == self._frame else {}
                self._frame, self._parts[number] = frame, packet[PACKET.size :][:length]
                if sum(map(len, self._parts.values())) == size:
                    found = self._taken(b"".join(self._parts[k] for k in sorted(self._parts)))
        return found

    def _taken(self, data: bytes) -> driver.Capture | None:
        """Return the capture that a frame ends, if all of its frames have come."""
        *_, time_us, counter, temperature = FRAME.unpack_from(data)[:10]
        turn = FRAME.unpack_from(data)[-3]
        self._counter += (counter - self._counter) % 2**16
        self._time_us += (time_us - self._time_us) % 2**32
        self._images = self._images if turn else []
        self._images.extend(np.frombuffer(data[64:], "<u2").reshape(4, HEIGHT, WIDTH))
        if turn < 2 or len(self._images) < len(MEASURED):
            return None
        begun_s = self._time_us * 1e-6 - 2 / 3 / RATE_HZ
        return driver.Capture(self._images, self._counter // 3, begun_s, float(temperature - 50))

    def temperature_c(self) -> None: ...

    def light_off(self) -> None:
        if self._sender is not None:
            self._sender.ended.set()
            self._sender.join()

    def close(self) -> None:
        self.light_off()
        self._socket.close()


PLUGIN = driver.CameraPlugin(
    "a mock of BECOM's Argos3D P320", "argos:", lambda name, clock: driver.FreeRunningCamera(Device)
)

"""A TOFcam660 as a device that exposes on request: four phases of one frequency at a time."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, Capabilities
from transientcam_driver.cameras.tofcam660._control import ControlConnection
from transientcam_driver.cameras.tofcam660._image import ZERO_DN, dcs_images, image_bytes
from transientcam_driver.cameras.tofcam660._images import ImageConnection, TcpImages, UdpImages
from transientcam_driver.cameras.tofcam660._region import FULL, Region
from transientcam_driver.cameras.tofcam660._wire import (
    CONTROL_PORT,
    DATA_PORT,
    DLL_REGISTERS,
    AnswerType,
    CalibrationEntry,
    Command,
    ImageType,
    pack_request,
    unpack_calibration,
)
from transientcam_driver.errors import CameraError, DeviceRefused, ProtocolError
from transientcam_driver.sequence import MAX_HARMONICS, SPEED_OF_LIGHT_M_S, ImageLabel, Sampling
from transientcam_supervisor import OffSwitch, TcpMessage

FREE_FREQUENCY: Final = (3, 27)
CALIBRATION_DATA: Final = (3, 29)
DATA_OVER_TCP: Final = (3, 43)
"""Firmware from which on there is each; compared as numbers, since 3.9 is older than 3.51."""

MIN_FREQUENCY_HZ: Final = 0.25e6
MAX_FREQUENCY_HZ: Final = 28e6
"""The limits of the vendor's program; what the firmware itself refuses is not known."""
SETTLE_S: Final = 0.1
"""What the vendor's client waits for behind each change of the frequency."""
READOUT_S: Final = 10e-3
"""Of one image of the four, on its way: an assumption, not measured."""
_LONGEST_US: Final = 0xFFFF
_PHASES: Final = 4
_GRAYSCALE_US: Final = 25  # of an image that is not taken; the vendor's first value
_CODE_OF_24_MHZ: Final = 1
# the vendor's constants: box of the calibration, chip to front, delay line, temperature
_OFFSET_MM: Final = 330.0 - 28.0 - 7 / 8 * 12500.0 + 6250.0
_MM_PER_DEGREE: Final = 12.9 + 4.6

DataOver = Literal["auto", "tcp", "udp"]


@dataclass(frozen=True, slots=True)
class DeviceOptions:
    """How a TOFcam660 is used."""

    data_over: DataOver = "auto"
    """What images travel over; ``auto`` is TCP where the firmware has it."""
    region: Region = FULL
    """The part of the sensor that is read."""
    settle_s: float = SETTLE_S
    """Time for each change of the frequency."""
    answer_s: float = 1.0
    image_s: float = 1.0
    """``answer_s``, ``image_s``: time for an answer, and for an image."""
    multiples: tuple[int, ...] = ()
    """Which multiples of the base frequency are measured; 1 to m where it is empty."""
    control_port: int = CONTROL_PORT
    data_port: int = DATA_PORT
    udp_port: int = DATA_PORT
    """``control_port``, ``data_port``, ``udp_port``: of the camera for commands and images over
    TCP; and of this machine, for those over UDP."""


def offset_m(entries: tuple[CalibrationEntry, ...], temperature_c: float) -> float:
    """Return what the camera adds to every distance inside itself, in m.

    The vendor's client takes it from the entry of 24 MHz, whatever the frequency is: to a distance
    of arg b it adds 6250 - atan_offset + 17.5 (T_calibrated - T) + 330 - 28 - 7/8 * 12500 mm.
    Raises ProtocolError where there is no entry of 24 MHz.
    """
    for entry in entries:
        if entry.frequency_code == _CODE_OF_24_MHZ:
            drift_mm = (entry.temperature_c - temperature_c) * _MM_PER_DEGREE
            return -(_OFFSET_MM - entry.atan_offset_mm + drift_mm) / 1e3
    raise ProtocolError("calibration data without an entry of 24 MHz")


class Tofcam660:
    """One camera, connected: a `TriggeredDevice`.

    Raises CameraUnreachable: nothing answers at that address; CameraError where its firmware is too
    old, or refuses a setting.
    """

    def __init__(self, host: str, options: DeviceOptions | None = None) -> None:
        self._host = host
        self._options = options = options or DeviceOptions()
        self._control = ControlConnection(host, options.control_port, answer_s=options.answer_s)
        self._images: ImageConnection | None = None
        self._registers: dict[int, int] = {}
        self._frequency_hz: int | None = None
        self._integration_us = 0
        with self._closed_on_failure():
            self.firmware = self._firmware()
            self.chip = self._ask(Command.READ_CHIP, AnswerType.CHIP, "!HH")
            self.calibration = self._calibration()
            self._over_tcp_before = self._data_over_tcp()
            self._images = self._image_connection()
            self._prepare_registers()
            self.capabilities = self._capabilities(self.temperature_c())

    # --- as a TriggeredDevice ----------------------------------------------------------------

    @property
    def off_switch(self) -> OffSwitch:
        """The end of streaming, on a connection of its own; the four images end by themselves."""
        _, address = self._control.addresses
        return OffSwitch(
            f"{address}:{self._options.control_port}",
            (TcpMessage(pack_request(Command.STOP_STREAM)),),
            ends_s=_PHASES * (_LONGEST_US / 1e6 + READOUT_S),
        )

    def configure(self, applied: AppliedSequence) -> None:
        """Set the integration time, which the four images of a frequency share."""
        self._integration_us = round(applied.sequence.exposure_s * 1e6)
        times_us = (self._integration_us, 0, 0, _GRAYSCALE_US)
        self._do(Command.SET_INTEGRATION_TIMES, struct.pack("!4H", *times_us))

    def prepare(self, labels: tuple[ImageLabel, ...]) -> float:
        """Set the frequency, if it is another one."""
        frequency_hz = round(labels[0].frequency_hz)
        if frequency_hz == self._frequency_hz:
            return 0.0
        self._frequency_hz = None  # not known, where this fails
        self._do(Command.SET_FREE_FREQUENCY, struct.pack("!I", frequency_hz))
        self._frequency_hz = frequency_hz
        return self._options.settle_s

    def trigger(self, labels: tuple[ImageLabel, ...]) -> None:
        """Expose the four phases."""
        assert self._images is not None  # noqa: S101  (set before the constructor returns)
        self._images.expect(image_bytes(ImageType.DCS, self._options.region))
        self._do(Command.GET_DCS, b"\0")

    def receive(self, timeout_s: float) -> NDArray[np.uint16] | None:
        """Return the images of the four phases."""
        assert self._images is not None  # noqa: S101  (the same)
        data = self._images.receive(timeout_s)
        if data is None:
            return None
        return dcs_images(data, self._options.region, self._integration_us)

    def temperature_c(self) -> float:
        """Return the temperature of the chip at the last image."""
        (centidegrees,) = self._ask(Command.READ_TEMPERATURE, AnswerType.TEMPERATURE, "!h")
        return centidegrees / 100

    def light_off(self) -> None:
        """End streaming; single images end by themselves."""
        self._do(Command.STOP_STREAM)

    def close(self) -> None:
        """Set back what was changed for good, as far as the camera still answers."""
        with suppress(CameraError):
            self._do(Command.STOP_STREAM)
            for register, value in self._registers.items():
                self._do(Command.WRITE_REGISTER, bytes([register, value]))
            if self.firmware >= DATA_OVER_TCP:
                self._do(Command.SET_DATA_PROTOCOL, bytes([self._over_tcp_before]))
        self._disconnect()

    # --- beside that -------------------------------------------------------------------------

    @property
    def udp_port(self) -> int:
        """Where images arrive over UDP; 0 over TCP."""
        return self._images.port if isinstance(self._images, UdpImages) else 0

    def facts(self) -> Iterator[tuple[str, str]]:
        """Read what a report of a fault should hold."""
        yield "firmware", ".".join(map(str, self.firmware))
        yield "chip", f"wafer {self.chip[0]}, chip {self.chip[1]}"
        yield "temperature", f"{self.temperature_c():.2f} °C"
        for entry in self.calibration:
            text = f"{entry.atan_offset_mm} mm at {entry.temperature_c:.3f} °C"
            yield "calibration", f"frequency code {entry.frequency_code}: {text}"
        found = (f"{register:#04x}: {value:#04x}" for register, value in self._registers.items())
        yield "registers", ", ".join(found)
        images = "UDP" if self.udp_port else "TCP"
        before = ("UDP", "TCP")[min(1, self._over_tcp_before)]
        yield "images", f"over {images}, before over {before}; region {self._options.region.edges}"

    # --- requests ----------------------------------------------------------------------------

    def _do(self, command: Command, data: bytes = b"") -> None:
        """Send a command that is answered by an acknowledgement."""
        self._ask(command, AnswerType.ACKNOWLEDGE, "!", data)

    def _ask(
        self, command: Command, kind: AnswerType, layout: str, data: bytes = b""
    ) -> tuple[int, ...]:
        return self._control.exchange(command, data).fields(kind, layout)

    def _firmware(self) -> tuple[int, int]:
        major, minor = self._ask(Command.READ_FIRMWARE, AnswerType.FIRMWARE, "!HH")
        if (major, minor) < FREE_FREQUENCY:
            needed = ".".join(map(str, FREE_FREQUENCY))
            raise CameraError(
                f"the camera's firmware is {major}.{minor}; {needed} or newer is needed, which "
                "takes any modulation frequency"
            )
        return major, minor

    def _calibration(self) -> tuple[CalibrationEntry, ...]:
        if self.firmware < CALIBRATION_DATA:
            return ()
        return unpack_calibration(self._control.exchange(Command.READ_CALIBRATION))

    def _data_over_tcp(self) -> int:
        if self.firmware < DATA_OVER_TCP:
            return 0
        (over_tcp,) = self._ask(Command.READ_DATA_PROTOCOL, AnswerType.DATA_PROTOCOL, "!B")
        return over_tcp

    def _image_connection(self) -> ImageConnection:
        options = self._options
        can_tcp = self.firmware >= DATA_OVER_TCP
        if options.data_over == "tcp" and not can_tcp:
            raise CameraError("the camera's firmware sends images over UDP only: use data=udp")
        over_tcp = options.data_over == "tcp" or (options.data_over == "auto" and can_tcp)
        if can_tcp:
            self._do(Command.SET_DATA_PROTOCOL, bytes([over_tcp]))
        if over_tcp:
            return TcpImages(self._host, options.data_port, image_s=options.image_s)
        own_address, camera_address = self._control.addresses
        images = UdpImages(camera_address, options.udp_port, image_s=options.image_s)
        own = ip_address(own_address).packed
        with suppress(DeviceRefused):  # then images go where it is set to send them
            self._do(Command.SET_DATA_ADDRESS, own)
        return images

    def _prepare_registers(self) -> None:
        """Set what free frequencies need, and leave nothing on that changes images."""
        for register in DLL_REGISTERS:
            (value,) = self._ask(
                Command.READ_REGISTER, AnswerType.REGISTER, "!B", bytes([register])
            )
            self._registers[register] = value
        for register in DLL_REGISTERS:
            self._do(Command.WRITE_REGISTER, bytes([register, 0]))
        self._do(Command.SET_HDR, b"\0")
        self._do(Command.SET_BINNING, b"\0")
        self._do(Command.SET_FILTER)
        self._do(Command.SET_ROI, struct.pack("!4H", *self._options.region.edges))

    def _capabilities(self, temperature_c: float) -> Capabilities:
        wafer, chip = self.chip
        region = self._options.region
        inside_m = offset_m(self.calibration, temperature_c) if self.calibration else 0.0
        return Capabilities(
            model="ESPROS TOFcam660", serial=f"{wafer}-{chip}",
            firmware=".".join(map(str, self.firmware)), protocol_version=self.firmware[0],
            width=region.width, height=region.height, bits=12, readout_s=READOUT_S,
            streaming_readout_s=READOUT_S, settle_s=self._options.settle_s, tuning_step_hz=1.0,
            min_frequency_hz=MIN_FREQUENCY_HZ, max_frequency_hz=MAX_FREQUENCY_HZ,
            low_frequency_hz=MIN_FREQUENCY_HZ,
            max_harmonics=len(self._options.multiples) or MAX_HARMONICS,
            sampling=Sampling(self._options.multiples), min_exposure_s=1e-6,
            max_exposure_s=_LONGEST_US / 1e6, exposure_step_s=1e-6,
            zeroths=("estimated", "low-frequency"), delay_s=2 * inside_m / SPEED_OF_LIGHT_M_S,
            dark_dn=float(ZERO_DN),
        )  # fmt: skip

    @contextmanager
    def _closed_on_failure(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._disconnect()
            raise

    def _disconnect(self) -> None:
        if self._images is not None:
            self._images.close()
        self._control.close()

"""Capabilities of the device: GET_CAPS (usb-protocol 4)."""

import math
import struct
from typing import TypeVar

from crc32c import crc32c

from transientcam_driver.camera import IMAGE_HEADER_BYTES, Capabilities
from transientcam_driver.cameras.open_usb.protocol._requests import VERSION
from transientcam_driver.cameras.open_usb.protocol._sequences import SCHEMES, TAKE_ORDERS, ZEROTHS
from transientcam_driver.cameras.open_usb.protocol._units import nanoseconds
from transientcam_driver.errors import FirmwareTooOld, ProtocolError

_Word = TypeVar("_Word", bound=str)
_CAPS_MAGIC = b"TCCP"
_PHASE_OFFSETS = 1
_CAPS = struct.Struct("<4sHH32s32s16sHHBBBBBBHHBxIIIIIIIIIII")
CAPS_BYTES = _CAPS.size + 4
CAPS_ROOM_BYTES = 512
"""Length that a host requests, so that later fields fit (usb-protocol 3)."""


def pack_capabilities(capabilities: Capabilities) -> bytes:
    """Answer to GET_CAPS."""
    c = capabilities
    body = _CAPS.pack(
        _CAPS_MAGIC, c.protocol_version, CAPS_BYTES, c.model.encode(), c.serial.encode(),
        c.firmware.encode(), c.width, c.height, c.bits, c.max_harmonics, c.max_sub_phases,
        _bits(c.schemes, SCHEMES), _bits(c.zeroths, ZEROTHS),
        _bits(c.take_orders[1:], TAKE_ORDERS[1:]), c.max_takes, c.max_images,
        _PHASE_OFFSETS * c.phase_offsets, round(c.tuning_step_hz * 1e6),
        c.tuning_word(c.min_frequency_hz), c.tuning_word(c.max_frequency_hz),
        c.tuning_word(c.low_frequency_hz), nanoseconds(c.min_exposure_s),
        nanoseconds(c.max_exposure_s), nanoseconds(c.readout_s), nanoseconds(c.streaming_readout_s),
        c.fifo_bytes, round(c.heartbeat_s * 1e3), 0,
    )  # fmt: skip
    return body + struct.pack("<I", crc32c(body))


def unpack_capabilities(data: bytes) -> Capabilities:
    """Read the answer to GET_CAPS.

    Raises FirmwareTooOld where the device has another version of the protocol; ProtocolError where
    the block is damaged, or a field is out of range.
    """
    if len(data) < 8 or data[:4] != _CAPS_MAGIC:
        raise ProtocolError(f"{len(data)} bytes without the mark of capabilities")
    version, length = struct.unpack_from("<HH", data, 4)
    if version != VERSION:  # usb-protocol 4: another version is another protocol
        raise FirmwareTooOld(version, VERSION)
    if length < CAPS_BYTES or len(data) < length:
        raise ProtocolError(f"capabilities of {len(data)} bytes, {max(length, CAPS_BYTES)} needed")
    if crc32c(data[: length - 4]) != struct.unpack_from("<I", data, length - 4)[0]:
        raise ProtocolError("capabilities with a wrong checksum")
    # usb-protocol 4: later revisions append fields before the CRC; the known ones stay in front
    (
        *_, model, serial, firmware, width, height, bits, max_harmonics, max_sub_phases, schemes,
        zeroths, take_orders, max_takes, max_images, options, step_uhz, min_word, max_word,
        low_word, min_exposure_ns, max_exposure_ns, readout_ns, streaming_readout_ns, fifo_bytes,
        heartbeat_ms, _reserved,
    ) = _CAPS.unpack_from(data)  # fmt: skip
    step_hz = step_uhz / 1e6
    capabilities = Capabilities(
        model=_text(model), serial=_text(serial), firmware=_text(firmware),
        protocol_version=version, width=width, height=height, bits=bits, readout_s=readout_ns / 1e9,
        streaming_readout_s=streaming_readout_ns / 1e9, tuning_step_hz=step_hz,
        min_frequency_hz=min_word * step_hz, max_frequency_hz=max_word * step_hz,
        low_frequency_hz=low_word * step_hz, max_harmonics=max_harmonics,
        min_exposure_s=min_exposure_ns / 1e9, max_exposure_s=max_exposure_ns / 1e9,
        max_takes=max_takes, max_sub_phases=max_sub_phases, max_images=max_images,
        schemes=_named(schemes, SCHEMES), zeroths=_named(zeroths, ZEROTHS),
        take_orders=(TAKE_ORDERS[0], *_named(take_orders, TAKE_ORDERS[1:])), fifo_bytes=fifo_bytes,
        heartbeat_s=heartbeat_ms / 1e3, phase_offsets=bool(options & _PHASE_OFFSETS),
    )  # fmt: skip
    _check_capabilities(capabilities)
    return capabilities


def _check_capabilities(c: Capabilities) -> None:
    """Refuse values by which callers would divide by zero, overflow or loop without end."""
    ranges = (
        ("width", c.width, 1, 4096),
        ("height", c.height, 1, 4096),
        ("bits", c.bits, 1, 16),
        ("harmonics", c.max_harmonics, 1, 255),
        ("sub-phases", c.max_sub_phases, 1, 255),
        ("takes", c.max_takes, 1, 65535),
        ("images", c.max_images, 1, 65535),
        ("tuning step in Hz", c.tuning_step_hz, 1e-6, 1e6),
        ("lowest frequency in Hz", c.min_frequency_hz, 1, c.max_frequency_hz),
        ("shortest exposure in s", c.min_exposure_s, 1e-9, c.max_exposure_s),
        ("heartbeat in s", c.heartbeat_s, 0.01, 3600),
        ("known schemes of sub-phases", len(c.schemes), 1, len(SCHEMES)),
        ("known ways to the zeroth moment", len(c.zeroths), 1, len(ZEROTHS)),
        ("FIFO in bytes", c.fifo_bytes, IMAGE_HEADER_BYTES + c.image_bytes, math.inf),
    )
    for name, value, least, most in ranges:
        if not least <= value <= most:
            raise ProtocolError(f"capabilities with {value} for {name} ({least} to {most})")


def _text(field: bytes) -> str:
    return field.rstrip(b"\0").decode("utf-8", "replace")


def _bits(names: tuple[_Word, ...], known: tuple[_Word, ...]) -> int:
    return sum(1 << known.index(name) for name in names)


def _named(bits: int, known: tuple[_Word, ...]) -> tuple[_Word, ...]:
    return tuple(name for k, name in enumerate(known) if bits >> k & 1)

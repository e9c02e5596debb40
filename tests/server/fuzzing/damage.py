"""Damage to HDF5 files as bytes: flipped, cut, moved, torn, or with checksums made right."""

import random
import re
import struct
from collections.abc import Callable, Iterator
from typing import Final

_HEAP_BYTES: Final = 4096
_MASK: Final = 0xFFFFFFFF
_EXTREMES: Final = (
    0,
    1,
    0x7F,
    0xFF,
    0x7FFF,
    0xFFFF,
    0x7FFFFFFF,
    0xFFFFFFFF,
    2**40,
    2**63,
    2**64 - 1,
)


def lookup3(data: bytes) -> int:
    """Return Bob Jenkins' hash `hashlittle` with an initial value of 0, HDF5's checksum.

    https://burtleburtle.net/bob/c/lookup3.c, which is in the public domain.
    """
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    full = max(0, (len(data) - 1) // 12)
    words: tuple[int, ...] = struct.unpack(f"<{3 * full}I", data[: 12 * full])
    for x, y, z in zip(words[::3], words[1::3], words[2::3], strict=True):
        a, b, c = (a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK
        a = ((a - c) ^ _rotated(c, 4)) & _MASK
        c = (c + b) & _MASK
        b = ((b - a) ^ _rotated(a, 6)) & _MASK
        a = (a + c) & _MASK
        c = ((c - b) ^ _rotated(b, 8)) & _MASK
        b = (b + a) & _MASK
        a = ((a - c) ^ _rotated(c, 16)) & _MASK
        c = (c + b) & _MASK
        b = ((b - a) ^ _rotated(a, 19)) & _MASK
        a = (a + c) & _MASK
        c = ((c - b) ^ _rotated(b, 4)) & _MASK
        b = (b + a) & _MASK
    tail = data[12 * full :]
    if not tail:
        return c
    x, y, z = (_u32(tail.ljust(12, b"\0"), at) for at in (0, 4, 8))
    a, b, c = (a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK
    c = ((c ^ b) - _rotated(b, 14)) & _MASK
    a = ((a ^ c) - _rotated(c, 11)) & _MASK
    b = ((b ^ a) - _rotated(a, 25)) & _MASK
    c = ((c ^ b) - _rotated(b, 16)) & _MASK
    a = ((a ^ c) - _rotated(c, 4)) & _MASK
    b = ((b ^ a) - _rotated(a, 14)) & _MASK
    return ((c ^ b) - _rotated(b, 24)) & _MASK


def _rotated(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & _MASK


def checked_blocks(data: bytes) -> Iterator[tuple[int, int]]:
    """Find the superblock and the object headers: begin, and place of the checksum over them."""
    yield 0, 44
    at = data.find(b"OHDR")
    while at >= 0:
        flags = data[at + 5]
        size_at = at + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        size_bytes = 1 << (flags & 3)
        size = int.from_bytes(data[size_at : size_at + size_bytes], "little")
        end = size_at + size_bytes + size
        if end + 4 <= len(data) and lookup3(data[at:end]) == _u32(data, end):
            yield at, end
        at = data.find(b"OHDR", at + 4)


def _u32(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 4], "little")


def flipped(data: bytes, draw: random.Random) -> bytes:
    """Flip up to 8 bits."""
    changed = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 8))):
        changed[draw.randrange(len(changed))] ^= 1 << draw.randrange(8)
    return bytes(changed)


def cut(data: bytes, draw: random.Random) -> bytes:
    """Leave the end away."""
    return data[: draw.randrange(len(data))]


def overwritten(data: bytes, draw: random.Random) -> bytes:
    """Replace a piece by zeros, noise, or another piece."""
    size = draw.choice((1, 4, 8, 64, 512, 4096))
    at, source = draw.randrange(len(data)), draw.randrange(len(data))
    piece = draw.choice((bytes(size), draw.randbytes(size), data[source : source + size]))
    return data[:at] + piece + data[at + len(piece) :]


def resummed(data: bytes, draw: random.Random) -> bytes:
    """Change a number in a checked block, so that its checksum holds again."""
    begin, end = draw.choice(list(checked_blocks(data)))
    changed = bytearray(data)
    for _ in range(draw.choice((1, 1, 2))):
        at = draw.randrange(begin + 4, end)
        if draw.random() < 0.5:
            changed[at] ^= 1 << draw.randrange(8)
        else:
            size = min(draw.choice((1, 2, 4, 8)), end - at)
            value = draw.choice(_EXTREMES) & (256**size - 1)
            changed[at : at + size] = value.to_bytes(size, "little")
    changed[end : end + 4] = lookup3(bytes(changed[begin:end])).to_bytes(4, "little")
    return bytes(changed)


def torn(data: bytes, draw: random.Random) -> bytes:
    """Damage a heap of texts: a sector of it lost, or an object that states another size."""
    heaps = [match.start() for match in re.finditer(b"GCOL\1", data)]
    changed = bytearray(data)
    at, inside = draw.choice(heaps), draw.randrange(0, _HEAP_BYTES, 8)
    if draw.random() < 0.5:
        size = min(draw.choice((8, 16, 512, _HEAP_BYTES)), len(data) - at - inside)
        changed[at + inside : at + inside + size] = bytes(size)
    else:
        at += draw.choice((8, 16 + inside))
        changed[at : at + 8] = draw.choice(_EXTREMES).to_bytes(8, "little")
    return bytes(changed[: len(data)])


DAMAGES: Final[dict[str, Callable[[bytes, random.Random], bytes]]] = {
    each.__name__: each for each in (flipped, cut, overwritten, resummed, torn)
}
"""All kinds by name."""

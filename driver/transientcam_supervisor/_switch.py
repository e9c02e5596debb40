"""How a process that does not own a camera switches its light off: plain values."""

import ast
from dataclasses import astuple, dataclass


@dataclass(frozen=True, slots=True)
class UsbControl:
    """A control request that sends ``data``; one to the device goes beside any owner."""

    request_type: int
    request: int
    value: int = 0
    index: int = 0
    data: bytes = b""


@dataclass(frozen=True, slots=True)
class UsbClaim:
    """Claim an interface, and take it from the process that has it.

    It is given back only once the owner has said that the light is off: until then, the owner's
    own requests to the interface fail.
    """

    interface: int


@dataclass(frozen=True, slots=True)
class UsbSetting:
    """Choose an alternate setting of an interface."""

    interface: int
    alternate: int


@dataclass(frozen=True, slots=True)
class UsbWrite:
    """A bulk transfer to the device."""

    endpoint: int
    data: bytes


@dataclass(frozen=True, slots=True)
class UsbRead:
    """A bulk transfer from the device, whatever comes: an answer that it waits to give."""

    endpoint: int
    most_bytes: int


@dataclass(frozen=True, slots=True)
class UsbReset:
    """Reset the port, where a step before this one has failed."""


@dataclass(frozen=True, slots=True)
class TcpMessage:
    """Connect anew, send ``data``, and wait until the device answers with anything."""

    data: bytes


Step = UsbControl | UsbClaim | UsbSetting | UsbWrite | UsbRead | UsbReset | TcpMessage
_STEPS = {
    each.__name__: each
    for each in (UsbControl, UsbClaim, UsbSetting, UsbWrite, UsbRead, UsbReset, TcpMessage)
}


def _plain(value: int | bytes) -> int | bytes:
    """Return a number of an enumeration as a number."""
    return value if isinstance(value, bytes) else int(value)


@dataclass(frozen=True, slots=True)
class OffSwitch:
    """How another process switches a camera's light off."""

    at: str = ""
    """Where the camera is: a device node of usbfs, ``HOST:PORT``."""
    steps: tuple[Step, ...] = ()
    """What switches it off, in this order; all are tried, whatever fails. None: nothing but its
    owner does."""
    start_s: float = 0.0
    """How long a start may take before the light is on: the owner says nothing meanwhile."""
    ends_s: float = 0.0
    """Each request lights for so long at most, and is then over by itself; 0 where the light of a
    request stays on."""

    def pack(self) -> bytes:
        """Return it as text that `unpack` takes."""
        steps = [(type(each).__name__, *map(_plain, astuple(each))) for each in self.steps]
        return repr((self.at, steps, self.start_s, self.ends_s)).encode()

    @classmethod
    def unpack(cls, data: bytes) -> "OffSwitch":
        """Read what `pack` returned; runs none of it."""
        at, steps, start_s, ends_s = ast.literal_eval(data.decode())
        made = tuple(_STEPS[name](*fields) for name, *fields in steps)
        return cls(at, made, start_s, ends_s)

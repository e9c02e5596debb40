"""An OPT8241-CDK as a device that exposes on request: all phases of one frequency at a time."""

import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, Capabilities
from transientcam_driver.cameras.open_usb import VENDOR_OUT
from transientcam_driver.errors import CameraError, DeviceRefused, ImagesLost
from transientcam_driver.sequence import ImageLabel, Sampling
from transientcam_opt8241 import _registers as reg
from transientcam_opt8241._control import LIGHT_DRIVER, MONITORS, Control
from transientcam_opt8241._link import SLACK_BYTES, Link, Request
from transientcam_opt8241._pll import CLOCK_HZ, PllSetting
from transientcam_opt8241._registers import Field
from transientcam_supervisor import OffSwitch, UsbControl

PRODUCT: Final = "Texas Instruments OPT8241-CDK"
COLUMNS: Final = 320
ROWS: Final = 240
BITS: Final = 12
ZERO_DN: Final = 1 << (BITS - 1)
"""What a quad of 0 is in an image; a quad d is ``ZERO_DN + d``."""
QUADS: Final = (4, 6)
"""Phases of a frequency that there can be."""
MIN_FREQUENCY_HZ: Final = 10e6
MAX_FREQUENCY_HZ: Final = 100e6
"""Of the data sheet; the evaluation kit's own range is 39 to 60 MHz."""
QUAD_CLOCKS: Final = 100_000
"""Length of a quad; the kit takes 50 000 or more."""
QUAD_S: Final = QUAD_CLOCKS / CLOCK_HZ
DUTY_S: Final = QUAD_S / 64
MOST_DUTY: Final = 20
"""The kit's limit of `registers.INTG_DUTY_CYCLE`."""
PLL_SETTLE_S: Final = 10e-3
"""What the SDK waits for before an update of the PLL takes effect."""
MIXED_FRAMES: Final = 1
"""That are dropped after the sensor is started: the frame in flight may hold two frequencies."""
FRAME_S: Final = 0.2
"""The SDK's timeout of a read."""
_TRIES: Final = 3

_STARTED: Final[dict[Field, int]] = {
    reg.INIT_2: 310,
    reg.INIT_3: 330,
    reg.INIT_4: 1,
    reg.INIT_5: 3,
    reg.SSCG_EN: 0,  # spread spectrum would smear phases
    reg.QUAD_HOP_EN: 0,
    reg.SUB_FRAME_CNT_MAX: 1,
    reg.DEALIAS_EN: 0,
    reg.OUTPUT_MODE: reg.RAW_QUADS,
    reg.ROWS_TO_MERGE: 1,
    reg.BINNING_EN: 0,
    reg.BIN_ROW_COUNT: ROWS,
    reg.COLS_TO_MERGE: 1,
    reg.BIN_COL_COUNT: COLUMNS,
    reg.PHY_TEST_ENABLE: 0,
    reg.AMPLITUDE_THRESHOLD: 1,
    reg.OP_CLK_FREQ: 0,
    reg.DEBUG_FRAME_NUMBER_EN: 0,
    reg.BLK_SIZE: 512,
    reg.BLK_HEADER_EN: 0,
    reg.FB_READY_EN: 1,
    reg.OP_CS_POL: 1,
    reg.NORMAL_FRM_INTG_SCALE: 0,
    reg.FILT_EN: 0,
}
"""Beside the SDK's start-up values, all that would change raw quads is off."""


class Opt8241:
    """One camera, claimed: a `TriggeredDevice`.

    Its sensor runs, and its light is on, only from `trigger` until the frame is there; without its
    owner it runs on.

    ``link``: to the camera.
    ``quads``: phases of a frequency, 4 or 6.
    Raises CameraError where the camera does not answer.
    """

    def __init__(self, link: Link, *, quads: int = 4) -> None:
        self._link = link
        self._control = Control(link)
        self._quads = quads
        self._frequency_hz: float | None = None
        self._mixed = self._misses = 0
        self._closed = False
        try:
            self._start_up()
            stop = self._control.written(reg.TG_DIS)
            halt = UsbControl(VENDOR_OUT, Request.WRITE_REGISTER, *reg.TG_DIS.place, stop)
            self.off_switch = OffSwitch(link.node, (halt,))
            version = (self._control.get(each) for each in (reg.MAJOR, reg.MINOR))
            self.capabilities = self._capabilities(".".join(map(str, version)))
        except BaseException:
            link.close()
            raise

    # --- as a TriggeredDevice ----------------------------------------------------------------

    def configure(self, applied: AppliedSequence) -> None:
        """Set how long the light is on in a quad.

        Raises DeviceRefused where the camera says that it cannot.
        """
        duty = round(applied.sequence.exposure_s / DUTY_S)
        self._halt()
        self._control.set({reg.PIX_CNT_MAX: QUAD_CLOCKS})
        self._control.set({reg.INTG_DUTY_CYCLE: duty})
        for failed in (reg.PIX_CNT_MAX_SET_FAILED, reg.INTG_DUTY_CYCLE_SET_FAILED):
            if self._control.get(failed):
                name = "length" if failed is reg.PIX_CNT_MAX_SET_FAILED else "duty cycle"
                raise DeviceRefused("SET_EXPOSURE", "SET_FAILED", f"the {name} of a quad")

    def prepare(self, labels: tuple[ImageLabel, ...]) -> float:
        """Set the frequency, if it is another one; it takes effect when the sensor starts."""
        frequency_hz = labels[0].frequency_hz
        if frequency_hz == self._frequency_hz:
            return 0.0
        self._frequency_hz = None  # not known, where this fails
        pll = PllSetting.of(frequency_hz, self._quads)
        self._halt()
        self._control.set({reg.MOD_PLL_UPDATE: 1})
        self._control.set(
            {
                reg.MOD_M1: pll.m,
                reg.MOD_M_FRAC1: pll.fraction,
                reg.MOD_N1: 2,
                reg.MOD_PS1: pll.post_divider,
                reg.DELAY_FB_COEFF_1: delay_coefficient(frequency_hz),
            }
        )
        self._frequency_hz = frequency_hz
        return PLL_SETTLE_S

    def trigger(self, labels: tuple[ImageLabel, ...]) -> None:
        """Start the sensor."""
        self._halt()  # where frames of an earlier trigger still come
        self._link.clear_halt()
        self._mixed, self._misses = MIXED_FRAMES, 0
        self._control.set({reg.MOD_PLL_UPDATE: 0})
        self._control.set({reg.TG_DIS: 0})

    def receive(self, timeout_s: float) -> NDArray[np.uint16] | None:
        """Return the images of all phases, and stop the sensor."""
        size = ROWS * COLUMNS * self._quads * 2
        # never a shorter time: what a frame leaves behind would be taken for the begin of the next
        data = self._link.read(size + SLACK_BYTES, timeout_s=max(timeout_s, FRAME_S))
        if data is None:
            self._misses += 1
            if self._misses < _TRIES:
                return None
            self._halt()
            raise ImagesLost(f"no frame came within {_TRIES * FRAME_S:g} s")
        if self._mixed:
            self._mixed -= 1
            return None
        self._halt()
        if len(data) != size:
            raise ImagesLost(f"a frame had {len(data)} bytes, not {size}")
        return quad_images(data, self._quads)

    def temperature_c(self) -> float:
        """Return the temperature of the sensor, in whole degrees."""
        return float(self._control.get(reg.TSENSOR))

    def light_off(self) -> None:
        """Stop the sensor."""
        self._halt()

    def close(self) -> None:
        """Stop the sensor, as far as the camera still answers, and give it back; once."""
        if not self._closed:
            self._closed = True
            with suppress(CameraError):
                self._halt()
            self._link.close()

    # --- beside that -------------------------------------------------------------------------

    def facts(self) -> Iterator[tuple[str, str]]:
        """Read what a report of a fault should hold."""
        yield "firmware", self.capabilities.firmware
        yield "serial number", self.capabilities.serial
        light_c = self._control.get(reg.TILLUM)
        yield "temperature", f"sensor {self.temperature_c():g} °C, light {light_c} °C"
        words = sorted({each.place for each in reg.all_fields()})
        whole = (Field(*place, 23, 0) for place in words)
        shown = (f"{slave:02x}:{number:02x}" for slave, number in words)
        values = (f"{self._control.get(each):06x}" for each in whole)
        yield "registers", ", ".join(map(" = ".join, zip(shown, values, strict=True)))

    def _halt(self) -> None:
        self._control.set({reg.TG_DIS: 1})

    def _start_up(self) -> None:
        """Write what the SDK writes when it starts, the sensor stopped."""
        self._halt()
        self._control.set_supply(LIGHT_DRIVER, 0x10, 0xC0)
        for monitor, setting in zip(MONITORS, (0x4807, 0x4F1B), strict=True):
            self._control.set_monitor(monitor, 0x00, 0x274F)
            self._control.set_monitor(monitor, 0x05, setting)
        self._control.set_supply(LIGHT_DRIVER, 0x00, 108)  # comparator of the light: 1405 mV
        self._control.set({**_STARTED, reg.QUAD_CNT_MAX: self._quads})

    def _capabilities(self, firmware: str) -> Capabilities:
        phases_rad = tuple(2 * math.pi * k / self._quads for k in range(self._quads))
        dark_s = QUAD_S - MOST_DUTY * DUTY_S
        return Capabilities(
            model=PRODUCT,
            serial=self._link.serial,
            firmware=firmware,
            protocol_version=1,
            width=COLUMNS,
            height=ROWS,
            bits=BITS,
            readout_s=dark_s,
            streaming_readout_s=dark_s,
            settle_s=PLL_SETTLE_S + MIXED_FRAMES * self._quads * QUAD_S,
            tuning_step_hz=1.0,
            min_frequency_hz=MIN_FREQUENCY_HZ,
            max_frequency_hz=MAX_FREQUENCY_HZ,
            max_harmonics=round(MAX_FREQUENCY_HZ / MIN_FREQUENCY_HZ),
            sampling=Sampling() if self._quads == 4 else Sampling((), phases_rad),
            min_exposure_s=DUTY_S,
            max_exposure_s=MOST_DUTY * DUTY_S,
            exposure_step_s=DUTY_S,
            dark_dn=float(ZERO_DN),
        )


def delay_coefficient(frequency_hz: float) -> int:
    """Return `registers.DELAY_FB_COEFF_1` for a frequency, the largest one above 96 MHz."""
    return min(round(frequency_hz * 1024 / (CLOCK_HZ / 2)), (1 << 12) - 1)


def quad_images(data: bytes, quads: int) -> NDArray[np.uint16]:
    """Return the images (quads, 240, 320) of a raw frame.

    Its words are the quads of a pixel one behind the other, 12 bits signed: ``d_k = A cos(phi -
    2 pi k / quads)``, so that image k has the phase 2 pi k / quads. A quad at either end of its
    scale has the highest code: there it is saturated.
    """
    words = np.frombuffer(data, "<u2").reshape(ROWS, COLUMNS, quads)
    images = np.ascontiguousarray(words.transpose(2, 0, 1)).astype(np.uint16)
    images ^= ZERO_DN  # from two's complement to an offset
    images &= (1 << BITS) - 1
    images[images == 0] = (1 << BITS) - 1
    return images

"""What this package raises. A pixel's data never raises; only shapes and arguments do.

MomentsError
├── ShapeError (also a ValueError)
├── ParameterError (also a ValueError)
├── DeviceUnavailable (also a RuntimeError)
├── PluginFailed (also a RuntimeError)
└── UnlabelledImages (also a ValueError)
"""

from dataclasses import dataclass, fields
from typing import ClassVar


class MomentsError(Exception):
    """Everything that this package raises on purpose; its fields say what is wrong.

    Catch it around any call::

        try:
            returns = tm.pisarenko(b)
        except tm.MomentsError as error:
            print(error)
    """

    _sentence: ClassVar[str] = ""
    """What ``str`` gives: a format string of the fields."""

    def __post_init__(self) -> None:
        """Give the fields to the exception itself, which is pickled with them."""
        self.args = tuple(getattr(self, each.name) for each in fields(self))  # type: ignore[arg-type]  # of dataclasses

    def __str__(self) -> str:
        """Say what is wrong."""
        return self._sentence.format_map(vars(self)) if self._sentence else super().__str__()


@dataclass(eq=False)
class ShapeError(MomentsError, ValueError):
    """An array has a shape or an element type that the function cannot take.

    ``name`` says which array, ``found`` what it is and ``expected`` what it has to be.
    """

    name: str
    found: object
    expected: str
    _sentence = "{name} is {found}, expected {expected}"


@dataclass(eq=False)
class ParameterError(MomentsError, ValueError):
    """An argument ``field`` has a ``value`` outside of the ``limit`` of what a function is for."""

    field: str
    value: object
    limit: str
    _sentence = "{field} = {value!r} is outside of its limit: {limit}"


@dataclass(eq=False)
class PluginFailed(MomentsError, RuntimeError):  # noqa: N818 - says what has happened
    """What another package offers cannot be used, for a ``reason``: ``kind`` "estimator", say."""

    kind: str
    name: str
    reason: str
    _sentence = "the {kind} {name} of another package failed: {reason}"


@dataclass(eq=False)
class DeviceUnavailable(MomentsError, RuntimeError):  # noqa: N818 - says what has happened
    """The ``device`` that was asked for cannot compute here, for a ``reason``."""

    device: str
    reason: str
    _sentence = "device = {device!r} cannot be used: {reason}"


@dataclass(eq=False)
class UnlabelledImages(MomentsError, ValueError):  # noqa: N818 - says what is wrong
    """Raw images, or moments, come without what their evaluation needs; nothing is assumed for it.

    ``missing`` names it: labels of the images, settings or gains.
    """

    missing: tuple[str, ...]

    def __str__(self) -> str:
        """Name what is missing, and show a call that has everything."""
        return (
            f"the data do not say what they show; missing: {', '.join(self.missing)}. "
            "With the labels of a recording: transientcam_moments.reconstruct(images, "
            "harmonic=..., phase_rad=..., frequency_hz=..., illumination=..., take=..., "
            "calibration=gain), each a dataset of the file; without: reconstruct(images, "
            "Settings(base_frequency_hz=..., zeroth=..., takes=...), "
            "calibration=nominal_calibration(m, sub_phases_rad, weights, zeroth=...)); "
            "transientcam.open(file) evaluates a recording by itself"
        )

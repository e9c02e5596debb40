"""From the mean electrons of an image to its codes, effect by effect or in one compiled pass."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import drawn_bins, drawn_tails, quantiles
from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.effects import (
    FEW_E,
    Exposure,
    ImageEffect,
    NormalDraw,
    Quantisation,
    ReadNoise,
    ShotNoise,
    Stage,
    draw_few,
)

Codes = NDArray[np.uint16]
_NONE = np.float32(0)


class ReadOut:
    """The stages of an image behind its mean electrons.

    ``effects``: in the order in which they happen.
    """

    def __init__(self, effects: list[ImageEffect]) -> None:
        self._stages = _stages(effects)
        self._before, self._last = _split(self._stages)

    def codes(self, exposure: Exposure) -> Codes:
        """Return the codes (H, W) of an image; its signal is lost."""
        kernel = IMAGE_KERNELS.find("coded")
        if kernel is None and self._last is not None:
            IMAGE_KERNELS.want_for_images(exposure.signal.size)
        if kernel is None or self._last is None:
            for stage in self._stages:
                stage.apply(exposure)
            return exposure.signal.astype(np.uint16)
        for stage in self._before:
            stage.apply(exposure)
        return self._last.codes(kernel, exposure)


class _OnePass:
    """Noise and quantisation at once: the same draws in the same order, and the same codes."""

    def __init__(self, noise: list[Stage], quantisation: Quantisation) -> None:
        self._of_light = any(isinstance(each, ShotNoise) for each in noise)
        read = (each.variance_e2 for each in noise if isinstance(each, ReadNoise))
        self._variance_e2 = sum(read, start=_NONE)
        self._quantisation = quantisation

    def codes(self, kernel: Any, exposure: Exposure) -> Codes:
        """Return the codes (H, W) of an image."""
        flat = exposure.signal.reshape(-1)
        few = np.flatnonzero(flat < FEW_E) if self._of_light else np.zeros(0, np.intp)
        if few.size:
            draw_few(exposure, few)
        bins, last = drawn_bins(exposure.random, flat.size), self._quantisation
        noise = quantiles(), np.float32(self._of_light), self._variance_e2
        codes: Codes
        codes, outermost = kernel(flat, bins, *noise, last.dn_per_e, last.dark_dn, last.highest_dn)
        self._correct(exposure, few, (bins, outermost), codes)
        return codes.reshape(exposure.signal.shape)

    def _correct(
        self,
        exposure: Exposure,
        few: NDArray[np.intp],
        of: tuple[NDArray[np.uint16], NDArray[np.intp]],
        codes: Codes,
    ) -> None:
        """Put the codes of pixels with few electrons, and of those with noise from the tails."""
        bins, outermost = of
        light = np.full(outermost.size, self._of_light, np.float32)
        if few.size:
            place = np.minimum(np.searchsorted(few, outermost), few.size - 1)
            light[few[place] == outermost] = 0
        rare = np.concatenate([few, outermost])  # of places that are in both, the latter count
        noise = quantiles()[bins[rare]]
        noise[few.size :] = drawn_tails(exposure.random, noise[few.size :])
        signal = exposure.signal.reshape(-1)[rare]
        variance_e2 = signal * np.concatenate([np.zeros(few.size, np.float32), light])
        part = Exposure(signal + noise * np.sqrt(variance_e2 + self._variance_e2), exposure.random)
        self._quantisation.apply(part)
        codes[rare] = part.signal


def _stages(effects: list[ImageEffect]) -> tuple[Stage, ...]:
    """Insert one draw of noise behind the stages that add to its variance."""
    stages: list[Stage] = []
    for effect in effects:
        if stages and stages[-1].adds_variance and not effect.adds_variance:
            stages.append(NormalDraw())
        stages.append(effect)
    return tuple(stages)


def _split(stages: tuple[Stage, ...]) -> tuple[tuple[Stage, ...], _OnePass | None]:
    """Return the stages before noise, and what draws it and rounds at once, if it can."""
    noisy = [k for k, stage in enumerate(stages) if stage.adds_variance]
    last = stages[-1] if stages else None
    even = all(isinstance(stages[k], ShotNoise | ReadNoise) for k in noisy)
    if not even or not noisy or noisy[-1] != len(stages) - 3 or not isinstance(last, Quantisation):
        return stages, None
    return stages[: noisy[0]], _OnePass(list(stages[noisy[0] : -2]), last)

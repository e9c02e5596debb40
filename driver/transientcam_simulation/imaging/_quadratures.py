"""Images of one frequency as functions of their phase: what is the same for all of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.effects import LightPlanes, Shot
from transientcam_simulation.light import Region, View, holds

Plane = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Quadratures:
    """Electrons at phase theta: ``offset + sum_k re_k cos(k theta) + im_k sin(k theta)``."""

    constant: Plane | np.float32
    offset: Plane
    terms: tuple[tuple[int, Plane, Plane], ...]
    dark: np.float32

    @classmethod
    def of(cls, planes: LightPlanes) -> "Quadratures":
        """Take planes apart; a copy of it has contiguous ones."""
        terms = tuple((k, term.real, term.imag) for k, term in planes.terms.items())
        dark = not np.ndim(planes.constant) and not planes.constant
        offset = planes.mean if dark else planes.mean + planes.constant
        return cls(planes.constant, offset, terms, planes.dark)

    def of_shot(self, phasors: dict[int, complex], shot: Shot) -> Plane:
        """Electrons of an image with its own shares of the camera's and of other light."""
        lit = shot.label.illumination
        electrons, power = self.at(phasors, illumination=lit), shot.power if lit else 1.0
        if (power, shot.others) != (1.0, 1.0):
            electrons *= np.float32(power)
            electrons += np.float32(shot.others - power) * (self.constant - self.dark)
            electrons += np.float32(1 - power) * self.dark
        return electrons

    def at(self, phasors: dict[int, complex], *, illumination: bool) -> Plane:
        """Electrons of an image, given exp(i k theta) of each harmonic."""
        if not illumination:
            return np.zeros_like(self.offset) + self.constant
        kernel = IMAGE_KERNELS.find("at_phase")
        if kernel is not None and len(self.terms) == 1:
            ((k, *planes),) = self.terms
            turned: Plane = kernel(
                self.offset, *planes, np.float32(phasors[k].real), np.float32(phasors[k].imag)
            )
            return turned
        electrons = self.offset.copy()
        for k, in_phase, quadrature in self.terms:
            electrons += in_phase * np.float32(phasors[k].real)
            electrons += quadrature * np.float32(phasors[k].imag)
        # |b_j| <= b_0, except for rounding
        np.maximum(electrons, np.float32(0), out=electrons)
        return electrons

    def planes(self) -> list[Plane]:
        """Return all planes of pixels, in a fixed order."""
        own = [self.constant] if isinstance(self.constant, np.ndarray) else []
        return [*own, self.offset, *(plane for term in self.terms for plane in term[1:])]

    def copy(self) -> "Quadratures":
        """Return one with planes of its own."""
        return Quadratures(
            np.copy(self.constant) if isinstance(self.constant, np.ndarray) else self.constant,
            self.offset.copy(),
            tuple((k, one.copy(), other.copy()) for k, one, other in self.terms),
            self.dark,
        )


class Canvas:
    """Quadratures of one frequency of a moving scene: only regions that change are computed.

    ``background``: the view without what moves.
    ``quadratures_of``: computes those of a region of a view; of all of it where the region is None.
    """

    def __init__(
        self, background: View, quadratures_of: Callable[[View, Region | None], Quadratures]
    ) -> None:
        self.background = background
        self._of = quadratures_of
        self._still = quadratures_of(background, None).copy()
        self._now = self._still.copy()
        self._shown: tuple[View, Region] | None = None

    def showing(self, view: View) -> Quadratures:
        """Return the quadratures of a view, whose planes hold until the next call."""
        assert view.region is not None  # noqa: S101  (of views over a background)
        if self._shown is not None:
            if self._shown[0] is view:
                return self._now
            if not holds(view.region, self._shown[1]):  # or all of it is drawn over
                self._copy(self._still, self._shown[1])
        self._shown = view, view.region
        if view.region[0].stop > view.region[0].start:
            self._paste(self._of(view, view.region), view.region)
        return self._now

    def _copy(self, source: Quadratures, region: Region) -> None:
        for plane, still in zip(self._now.planes(), source.planes(), strict=True):
            plane[region] = still[region]

    def _paste(self, part: Quadratures, region: Region) -> None:
        for plane, new in zip(self._now.planes(), part.planes(), strict=True):
            plane[region] = new

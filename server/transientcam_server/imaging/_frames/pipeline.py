"""Makes frames of captures: each with the settings, gains and lens of its moment."""

import threading
from collections.abc import Callable
from typing import Protocol

import transientcam_moments as tm
from transientcam_driver import (
    AppliedSequence,
    CalibrationMismatch,
    Capabilities,
    FactoryCalibration,
    RawFrame,
    Simulation,
    Truth,
)
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging._frames.frame import Frame
from transientcam_server.imaging._frames.still import StillFrames
from transientcam_server.imaging._frames.workers import Workers
from transientcam_server.imaging._products.products import Product, product_names, product_of
from transientcam_server.imaging._products.requirements import absent_products
from transientcam_server.imaging._recipe.calibration import Calibration, Gains, factory_gains
from transientcam_server.imaging._recipe.lens import Intrinsics
from transientcam_server.imaging._recipe.recipe import Recipe, SettingsVersion
from transientcam_server.settings import ReconstructionSettings


class Source(Protocol):
    """What a pipeline takes of a camera."""

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        ...

    @property
    def factory(self) -> FactoryCalibration | None:
        """What it reports of its pixels and its lens."""
        ...

    @property
    def simulation(self) -> Simulation | None:
        """The simulation behind it, which has the ground truth; None for a real camera."""
        ...


class Pipeline:
    """Makes frames of the captures of one camera; on the event loop.

    From ``sensor``, or from the images where none is stated, the deviation of each frame's range is
    predicted.
    ``intrinsics`` returns where the pixels of the next frame look. ``images_known`` says whether
    captures have images, and not their moments alone (`MomentFrame`).

    Attributes
    ----------
    workers
        What computes for its frames.
    products, absent
        Products that this camera's frames have, and of the others why they do not.
    reconstruction
        How frames are computed from the next one on.
    calibration
        Used for those whose sequence it fits, from the next one on.
    """

    def __init__(
        self,
        camera: Source,
        settings: ReconstructionSettings,
        workers: Workers,
        *,
        sensor: tm.noise.Sensor | None = None,
        calibration: Calibration | None = None,
        intrinsics: Callable[[], Intrinsics] | None = None,
        images_known: bool = True,
    ) -> None:
        self.workers = workers
        self.calibration = calibration
        self.reconstruction = SettingsVersion(1, settings)
        self._sensor = sensor
        self._intrinsics = intrinsics
        self._capabilities = camera.capabilities
        self._full_scale = 2.0**camera.capabilities.bits - 1.0
        self._factory = factory_gains(camera.factory)
        self._simulation = camera.simulation
        self._truth = _truth_of(camera.simulation)
        self._frames = 0
        self._still = StillFrames(workers)
        self._last: RawFrame | None = None
        self._recipe: Recipe | None = None
        self.absent = absent_products(
            camera.capabilities,
            truth_known=self._truth is not None,
            noise_known=sensor is not None or images_known,
            images_known=images_known,
        )
        self.products: dict[str, Product] = {
            name: product_of(name) for name in product_names() if name not in self.absent
        }

    def frame(self, raw: RawFrame, applied: AppliedSequence) -> Frame:
        """Return the next frame, counted from 1."""
        self._frames += 1
        recipe = self.recipe_of(applied)
        if self._recipe is None or recipe != self._recipe:
            self._recipe = recipe  # else the same one: it holds what was prepared for it
            self.prepare_kernels(applied)
        previous, self._last = self._last, raw
        frame = self.recorded_frame(self._frames, raw, self._recipe, previous=previous)
        frame.averaged = self._still.following(raw, self._recipe, frame.previous)
        return frame

    def recipe_of(self, applied: AppliedSequence) -> Recipe:
        """Return what the next frame of a sequence is computed with."""
        return Recipe(
            applied,
            self.reconstruction.settings,
            self._full_scale,
            self.gains_for(applied),
            self.reconstruction.id,
            None if self._intrinsics is None else self._intrinsics(),
            self._sensor,
        )

    def prepare_kernels(self, applied: AppliedSequence) -> threading.Thread | None:
        """Have the kernels compiled, before all others, that frames of a sequence need.

        Returns the thread that compiles, if one does.
        """
        kernels = self.recipe_of(applied).kernels
        return tm.kernels.prepare(kernels, applied.sequence.order)

    def recorded_frame(
        self,
        number: int,
        raw: RawFrame,
        recipe: Recipe,
        *,
        previous: RawFrame | None = None,
        past: bool = False,
    ) -> Frame:
        """Return a frame with a number and a recipe of its own, as of a recording.

        ``previous`` is the capture before, which is kept with it where the recipe needs it.
        """
        before = previous if recipe.fills else None
        return Frame(
            self.workers, number, raw, recipe, previous=before, truth=self._truth, past=past
        )

    def gains_for(self, applied: AppliedSequence) -> Gains | None:
        """Return the gains of the calibration, or those of the camera where none fits.

        None are the nominal ones.
        """
        if self.calibration is None or self.misfit(applied) is not None:
            return self._factory
        return self.calibration.gains

    def misfit(self, applied: AppliedSequence) -> CalibrationMismatch | None:
        """Return why the calibration does not fit a sequence; None if it does, or is none."""
        if self.calibration is None:
            return None
        return self.calibration.capture.misfit(applied, self._capabilities)

    def beside(self, camera: Source, *, sensor: tm.noise.Sensor | None) -> "Pipeline":
        """Return one for frames of another camera, as of a recording, on the same workers."""
        return Pipeline(camera, self.reconstruction.settings, self.workers, sensor=sensor)

    def product(self, name: str) -> Product:
        """Return a product this camera has.

        Raises Problem ``unknown-product``, with the list of known ones.
        """
        try:
            return self.products[name]
        except KeyError:
            known = sorted(self.products)
            why = f": {self.absent[name]}" if name in self.absent else ""
            raise Problem(
                kinds.UNKNOWN_PRODUCT,
                f"There is no product {name[:64]!r}{why}; there are {', '.join(known)}.",
                field="product",
                value=name[:64],
                known=known,
            ) from None


def _truth_of(simulation: Simulation | None) -> Callable[[float], Truth] | None:
    if simulation is None:
        return None
    return lambda device_time_s: simulation.truth(device_time_s=device_time_s)

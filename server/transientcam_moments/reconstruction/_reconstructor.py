"""From raw images or moments to a reconstruction: in one compiled pass, or stage by stage."""

import math
import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from transientcam_compiled import Spread, at_once
from transientcam_moments import _gpu
from transientcam_moments._dispatch import LEAST_PIXELS, lookup, on_threads
from transientcam_moments._kernels.one_pass import Constants, OnePass, Planes
from transientcam_moments._kernels.padding import LEAST_WIDTH
from transientcam_moments.arrays import Array, as_array
from transientcam_moments.errors import ParameterError, UnlabelledImages
from transientcam_moments.images import (
    ZEROTH_IMAGES,
    HarmonicCorrection,
    Recovered,
    Repair,
    Replacement,
    average_takes,
    calibrate,
    checked_mask,
    checked_waveform,
    demodulate,
    fill_bad_pixels,
    gaussian_taps,
    harmonics_of,
    inverse_gains,
    is_four_bucket,
    matters,
    measure,
    recover_saturated,
    repair,
    saturated,
    takes_first,
)
from transientcam_moments.noise import CapturedImages
from transientcam_moments.reconstruction._labels import Labels
from transientcam_moments.reconstruction._lazy import Reconstruction
from transientcam_moments.reconstruction._neighbours import applicable, known_noise, over_neighbours
from transientcam_moments.reconstruction._one_pass import PassedReconstruction
from transientcam_moments.reconstruction._ranging import range_m
from transientcam_moments.reconstruction._settings import OF_ANY_MULTIPLES, Settings
from transientcam_moments.reconstruction._sparse_frequencies import GappedReconstruction
from transientcam_moments.reconstruction._still import Measured, over_frames
from transientcam_moments.reconstruction._turns import low_phase_rad

_BY_THE_PASS = ("pisarenko", "pisarenko-merged", *OF_ANY_MULTIPLES)
"""Estimators that follow from the pass's returns or moments."""
_SHAPES = 4  # of images that a reconstructor keeps prepared
Pass = OnePass | _gpu.DevicePass


class Reconstructor:
    """Reconstructs the frames of a camera.

    What does not change from frame to frame is prepared once; several threads may call it at the
    same time, and no result changes with a later call.

    Parameters
    ----------
    settings : Settings, optional
        The defaults, when left out. Raw images need ``zeroth`` and ``takes`` in them, and a range
        ``base_frequency_hz``: these have no default.
    calibration : array, shape (m + 1,) or (m + 1, ...), optional
        Gains to divide by, as `calibrate` takes them. Raw images need them; moments without are
        taken to be calibrated.
    bad_pixels : boolean array, shape (H, W), optional
        Pixels that show the mean of their neighbours instead, and are flagged.
    waveform : array, shape (m, K), optional
        Odd harmonics of the modulation, from `waveform_of`, that are taken out of the moments; none
        are known, when left out. Needs the calibration.
    device : str, optional
        What computes a frame; as `kernels.use_device` said, when left out. "cpu": compiled kernels.
        "gpu": the first GPU that there is, or "gpu:NAME" the adapter with this in
        its name, which may be one of software, as `kernels.devices` lists them; frames that it does
        not take or give are computed as by "cpu". "auto": the first GPU, once it has computed
        known frames rightly, or "cpu": whichever was faster on the first frames of a kind.

    Raises
    ------
    ParameterError
        For another device; for a waveform without a calibration, or of other multiples.
    DeviceUnavailable
        For "gpu", where there is none, or it computes known frames wrongly; with the calibration
        this is known at once, else from the first frame.
    """

    def __init__(
        self,
        settings: Settings | None = None,
        *,
        calibration: Array | None = None,
        bad_pixels: Array | None = None,
        waveform: Array | None = None,
        device: str | None = None,
    ) -> None:
        device = _gpu.CHOICE[0] if device is None else device
        self._choice = _gpu.Choice(_gpu.device_of(device), automatic=device == "auto")
        if calibration is not None and not self._choice.automatic:
            self._choice.device_for(len(calibration) - 1)
        self.settings = Settings() if settings is None else settings
        self._calibration = calibration
        self._bad = bad_pixels
        if waveform is not None:
            waveform = checked_waveform(waveform)
            if calibration is None:
                raise ParameterError("calibration", None, "given, for the phases of the waveform")
            if not self.settings.consecutive:
                limit = "1 to m, for a waveform to be taken out"
                raise ParameterError("multiples", self.settings.multiples, limit)
        self._low_phase_rad = (
            None if calibration is None else low_phase_rad(self.settings, calibration)
        )
        self._waveform = waveform if waveform is not None and matters(waveform) else None
        self._lock = threading.Lock()
        self._prepared: dict[tuple[Any, ...], Pass | None] = {}
        self._corrections: dict[tuple[Any, ...], HarmonicCorrection] = {}

    def __call__(
        self,
        data: Array | Sequence[Array] | Measured,
        *,
        saturated_pixels: Array | None = None,
        previous: Array | None = None,
        spread: Spread = at_once,
    ) -> Reconstruction:
        """Reconstruct one frame.

        Parameters
        ----------
        data : array or Measured
            Real images (N, ...) in capture order, as `measure` takes them, complex moments
            (m + 1, ...), or what the methods `measure` and `average` return, to which nothing more
            is given. They must stay as they are if ``measured`` is to be read later.
        saturated_pixels : boolean array, shape (...), optional
            Pixels to be flagged; found in images by themselves.
        previous : array, optional
            Images of the frame before, like `data`, for ``spoilt_images="fill"``.
        spread : callable
            How the compiled pass, and the likelihood, use several threads, as `kernels.over`
            returns it.

        Returns
        -------
        Reconstruction
            Where the compiled pass serves, with range, returns, light, flags and validity
            computed; else with moments measured and nothing else computed yet.

        Raises
        ------
        ShapeError
            When the data have no shape that belongs to images or moments, or calibration or bad
            pixels have another one.
        UnlabelledImages
            When the data are raw images, and settings or gains leave open what they show.
        """
        if isinstance(data, Measured):
            return self._of_frame(data, spread)
        if _is_moments(data):
            return self._of_frame(self.measure(data, saturated_pixels=saturated_pixels), spread)
        takes, repaired, recovered, images = self._prepare(data, previous)
        # behind the smoothing, where a waveform is known: harmonics are taken out there; and of
        # recovered pixels the noise is known pixel by pixel
        keeps_edges = self.settings.neighbours == "edge-preserving"
        behind = self._waveform is not None or keeps_edges or recovered is not None
        passes = () if behind else self._passes_of_images(takes)
        given = takes[0], saturated_pixels, spread
        planes = self._passed(takes.shape, passes, lambda each: each.images(*given))
        if planes is not None:
            return PassedReconstruction(
                planes,
                self.settings,
                lambda: self._measured(takes)[0],
                repaired=repaired,
                calibration=self._calibration,
                spread=spread,
                device=self._choice.kernel,
                images=images,
                low=self._low(takes[0]),
            )
        frame = self._frame(takes, repaired, recovered, images, saturated_pixels)
        return self._of_frame(frame, spread)

    def measure(
        self,
        data: Array | Sequence[Array],
        *,
        saturated_pixels: Array | None = None,
        previous: Array | None = None,
    ) -> Measured:
        """Return the moments of one frame, for `average`; all is as of a call."""
        if not _is_moments(data):
            return self._frame(*self._prepare(data, previous), saturated_pixels)
        data = as_array(data)
        moments = data if self._bad is None else fill_bad_pixels(data, self._bad)
        return Measured(self._calibrated(moments), saturated_pixels)

    def average(self, frame: Measured, before: Measured | None = None) -> Measured:
        """Average a frame of a stream with those before, pixel by pixel, where nothing changed.

        ::

            before = None
            for images in stream:
                before = reconstructor.average(reconstructor.measure(images), before)
                range_m = reconstructor(before).range_m

        Parameters
        ----------
        frame : Measured
            Of the same settings and shape as all before it.
        before : Measured, optional
            What this returned of the frame before; all begins anew without.

        Returns
        -------
        Measured
            With `Still` by `average_frames`, of at most ``still_frames`` of the settings; without
            where the noise is neither stated nor told by the images.
        """
        return over_frames(frame, before, self.settings, self._calibration)

    def _prepare(
        self, data: Array | Sequence[Array], previous: Array | None
    ) -> tuple[Array, Repair | None, Recovered | None, CapturedImages | None]:
        """Return images take by take, repaired, and what was done to them."""
        data = data if isinstance(data, Sequence) else as_array(data)
        zeroth, count = self._require_labels()
        takes = takes_first(data, count, len(self.settings.sampled_rad))
        repaired = self._repaired(takes, previous)
        if repaired is not None:
            takes = repaired.images
        recovered = self._recovered(takes, zeroth)
        if recovered is not None:
            takes = recovered.images
        return takes, repaired, recovered, self._images(takes, zeroth, repaired, recovered)

    def _frame(
        self,
        takes: Array,
        repaired: Repair | None,
        recovered: Recovered | None,
        images: CapturedImages | None,
        saturated_pixels: Array | None,
    ) -> Measured:
        left_out = None if repaired is None else repaired.left_out
        moments, kept, low = self._measured(takes, left_out)
        if recovered is not None:
            used = True if self._bad is None else ~self._bad  # values of bad pixels are not
            moments[:, recovered.undetermined & used] = np.nan
            if saturated_pixels is None:
                saturated_pixels = recovered.saturated & used
        elif saturated_pixels is None:
            stack = takes.reshape((-1, *moments.shape[1:]))
            saturated_pixels = saturated(stack, full_scale=self.settings.full_scale)
            if self._bad is not None:  # their own values are not used
                saturated_pixels = saturated_pixels & ~self._bad
        corrupt = repaired is not None and any(bool(np.any(each)) for each in repaired[1:])
        return Measured(moments, saturated_pixels, kept, repaired, images, low=low, corrupt=corrupt)

    def of_measured(
        self,
        moments: Array,
        *,
        saturated_pixels: Array | None = None,
        ambient_dn: float = 0.0,
        spread: Spread = at_once,
    ) -> Reconstruction:
        """Go on from `Reconstruction.measured` (m + 1, ...) of another one, as `Measured` says."""
        return self(Measured(moments, saturated_pixels, ambient_dn=ambient_dn), spread=spread)

    def _require_labels(self) -> tuple[str, int]:
        """Return how b_0 was measured and the number of takes, where raw images can be read."""
        settings, calibration = self.settings, self._calibration
        stated = {"zeroth": settings.zeroth, "takes": settings.takes, "calibration": calibration}
        if settings.zeroth is None or settings.takes is None or calibration is None:
            raise UnlabelledImages(tuple(name for name, each in stated.items() if each is None))
        return settings.zeroth, settings.takes

    def _of_frame(self, frame: Measured, spread: Spread) -> Reconstruction:
        """Go on from calibrated moments."""
        moments, frames = frame.moments, None
        if frame.still is not None:
            moments, frames = frame.still.moments, frame.still.frames
        gains, correction = self._calibration, None
        settings, known = self.settings, frame.image_noise
        if known is None and moments.ndim == 3 and settings.neighbours == "edge-preserving":
            known = known_noise(moments, settings, frame.images)
        settings = applicable(settings, known)
        given: dict[str, Any] = {
            "kept": frame.kept,
            "repaired": frame.repaired,
            "calibration": gains,
            "spread": spread,
            "device": self._choice.kernel,
            "images": frame.images,
            "low": frame.low,
            "frames": frames,
            "known_noise": known,
        }
        if settings.consecutive:
            correction = self._correction(moments, settings.gaussian_px)
        planes = share = corrected = None
        if settings.consecutive and (passes := self._passes_of_moments(moments)):
            left_out = frame.saturated, self._bad
            how = frame.images, spread, frames
            smoothed, share = over_neighbours(moments, settings, known, gains, left_out, *how)
            if correction is not None:
                smoothed, corrected = correction(smoothed, spread=spread)
            own = smoothed, frame.saturated, spread
            planes = self._passed(moments.shape, passes, lambda each: each.moments(*own))
        if planes is not None:
            behind = {"corrected": corrected, "share": share}
            found: Reconstruction = PassedReconstruction(
                planes, settings, lambda: frame.moments, **behind, **given
            )
        else:
            kind = Reconstruction if settings.consecutive else GappedReconstruction
            given |= {"bad_pixels": self._bad, "correction": correction}
            found = kind(moments, settings, frame.saturated, **given)
            found.measured = frame.moments
        if frame.ambient_dn > 0:
            found.ambient = np.full(moments.shape[1:], frame.ambient_dn, moments.real.dtype)
        return found

    def _correction(self, moments: Array, sigma_px: float) -> HarmonicCorrection | None:
        """Return what takes the harmonics of the waveform out of these moments, if any is known."""
        if self._waveform is None:
            return None
        shape = tuple(moments.shape[1:])
        key = shape, sigma_px
        with self._lock:
            if key not in self._corrections:
                self._corrections[key] = HarmonicCorrection(
                    self._waveform,
                    self._calibration,
                    shape,
                    smoothing_sigma_px=sigma_px,
                    estimated=self.settings.zeroth == "estimated",
                )
                while len(self._corrections) > _SHAPES:
                    self._corrections.pop(next(iter(self._corrections)))
            return self._corrections[key]

    def _repaired(self, takes: Array, previous: Array | None) -> Repair | None:
        """Return the images after repair; None for other arrays than NumPy's, or by the settings.

        What to do depends on the values, which are not known yet where JAX traces a function.
        Without opposite phases there are no sums to find corrupt images by.
        """
        if self.settings.spoilt_images == "keep" or not isinstance(takes, np.ndarray):
            return None
        if not is_four_bucket(self.settings.sampled_rad):
            return None
        zeroth, count = self._require_labels()
        before = None
        if previous is not None and self.settings.spoilt_images == "fill":
            before = np.asarray(takes_first(previous, count))
        return repair(
            takes,
            zeroth=zeroth,
            calibration=self._calibration,
            full_scale=self.settings.full_scale,
            previous=before,
        )

    def _recovered(self, takes: Array, zeroth: str) -> Recovered | None:
        """Return the images with what saturated ones would hold; None where there are none.

        Nor of other arrays than NumPy's: what to do depends on the values.
        """
        if not isinstance(takes, np.ndarray):
            return None
        first = ZEROTH_IMAGES[zeroth] if zeroth == "on-off" else 0
        return recover_saturated(takes, first, self.settings.sampled_rad, self.settings.full_scale)

    def _images(
        self, takes: Array, zeroth: str, repaired: Repair | None, recovered: Recovered | None
    ) -> CapturedImages | None:
        """Return what tells the noise of images, and light that is not the camera's.

        Both depend on values, which are not known yet where JAX traces a function.
        """
        if not isinstance(takes, np.ndarray):
            return None
        return CapturedImages(
            takes,
            self.settings.sampled_rad,
            ZEROTH_IMAGES[zeroth] if zeroth == "on-off" else 0,
            None if recovered is None else recovered.saturated,
            self._bad,
            None if repaired is None else np.logical_or.reduce(repaired[1:]),
            self.settings.gaussian_px,
            None if recovered is None else recovered.variance,
        )

    def _measured(
        self, takes: Array, left_out: Array | None = None
    ) -> tuple[Array, Array, Array | None]:
        """Return calibrated moments of raw images, which images went into them, and `_low`."""
        average, kept = average_takes(takes, left_out=left_out)
        if self._bad is not None:
            average = fill_bad_pixels(average, self._bad)
        zeroth, _ = self._require_labels()
        moments = measure(average, zeroth=zeroth, phases_rad=self.settings.sampled_rad)
        return self._calibrated(moments), kept, self._low(average)

    def _low(self, images: Array) -> Array | None:
        """Return light at the low frequency of one take's images (N, ...), if it tells turns."""
        if self._low_phase_rad is None:
            return None
        phases_rad = self.settings.sampled_rad
        phasor = demodulate(images[None, : len(phases_rad)], phases_rad)
        if self._bad is not None:
            phasor = fill_bad_pixels(phasor, self._bad)
        return phasor[0] * np.exp(-1j * self._low_phase_rad)

    def _calibrated(self, moments: Array) -> Array:
        return moments if self._calibration is None else calibrate(moments, self._calibration)

    # -- which way -----------------------------------------------------------------------------
    # The compiled pass serves NumPy arrays in single precision, of 64 pixels or more and an order
    # whose kernel "reconstruct" is compiled, where moments keep their harmonics and the range is
    # Pisarenko's, or of OF_ANY_MULTIPLES, which follow from the pass's moments. It begins with
    # the raw images of one take of uint16 at four phases, as wide as its smoothing needs, or else
    # (several takes, other images, moments) behind the smoothing. All else goes stage by stage,
    # each computed when it is first read.

    def _passes_of_images(self, takes: Array) -> list[Pass]:
        """Return what may do raw images; a device first, if there is one."""
        zeroth, _ = self._require_labels()
        if not is_four_bucket(self.settings.sampled_rad):
            return []
        m = harmonics_of(takes.shape[1], zeroth)
        shape = tuple(takes.shape[2:])
        raw = isinstance(takes, np.ndarray) and takes.dtype == np.uint16 and takes.shape[0] == 1
        wide = self._taps(shape) is None or shape[1] >= LEAST_WIDTH
        return self._passes(m, shape, images=True) if raw and wide else []

    def _passes_of_moments(self, moments: Array) -> list[Pass]:
        if not isinstance(moments, np.ndarray) or moments.dtype != np.complex64 or not moments.ndim:
            return []
        return self._passes(moments.shape[0] - 1, moments.shape[1:], images=False)

    def _passes(self, m: int, shape: tuple[int, ...], *, images: bool) -> list[Pass]:
        usual = self.settings.keep == "harmonics" and self.settings.consecutive
        usual = usual and self.settings.technique in _BY_THE_PASS
        masked = self._bad is None or np.shape(self._bad) == shape
        if not usual or not masked or math.prod(shape) < LEAST_PIXELS:
            return []
        ways: list[tuple[Any, Callable[[], Pass | None]]] = []
        if (device := self._choice.device_for(m)) is not None:
            make = partial(device.prepare, m, shape, images=images)
            ways.append(((device, images), lambda: make(self._constants(m, shape))))
        if (prepare := lookup("reconstruct", m, math.prod(shape))) is not None:
            ways.append((prepare, lambda: prepare(shape, self._constants(m, shape))))
        with self._lock:
            found = [self._kept((how, m, shape), make) for how, make in ways]
        return [each for each in found if each is not None]

    def _kept(self, key: tuple[Any, ...], make: Callable[[], Pass | None]) -> Pass | None:
        if key not in self._prepared:
            made = make()
            while len(self._prepared) >= _SHAPES:
                self._prepared.pop(next(iter(self._prepared)))
            self._prepared[key] = made
        return self._prepared[key]

    def _passed(
        self, kind: tuple[int, ...], passes: Sequence[Pass], run: Callable[[Pass], Planes | None]
    ) -> Planes | None:
        """Return what the first pass gives that gives anything; of "auto", the faster one's."""
        if self._choice.automatic and len(passes) == 2:
            device, kernel = passes
            raced: Planes = self._choice.race.run(kind, lambda: run(device), lambda: run(kernel))
            return raced
        return next((found for each in passes if (found := run(each)) is not None), None)

    # -- preparing -----------------------------------------------------------------------------

    def _taps(self, shape: tuple[int, ...]) -> Array | None:
        sigma_px = self.settings.gaussian_px
        return gaussian_taps(sigma_px) if sigma_px > 0 and len(shape) == 2 else None

    def _constants(self, m: int, shape: tuple[int, ...]) -> Constants:
        calibration = np.ones(m + 1) if self._calibration is None else self._calibration
        bad, replaced = self._replacement(shape)
        frequency_hz = self.settings.base_frequency_hz
        return Constants(
            self.settings,
            inverse_gains(calibration, (m + 1, *shape)),
            self._taps(shape),
            math.nan if frequency_hz is None else float(range_m(np.float64(1.0), frequency_hz)),
            bad,
            replaced,
        )

    def _replacement(
        self, shape: tuple[int, ...]
    ) -> tuple[Array | None, Callable[[Array], Array] | None]:
        """Return the flat places of bad pixels, and how to get moments for them from images."""
        if self._bad is None:
            return None, None
        mask = checked_mask(self._bad, shape)
        if not mask.any() or mask.all():
            return np.flatnonzero(mask), None
        replacement = Replacement(mask)
        zeroth, phases_rad = self.settings.zeroth, self.settings.sampled_rad
        if zeroth is None:  # moments, whose bad pixels are replaced already
            return replacement.places, None
        return replacement.places, lambda raw: measure(
            replacement.values(raw), zeroth=zeroth, phases_rad=phases_rad
        )


def _is_moments(data: Array | Sequence[Array]) -> bool:
    return not isinstance(data, Sequence) and np.dtype(as_array(data).dtype).kind == "c"


def reconstruct(
    data: Array | Sequence[Array],
    settings: Settings | None = None,
    *,
    harmonic: Array | None = None,
    phase_rad: Array | None = None,
    frequency_hz: Array | None = None,
    illumination: Array | None = None,
    take: Array | None = None,
    calibration: Array | None = None,
    saturated_pixels: Array | None = None,
    bad_pixels: Array | None = None,
    previous: Array | None = None,
    waveform: Array | None = None,
    threads: int | None = None,
) -> Reconstruction:
    """Reconstruct one frame of labelled raw images, or of moments.

    ::

        with h5py.File("corner.h5") as file:
            names = ("harmonic", "phase_rad", "frequency_hz", "illumination", "take")
            labels = {name: file[name][()] for name in names}
            found = tm.reconstruct(file["raw"][0], **labels, calibration=file["gain"][()])

    With labels as ``Reconstructor(settings, calibration=..., bad_pixels=...)`` of the images in the
    order that `measure` takes, and of settings with what the labels say; for many frames keep a
    `Reconstructor`.

    Parameters
    ----------
    data : array
        Real images (N, ...) in any order, or complex moments (m + 1, ...).
    settings : Settings, optional
        Of smoothing, biasing and estimator: the defaults, when left out.
    harmonic, phase_rad, frequency_hz, illumination, take : array, shape (N,), optional
        What each image shows, see `Labels`. Raw images need them, or else ``zeroth``, ``takes`` and
        ``base_frequency_hz`` in the settings and the order of `measure`.
    calibration : array, shape (m + 1,) or (m + 1, ...), optional
        Gains, as `calibrate` takes them; `nominal_calibration` where none were measured. Raw images
        need them.
    saturated_pixels : boolean array, shape (...), optional
        Pixels to be flagged; found in images by themselves.
    bad_pixels : boolean array, shape (H, W), optional
        Pixels that show the mean of their neighbours instead, and are flagged.
    previous : array, optional
        Images of the frame before, like `data`, for ``spoilt_images="fill"``.
    waveform : array, shape (m, K), optional
        Odd harmonics that are taken out of the moments, as `Reconstructor` takes them.
    threads : int, optional
        How many the compiled pass uses; all cores, when left out.

    Raises
    ------
    UnlabelledImages
        When raw images do not say what they show: nothing is assumed for it.
    ParameterError
        When the labels are of no capture there is, or contradict the settings; for a waveform
        without a calibration.
    ShapeError
        When shapes do not fit each other.
    """
    chosen = Settings() if settings is None else settings
    given = {"harmonic": harmonic, "phase_rad": phase_rad}
    if not isinstance(data, Sequence):
        data = as_array(data)
    raw = isinstance(data, Sequence) or np.dtype(data.dtype).kind != "c"
    if harmonic is not None and phase_rad is not None:
        labels = Labels(harmonic, phase_rad, frequency_hz, illumination, take)
        chosen = labels.settings(chosen)
        data = labels.in_order(data) if raw else data
        previous = None if previous is None else labels.in_order(previous)
    elif raw:
        _require_stated(chosen, given, calibration)
    if raw and (chosen.base_frequency_hz is None or calibration is None):
        needed = {"frequency_hz": chosen.base_frequency_hz, "calibration": calibration}
        raise UnlabelledImages(tuple(name for name, value in needed.items() if value is None))
    reconstructor = Reconstructor(
        chosen, calibration=calibration, bad_pixels=bad_pixels, waveform=waveform
    )
    spread = on_threads(threads)
    return reconstructor(data, saturated_pixels=saturated_pixels, previous=previous, spread=spread)


def _require_stated(
    settings: Settings, labels: dict[str, Array | None], calibration: Array | None
) -> None:
    """Refuse images without labels, unless the settings state all that labels would say."""
    physics = (settings.base_frequency_hz, settings.zeroth, settings.takes)
    if None not in physics:
        return
    missing = [name for name, value in labels.items() if value is None]
    if settings.base_frequency_hz is None:
        missing.append("frequency_hz")
    raise UnlabelledImages((*missing, *(["calibration"] if calibration is None else [])))

"""What other packages offer by entry points, and calls of it: estimators, and maps of their own.

Their code is imported when it is first asked for, and what it does wrong is a `PluginFailed`.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final, Generic, TypeVar, cast

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.errors import PluginFailed
from transientcam_moments.noise import MomentNoise

Offered = TypeVar("Offered")
_NAME: Final = re.compile(r"[a-z][a-z0-9_-]{0,62}")
GROUPS: dict[str, "Plugins[Any]"] = {}
"""By the names of their entry points."""


class Plugins(Generic[Offered]):
    """What packages offer in the group ``transientcam.KINDs``: each a ``type_`` with a name."""

    def __init__(self, kind: str, type_: type[Offered]) -> None:
        self.kind, self.group, self._type = kind, f"transientcam.{kind}s", type_
        self.taken: set[str] = set()
        """Names of ours, and of what stands beside ours."""
        self.points, self.loaded = cache(self._points), cache(self._loaded)
        GROUPS[self.group] = self

    def _points(self) -> dict[str, dict[str, EntryPoint]]:
        """Return the entries of all packages by names and values; several are one too many."""
        found: dict[str, dict[str, EntryPoint]] = {}
        for point in sorted(entry_points(group=self.group), key=lambda each: each.name):
            found.setdefault(point.name, {})[point.value] = point
        return found

    def names(self) -> tuple[str, ...]:
        """Return the names of what may be there, of which some may not be usable."""
        return tuple(name for name in self.points() if name not in self.taken)

    def statements(self) -> dict[str, Offered | PluginFailed]:
        """Return each by its name, or why it cannot be used."""
        return {name: self.loaded(name) for name in self.points()}

    def _loaded(self, name: str) -> Offered | PluginFailed:
        """Return what a package offers by that name, or why it cannot be used."""
        failed = partial(PluginFailed, self.kind, name)
        values = sorted(points := self.points().get(name, {}))
        if len(values) != 1:
            return failed(f"several packages offer it: {', '.join(values)}" if values else "gone")
        if name in self.taken or not _NAME.fullmatch(name):
            return failed("its name is taken, or is not of a to z, 0 to 9, - and _, at most 63")
        try:
            offered = points[values[0]].load()
        except (Exception, SystemExit) as error:
            return failed(f"{values[0]} cannot be imported: {in_words(error)}")
        if not isinstance(offered, self._type):
            found = f"{values[0]} is a {type(offered).__name__}"
            return failed(f"{found}, not a {self._type.__name__}")
        described = fields(cast("Any", self._type))
        stated = {each.name: getattr(offered, each.name) for each in described}
        if stated["name"] != name or stated.get("measures", "moments") != "moments":
            measures = f" and measures {stated['measures']!r}" if "measures" in stated else ""
            return failed(f"it calls itself {stated['name']!r}{measures}, not {name!r}")
        for each in described:
            if each.type in (str, "str") and not isinstance(stated[each.name], str):
                return failed(f"its {each.name} is no text: {stated[each.name]!r}")
        return offered

    def load(self, name: str) -> Offered:
        """Return it, or raise the PluginFailed."""
        found = self.loaded(name)
        if isinstance(found, PluginFailed):
            raise PluginFailed(*found.args)
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class MapProduct:
    """A map of one number a pixel, which another package computes from the moments of a frame.

    Attributes
    ----------
    least_harmonics, consecutive
        How many frequencies it needs, and whether these must be f .. m f.
    compute
        From moments (m + 1, ...) to values (...), NaN where there is none. It takes the keywords
        ``noise``, a `noise.MomentNoise` or None, and ``frequencies_hz`` (m + 1,) of the moments.
    """

    name: str
    unit: str  # "1" for none
    summary: str
    least_harmonics: int = 1
    consecutive: bool = False
    assumptions: str
    cost: str
    failure: str
    compute: Callable[..., Array]


PRODUCTS: Final = Plugins("product", MapProduct)


def mapped(name: str, b: Array, variance: Array | None, frequencies_hz: Array) -> Array:
    """Return the map (...) of another package, of moments (m + 1, ...); infinite values are NaN.

    Raises PluginFailed where it raises, or returns anything else.
    """
    product, failed = PRODUCTS.load(name), partial(PluginFailed, PRODUCTS.kind, name)
    if len(b) <= (least := product.least_harmonics):
        raise failed(f"it needs {least} frequencies, and there are {len(b) - 1}")
    noise = None if variance is None else MomentNoise(variance)
    try:
        with np.errstate(all="ignore"):  # of pixels without light
            found = product.compute(b.copy(), noise=noise, frequencies_hz=frequencies_hz)
        values = np.asarray(found).astype(b.real.dtype, casting="same_kind")
    except Exception as error:
        raise failed(in_words(error)) from error
    if values.shape != b.shape[1:]:
        raise failed(f"its map has shape {values.shape}, and the pixels have {b.shape[1:]}")
    return np.where(np.isfinite(values), values, np.nan)


def call_here(group: str, function: Callable[..., Any], name: str, *arguments: Any) -> Any:
    """Return ``function(name, *arguments)``, which calls the code of a package of that group."""
    return function(name, *arguments)


CALLERS: list[Callable[..., Any]] = [call_here]
"""The last one calls the code of other packages: in another process, say."""


def import_there(group: str, name: str) -> None:
    """Import what a package offers; raise the PluginFailed."""
    GROUPS[group].load(name)


def call_there(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function in another process, whose calls have one argument more."""
    return function(*arguments[:-1])


def in_words(error: BaseException) -> str:
    """Return what an exception of another package says."""
    return f"{type(error).__name__}: {error}"

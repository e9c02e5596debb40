"""All measurements: what each is called, where it is computed, and which page it is on.

A measurement is a function that returns tables; its keyword arguments are its options, and its
docstring says what it does. ``python -m benchmarks NAME`` runs it. Nothing is imported before that.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final


@dataclass(frozen=True)
class Measurement:
    """A function, and what becomes of its tables."""

    name: str
    """That it is called by."""
    function: str
    """As in ``speed.density:tables``, below this package."""
    page: str | None = None
    """In docs/, without its suffix. Without one the function writes what it makes by itself."""
    of: tuple[str, ...] = ()
    """Paths whose code is measured: where they have changed since, figures are called old."""
    level: int = 2
    """Of the headings on the page."""
    by_hand: bool = False
    """Whether it is left out when pages are made: it needs something that is not at hand."""
    given: Mapping[str, Any] = field(default_factory=dict)
    """Options that differ from the function's defaults."""
    timed: bool = True
    """Whether figures depend on the machine."""


_MOMENTS: Final = ("server/transientcam_moments",)
_SERVER: Final = ("server/transientcam_server",)
_COMPARISONS: Final = ("server/transientcam_moments/comparisons",)
_IMAGING: Final = ("server/transientcam_server/imaging",)
_PLANNED: Final = ("server/transientcam_server/planning", *_MOMENTS, *_IMAGING)
_TRADED: Final = ("server/transientcam_experiments/tradeoff", *_MOMENTS, *_IMAGING)
_DASHBOARD: Final = ("client/dashboard/src",)
_RECORDING: Final = ("server/transientcam_server/recording",)

_ALL: Final = (
    # -- speed
    *(
        Measurement(each, f"speed.{each}:tables", "measured/benchmarks", _MOMENTS)
        for each in (
            "density",
            "reconstruction",
            "stages",
            "pisarenko",
            "cumulative",
            "scaling",
            "warm_up",
            "automatic",
        )
    ),
    # -- service
    Measurement(
        "throughput", "service.throughput:tables", "measured/throughput", (*_MOMENTS, *_SERVER)
    ),
    Measurement("stream_load", "service.stream_load:tables", "measured/stream-load", _SERVER),
    Measurement("first_light", "service.first_light:tables", "measured/first-light", _SERVER),
    Measurement(
        "first_program",
        "service.first_program:tables",
        "measured/first-program",
        ("pyproject.toml", "client/transientcam", *_SERVER),
    ),
    Measurement("robustness", "service.robustness:tables", "measured/robustness", _SERVER),
    Measurement("soak", "service.soak:tables", "measured/soak", _SERVER),
    Measurement(
        "relay_moments",
        "service.relay_moments:tables",
        "relay",
        ("server/transientcam_server/relay",),
    ),
    Measurement(
        "relay_tree",
        "service.relay:tables",
        "relay",
        ("server/transientcam_server/relay",),
        level=3,
    ),
    Measurement(
        "cluster", "service.cluster:tables", "cluster", ("server/transientcam_server/offline",), 3
    ),
    Measurement(
        "default_sequence",
        "service.default_sequence:tables",
        "measured/default-sequence",
        (*_MOMENTS, *_IMAGING, "driver"),
        timed=False,
    ),
    Measurement(
        "autobahn",
        "service.autobahn:tables",
        "measured/autobahn",
        ("server/transientcam_server/daemon",),
        by_hand=True,
    ),
    # -- recordings
    Measurement("recording", "recordings.recording:tables", "measured/recording-cost", _RECORDING),
    Measurement("by_hand", "recordings.by_hand:tables", "recordings", (*_MOMENTS, *_IMAGING), 3),
    Measurement("power_cuts", "recordings.power_cuts:tables", "measured/power-cuts", _RECORDING),
    Measurement(
        "fuzz_recordings",
        "recordings.fuzz_recordings:tables",
        "measured/fuzzed-recordings",
        _RECORDING,
    ),
    # -- estimators
    Measurement(
        "techniques", "estimators.estimators:techniques", "estimators", _COMPARISONS, timed=False
    ),
    Measurement("estimators", "estimators.estimators:tables", "estimators", _MOMENTS),
    Measurement(
        "camera_returns", "estimators.cameras:tables", "cameras", _MOMENTS, level=3, timed=False
    ),
    Measurement("harmonics", "estimators.harmonics:tables", "harmonics", (*_MOMENTS, *_IMAGING)),
    Measurement(
        "lost_sync",
        "estimators.lost_sync:tables",
        "lost-synchronisation",
        (*_MOMENTS, "driver"),
    ),
    Measurement("stability", "estimators.stability:tables", "measured/stability", _MOMENTS),
    Measurement(
        "calibration_verdicts",
        "estimators.calibration_verdicts:tables",
        "measured/calibration-verdicts",
        (*_IMAGING, "driver"),
        timed=False,
    ),
    Measurement("corner_strip", "estimators.corner_strip:draw"),
    # -- likelihood
    Measurement("sparse", "likelihood.sparse:tables", "measured/likelihood", _MOMENTS),
    Measurement("captures", "likelihood.captures:tables", "measured/likelihood", _MOMENTS),
    Measurement("shapes", "likelihood.shapes:tables", "measured/likelihood", _MOMENTS),
    Measurement("neighbours", "likelihood.neighbours:tables", "measured/likelihood", _MOMENTS),
    Measurement("likelihood_speed", "likelihood.speed:tables", "measured/likelihood", _MOMENTS),
    # -- simulation
    *(
        Measurement(
            f"simulation_{name}",
            f"simulation.{function}",
            "measured/simulation",
            ("driver",),
        )
        for name, function in {
            "costs": "costs:tables",
            "rules": "rules:tables",
            "left_out": "accuracy:tables",
            "judged": "judge:tables",
            "noise": "noise:tables",
        }.items()
    ),
    # -- accuracy
    Measurement("prices", "accuracy.prices:tables", "measured/accuracy", _PLANNED),
    Measurement("tradeoffs", "accuracy.tradeoffs:tables", "measured/accuracy", _TRADED),
    Measurement("noise", "accuracy.noise:tables", "measured/accuracy", _TRADED),
    Measurement("trust", "accuracy.trust:tables", "measured/accuracy", _IMAGING, by_hand=True),
    Measurement("promises", "accuracy.promises:tables", "measured/plans", _PLANNED),
    Measurement("calibrating", "accuracy.calibrating:tables", "measured/plans", _PLANNED),
    Measurement(
        "checking",
        "accuracy.calibrating:tables",
        "measured/plans",
        _PLANNED,
        given={"seed": 8},
    ),
    Measurement("regret", "accuracy.regret:tables", "measured/plans", _PLANNED),
    # -- Kinect v2
    *(
        Measurement(
            f"kinect2_{name}",
            f"kinect2.{name}:tables",
            "kinect2",
            (*_MOMENTS, "driver"),
            timed=name == "decoding",
        )
        for name in ("corner", "seen", "returns", "decoding")
    ),
    Measurement("by_libfreenect2", "kinect2.by_libfreenect2:store", by_hand=True),
    # -- attacks
    Measurement("abuse", "abuse.bars:tables", "measured/abuse", _SERVER),
    Measurement("abuse_before", "abuse.bars:before", "measured/abuse", _SERVER, by_hand=True),
    Measurement("abuse_soak", "abuse.soaking:tables", "measured/abuse-soak", _SERVER),
    # -- pages
    Measurement("dashboard", "pages.dashboard:tables", "measured/dashboard", _DASHBOARD),
    Measurement("pictures", "pages.pictures:draw"),
    Measurement("views", "pages.pictures:draw_views", by_hand=True),
    Measurement("notebooks", "pages.notebooks:draw"),
    Measurement("mathematics", "pages.mathematics:draw"),
    Measurement("reference", "pages.reference:reference"),
    Measurement("examples", "pages.examples:write_examples"),
)
MEASUREMENTS: Final = {each.name: each for each in _ALL}
"""By their names, in the order of their pages."""

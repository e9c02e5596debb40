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

    at: str
    """Module below this package, and function unless that is ``tables``: ``speed.density``."""
    page: str | None = None
    """In docs/, without its suffix. Without one the function writes what it makes by itself."""
    of: tuple[str, ...] = ()
    """Paths whose code is measured: where they have changed since, figures are called old."""
    level: int = 2
    """Of the headings on the page."""
    named: str = ""
    """What it is called by where that is not the name of its module."""
    by_hand: bool = False
    """Whether it is left out when pages are made: it needs something that is not at hand."""
    given: Mapping[str, Any] = field(default_factory=dict)
    """Options that differ from the function's defaults."""
    timed: bool = True
    """Whether figures depend on the machine."""

    @property
    def module(self) -> str:
        """Where the function is, below this package."""
        return self.at.partition(":")[0]

    @property
    def function(self) -> str:
        """The name of the function there."""
        return self.at.partition(":")[2] or "tables"

    @property
    def name(self) -> str:
        """That it is called by."""
        return self.named or self.module.rpartition(".")[2]


_MOMENTS: Final = ("server/transientcam_moments",)
_SERVER: Final = ("server/transientcam_server",)
_COMPARISONS: Final = ("server/transientcam_moments/comparisons",)
_IMAGING: Final = ("server/transientcam_server/imaging",)
_PLANNED: Final = ("server/transientcam_server/planning", *_MOMENTS, *_IMAGING)
_TRADED: Final = ("server/transientcam_experiments/tradeoff", *_MOMENTS, *_IMAGING)
_CAMERA: Final = (*_MOMENTS, *_IMAGING, "driver")
_DASHBOARD: Final = ("client/dashboard/src",)
_RECORDING: Final = ("server/transientcam_server/recording",)
_RELAY: Final = ("server/transientcam_server/relay",)
_OFFLINE: Final = ("server/transientcam_server/offline",)
_DAEMON: Final = ("server/transientcam_server/daemon",)
_CLIENT: Final = ("pyproject.toml", "client/transientcam", *_SERVER)

_ALL: Final = (
    # -- speed
    Measurement("speed.density", "measured/benchmarks", _MOMENTS),
    Measurement("speed.reconstruction", "measured/benchmarks", _MOMENTS),
    Measurement("speed.stages", "measured/benchmarks", _MOMENTS),
    Measurement("speed.pisarenko", "measured/benchmarks", _MOMENTS),
    Measurement("speed.cumulative", "measured/benchmarks", _MOMENTS),
    Measurement("speed.scaling", "measured/benchmarks", _MOMENTS),
    Measurement("speed.warm_up", "measured/benchmarks", _MOMENTS),
    Measurement("speed.automatic", "measured/benchmarks", _MOMENTS),
    Measurement("speed.gpu", "gpu", _MOMENTS, by_hand=True),
    # -- service
    Measurement("service.throughput", "measured/throughput", (*_MOMENTS, *_SERVER)),
    Measurement("service.stream_load", "measured/stream-load", _SERVER),
    Measurement("service.first_light", "measured/first-light", _SERVER),
    Measurement("service.first_program", "measured/first-program", _CLIENT),
    Measurement("service.robustness", "measured/robustness", _SERVER),
    Measurement("service.soak", "measured/soak", _SERVER),
    Measurement("service.relay_moments", "relay", _RELAY),
    Measurement("service.relay", "relay", _RELAY, 3, "relay_tree"),
    Measurement("service.cluster", "cluster", _OFFLINE, 3),
    Measurement("service.default_sequence", "measured/default-sequence", _CAMERA, timed=False),
    Measurement("service.autobahn", "measured/autobahn", _DAEMON, by_hand=True),
    Measurement("service.losing_control", "operations", (*_DAEMON, "driver"), by_hand=True),
    # -- recordings
    Measurement("recordings.recording", "measured/recording-cost", _RECORDING),
    Measurement("recordings.by_hand", "recordings", (*_MOMENTS, *_IMAGING), 3),
    Measurement("recordings.power_cuts", "measured/power-cuts", _RECORDING),
    Measurement("recordings.fuzz_recordings", "measured/fuzzed-recordings", _RECORDING),
    # -- estimators
    Measurement(
        "estimators.estimators:techniques", "estimators", _COMPARISONS, 2, "techniques", timed=False
    ),
    Measurement("estimators.estimators", "estimators", _MOMENTS),
    Measurement("estimators.cameras", "cameras", _MOMENTS, 3, "camera_returns", timed=False),
    Measurement("estimators.which_camera", "which-camera", _MOMENTS, 2, timed=False),
    Measurement("estimators.harmonics", "harmonics", (*_MOMENTS, *_IMAGING)),
    Measurement("estimators.lost_sync", "lost-synchronisation", (*_MOMENTS, "driver")),
    Measurement("estimators.stability", "measured/stability", _MOMENTS),
    Measurement(
        "estimators.calibration_verdicts",
        "measured/calibration-verdicts",
        (*_IMAGING, "driver"),
        timed=False,
    ),
    Measurement("estimators.corner_strip:draw"),
    # -- likelihood
    Measurement("likelihood.limit", "measured/limit", _MOMENTS, timed=False),
    Measurement("likelihood.captures", "measured/likelihood", _MOMENTS),
    Measurement("likelihood.shapes", "measured/likelihood", _MOMENTS),
    Measurement("likelihood.neighbours", "measured/neighbours", _MOMENTS),
    Measurement("likelihood.speed", "measured/likelihood", _MOMENTS, named="likelihood_speed"),
    # -- simulation
    Measurement("simulation.costs", "measured/simulation", ("driver",), 2, "simulation_costs"),
    Measurement("simulation.rules", "measured/simulation", ("driver",), 2, "simulation_rules"),
    Measurement(
        "simulation.accuracy", "measured/simulation", ("driver",), 2, "simulation_left_out"
    ),
    Measurement("simulation.judge", "measured/simulation", ("driver",), 2, "simulation_judged"),
    Measurement("simulation.moving", "measured/simulation", ("driver",), 2, "simulation_moving"),
    Measurement("simulation.noise", "measured/simulation", ("driver",), 2, "simulation_noise"),
    # -- accuracy
    Measurement("accuracy.prices", "measured/accuracy", _PLANNED),
    Measurement("accuracy.tradeoffs", "measured/accuracy", _TRADED),
    Measurement("accuracy.noise", "measured/accuracy", _TRADED),
    Measurement("accuracy.trust", "measured/accuracy", _IMAGING, timed=False),
    Measurement(
        "accuracy.halves", "measured/accuracy", (*_MOMENTS, *_IMAGING), 2, "validity", timed=False
    ),
    Measurement("accuracy.promises", "measured/plans", _PLANNED),
    # -- Kinect v2
    *(
        Measurement(
            f"kinect2.{name}",
            "kinect2",
            (*_MOMENTS, "driver"),
            named=f"kinect2_{name}",
            timed=name == "decoding",
        )
        for name in ("corner", "seen", "returns", "decoding")
    ),
    Measurement("kinect2.by_libfreenect2:store", by_hand=True),
    # -- attacks
    Measurement("abuse.bars", "measured/abuse", _SERVER, named="abuse"),
    Measurement("abuse.bars:before", "measured/abuse", _SERVER, 2, "abuse_before", by_hand=True),
    Measurement("abuse.soaking", "measured/abuse-soak", _SERVER, named="abuse_soak"),
    # -- pages
    Measurement("pages.dashboard", "measured/dashboard", _DASHBOARD),
    Measurement("pages.pictures:draw"),
    Measurement("pages.pictures:draw_views", named="views", by_hand=True),
    Measurement("pages.notebooks:draw"),
)
MEASUREMENTS: Final = {each.name: each for each in _ALL}
"""By their names, in the order of their pages."""

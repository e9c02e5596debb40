"""The notebooks, run before a simulated camera, and the figures that they show."""

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

from benchmarks.common.daemon import daemon
from benchmarks.common.records import ROOT

CAMERA: Final = "sim:mirrors?seed=1"
_NOTEBOOKS: Final = ROOT / "notebooks"
_NAMES: Final = ("light_in_flight", "direct_and_indirect", "plan_by_accuracy")
_DPI: Final = 110


def shown(name: str, url: str) -> Iterator[Figure]:
    """Run a notebook from beginning to end, and yield the figures among its outputs."""
    spec = importlib.util.spec_from_file_location(name, _NOTEBOOKS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    outputs, defined = module.app.run(defs={"url": url})
    yield from (each for each in outputs if isinstance(each, Figure))
    if "camera" in defined:
        defined["camera"].close()


def draw(figures: Path) -> None:
    """Write all figures."""
    mpl.use("agg")
    environment = {
        "TRANSIENTCAM_KERNELS": "off",  # which are ready would depend on the moment
        # what a daemon has chosen by itself some seconds after its first start
        "TRANSIENTCAM_RECONSTRUCTION__ESTIMATOR": "likelihood",
    }
    with daemon("--camera", CAMERA, environment=environment) as process:
        for name in _NAMES:
            for number, figure in enumerate(shown(name, process.url), start=1):
                path = figures / f"notebook-{name.replace('_', '-')}-{number}.png"
                figure.savefig(path, dpi=_DPI, metadata={"Software": None})
                print(path.name)

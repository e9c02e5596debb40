"""The simulated world behind a simulated camera, and what can be made to go wrong in it."""

import asyncio
from collections.abc import Callable
from typing import Final

from fastapi import APIRouter

from transientcam_driver import Simulation
from transientcam_server import problem_kinds as kinds
from transientcam_server.errors import Problem
from transientcam_server.problems import documented
from transientcam_server.routes.explain_models import ExplanationDocument
from transientcam_server.routes.models import FaultRequest, SimulationDocument
from transientcam_server.service import Service, ServiceOf

router = APIRouter(tags=["simulation"])

_FAULTS: Final[dict[str, Callable[[Simulation], None]]] = {
    "unplug": Simulation.unplug,
    "replug": Simulation.replug,
    "corrupt-image": Simulation.corrupt_next,
    "drop-image": Simulation.drop_next,
}


@router.get("/simulation", summary="The simulated world", responses=documented(kinds.NOT_SIMULATED))
async def read_simulation(service: ServiceOf) -> SimulationDocument:
    """Say which scene is simulated."""
    return SimulationDocument(scene=_simulation(service).scene, faults=list(_FAULTS))


@router.get(
    "/simulation/explain",
    summary="What scene and sequence call for",
    responses=documented(kinds.NOT_SIMULATED),
)
async def explain_simulation(service: ServiceOf) -> ExplanationDocument:
    """Say of each effect whether it is called for, why, how large it is and what it costs."""
    explanation = await asyncio.to_thread(_simulation(service).explain)
    return ExplanationDocument.model_validate(explanation.to_document())


@router.post(
    "/simulation/faults",
    summary="Let something go wrong",
    responses=documented(kinds.NOT_SIMULATED, kinds.BAD_REQUEST, kinds.INVALID_REQUEST),
)
async def make_fault(service: ServiceOf, wanted: FaultRequest) -> SimulationDocument:
    """Unplug the simulated camera, plug it in again, or spoil or lose the next image."""
    simulation = _simulation(service)
    # the device's own lock may be held while it makes an image
    await asyncio.to_thread(_FAULTS[wanted.fault], simulation)
    return SimulationDocument(scene=simulation.scene, faults=list(_FAULTS))


def _simulation(service: Service) -> Simulation:
    simulation = service.camera.simulation
    if simulation is None:
        raise Problem(kinds.NOT_SIMULATED, "This camera is a real one.")
    return simulation

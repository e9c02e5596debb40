"""The simulated world behind a simulated camera, and what can be made to go wrong in it."""

import asyncio
from collections.abc import Callable
from typing import Final

from fastapi import APIRouter, Request

from transientcam_driver import SceneInfo, Simulation, list_scenes
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.simulation import (
    ExplanationDocument,
    FaultRequest,
    SimulationDocument,
    SimulationRequest,
)
from transientcam_server.api._planned import for_request
from transientcam_server.api._problems import documented
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning import Progress
from transientcam_server.service import Service

router = APIRouter(tags=["simulation"])

_FAULTS: Final[dict[str, Callable[[Simulation], None]]] = {
    "unplug": lambda simulation: simulation.unplug(),
    "replug": lambda simulation: simulation.replug(),
    "corrupt-image": lambda simulation: simulation.corrupt_next(),
    "drop-image": lambda simulation: simulation.drop_next(),
}


@router.get("/simulation", summary="The simulated world", responses=documented(kinds.NOT_SIMULATED))
async def read_simulation(service: ServiceOf) -> SimulationDocument:
    """Return which scene is simulated, and what can be changed."""
    return _document(_simulation(service))


@router.put(
    "/simulation",
    summary="Put the camera before another scene",
    responses=documented(kinds.NOT_SIMULATED, kinds.SHUTTING_DOWN),
)
async def change_simulation(
    service: ServiceOf, wanted: SimulationRequest, http: Request
) -> SimulationDocument:
    """Change the scene, force effects on or off, or put the diffuser before the lens.

    `definition` is a scene of one's own; a name it has must not be that of a built-in scene. One
    that would take much memory or time to prepare is refused.

    Capturing goes on meanwhile. Answered once the scene is prepared, which may take seconds; a
    client that leaves ends that. The
    frame that is captured at that moment may hold images of both. Streams are sent a
    `simulation-changed` notice.
    """
    simulation = _simulation(service)
    if wanted.scene is not None and wanted.definition is not None:
        limit = "absent beside definition"
        detail = f"scene = {wanted.scene!r}: must be {limit}"
        raise Problem(kinds.INVALID_REQUEST, detail, field="scene", value=wanted.scene, limit=limit)
    if wanted.scene is not None:
        _require_known(wanted.scene, simulation)

    async def prepare(progress: Progress) -> SimulationDocument:
        def ask() -> None:
            if service.closing.is_set():
                raise Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")
            progress()

        async with service.simulating:  # so that no thread waits for its turn
            change = asyncio.ensure_future(
                asyncio.to_thread(
                    simulation.change,
                    scene=wanted.scene,
                    definition=wanted.definition,
                    effects=wanted.effects,
                    diffuser=wanted.diffuser,
                    ask=ask,
                )
            )
            # also where it was done just before the client was seen to have left
            change.add_done_callback(lambda done: _announce(service, simulation, done))
            await asyncio.shield(change)
        return _document(simulation)

    return await for_request(http, prepare)


@router.get(
    "/simulation/explain",
    summary="What scene and sequence call for",
    responses=documented(kinds.NOT_SIMULATED),
)
async def explain_simulation(service: ServiceOf) -> ExplanationDocument:
    """Return for each effect whether it is called for, why, how large it is and what it costs."""
    explanation = await asyncio.to_thread(_simulation(service).explain)
    return ExplanationDocument.model_validate(explanation.to_document())


@router.post(
    "/simulation/faults",
    summary="Let something go wrong",
    responses=documented(kinds.NOT_SIMULATED),
)
async def make_fault(service: ServiceOf, wanted: FaultRequest) -> SimulationDocument:
    """Unplug the simulated camera, plug it in again, or spoil or lose the next image."""
    simulation = _simulation(service)
    # the device's own lock may be held while it makes an image
    await asyncio.to_thread(_FAULTS[wanted.fault], simulation)
    return _document(simulation)


def _announce(service: Service, simulation: Simulation, done: asyncio.Future[None]) -> None:
    if done.cancelled() or done.exception() is not None:
        return
    service.fronts.forget()
    changed = _document(simulation)
    service.hub.notify(
        "simulation-changed",
        {"scene": changed.scene, "effects": dict(changed.effects), "diffusor": changed.diffusor},
    )


def _simulation(service: Service) -> Simulation:
    simulation = service.camera.simulation
    if simulation is None:
        raise Problem(kinds.NOT_SIMULATED, "This camera is a real one.")
    return simulation


def _document(simulation: Simulation) -> SimulationDocument:
    return SimulationDocument.model_validate(
        {
            "scene": simulation.scene,
            "effects": simulation.effects,
            "scenes": [{"name": each.name, "description": each.description} for each in _offered()],
            "diffusor": simulation.diffuser,
            "plugged": simulation.plugged,
            "faults": list(_FAULTS),
        }
    )


def _offered() -> list[SceneInfo]:
    # that one needs a file, and no path of a client's reaches the file system
    return [each for each in list_scenes() if each.name != "measured"]


def _require_known(scene: str, simulation: Simulation) -> None:
    """Refuse what is neither a built-in scene nor the one that is there."""
    known = [each.name for each in _offered()]
    if scene != simulation.scene and scene not in known:
        limit = f"one of {', '.join(known)}"
        raise Problem(
            kinds.INVALID_REQUEST,
            f"scene = {scene!r}: must be {limit}",
            field="scene",
            value=scene,
            limit=limit,
        )

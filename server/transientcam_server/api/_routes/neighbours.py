"""The cameras on the local network."""

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Depends, Request

from transientcam_server.api._documents.camera import NeighboursDocument
from transientcam_server.api._neighbours import NeighbourSearch

router = APIRouter(tags=["info"])


async def _search(request: Request) -> NeighbourSearch:
    search: NeighbourSearch = request.app.state.neighbours
    return search


@router.get("/cameras", summary="Cameras on the local network")
async def read_cameras(search: Annotated[NeighbourSearch, Depends(_search)]) -> NeighboursDocument:
    """List the cameras that announce themselves by mDNS, after a search of 1.5 s.

    Requests within 5 s share a search. A camera stays in the list for 30 s after its last answer.
    """
    found = await search.neighbours()
    cameras = [asdict(camera) | {"seen_s": age_s} for camera, age_s in found.cameras]
    return NeighboursDocument.model_validate(
        {"cameras": cameras, "left_out": found.left_out, "reason": found.reason}
    )

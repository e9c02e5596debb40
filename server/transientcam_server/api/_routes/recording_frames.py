"""Frames of recordings, with the same routes as the camera's frames."""

from dataclasses import dataclass
from typing import Annotated, Final

from fastapi import APIRouter, Query

from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.recording import TimelineDocument
from transientcam_server.api._frame_query import FrameName
from transientcam_server.api._frame_routes import add_frame_routes
from transientcam_server.api._problems import documented
from transientcam_server.api._routes.recordings import RecordingName
from transientcam_server.errors import kinds
from transientcam_server.imaging import Frame, Pipeline
from transientcam_server.recording import SettingsChoice, timeline
from transientcam_server.service import Service

router = APIRouter(prefix="/recordings/{recording}/frames", tags=["recordings"])

_MISSING: Final = (
    kinds.UNKNOWN_RECORDING,
    kinds.UNKNOWN_FRAME,
    kinds.RECORDING_UNFINISHED,
    kinds.RECORDING_DAMAGED,
    kinds.SHUTTING_DOWN,
    kinds.DISK_STALLED,
)


@dataclass(frozen=True, slots=True)
class ChosenFrame:
    """A frame of a recording that a request names."""

    service: Service
    recording: str
    name: str
    settings: SettingsChoice

    async def frame(self) -> Frame:
        """Read it from the recording."""
        opened = await self.service.recorded_frames.opened(self.recording)
        return await opened.frame(self.name, self.settings)

    async def pipeline(self) -> Pipeline:
        """Return the pipeline of the recording."""
        return (await self.service.recorded_frames.opened(self.recording)).pipeline


# async, or FastAPI takes a thread for it
async def _chosen(
    service: ServiceOf,
    recording: RecordingName,
    frame: FrameName,
    reconstruction: Annotated[
        SettingsChoice,
        Query(description="settings it was recorded with, or those the service has now"),
    ] = "recorded",
) -> ChosenFrame:
    return ChosenFrame(service, recording, frame, reconstruction)


@router.get("", summary="Which frames a recording has", responses=documented(*_MISSING))
async def read_frames(service: ServiceOf, recording: RecordingName) -> TimelineDocument:
    """Return how many frames there are, and when they were captured; also while it is recorded."""
    opened = await service.recorded_frames.opened(recording)
    return TimelineDocument(**timeline(await opened.captured_unix_s()))


add_frame_routes(
    router,
    _chosen,
    path="/{frame}",
    missing=_MISSING,
    frame=(
        "A recorded frame",
        "Return what is known of a recorded frame; recorded frames are counted from 1.",
    ),
    pixel="one pixel of a recorded frame",
    product=(
        "A product of a recorded frame",
        "Return what a product of the camera's frames is, of a recorded one.",
    ),
)

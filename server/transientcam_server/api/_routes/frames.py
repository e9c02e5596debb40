"""Frames of the camera: the latest, former ones, their products, and single pixels."""

from dataclasses import dataclass
from typing import Annotated, Final

from fastapi import APIRouter, Query

from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.frame import HistoryDocument
from transientcam_server.api._frame_query import LATEST, MAX_NUMBER, FrameName
from transientcam_server.api._frame_routes import add_frame_routes
from transientcam_server.errors import invalid, kinds
from transientcam_server.imaging import Frame, Pipeline
from transientcam_server.service import Service

router = APIRouter(tags=["frames"])

MAX_WAIT_S: Final = 10.0
_PRODUCT = """\
Return a product of a frame as msgpack, npy, npz, PNG, TIFF, PLY or CSV, whichever fits it.

What is over time of flight is evaluated at `time_s`, or at `bins` times (64 without either).
A 16-bit PNG holds range in mm and everything else in DN; 0 is no value. `region` and
`decimation` leave pixels out, and the frame's meta repeats them."""


@dataclass(frozen=True, slots=True)
class ChosenFrame:
    """A frame of the camera that a request names."""

    service: Service
    name: str
    wait_s: float
    after: int

    async def frame(self) -> Frame:
        """Return it, waiting for a frame that is not captured yet as the request allows.

        Raises Problem ``no-frame-yet``, ``unknown-frame``, ``frame-gone``, or ``invalid-request``
        for ``after`` with a number.
        """
        hub, history = self.service.hub, self.service.history
        if self.name == LATEST:
            return await hub.newest(after=self.after, wait_s=self.wait_s)
        if self.after:
            raise invalid("after", self.after, "left out where the frame is named by its number")
        number = int(self.name)
        if self.wait_s and number > (history.last or 0):
            await hub.newest(after=number - 1, wait_s=self.wait_s)
        return hub.partly_sent(number) or history.frame(number)

    async def pipeline(self) -> Pipeline:
        """Return the pipeline of the camera."""
        return self.service.pipeline


# async, or FastAPI takes a thread for it
async def _chosen(
    service: ServiceOf,
    frame: FrameName,
    wait_s: Annotated[
        float,
        Query(
            ge=0.0,
            le=MAX_WAIT_S,
            allow_inf_nan=False,
            description="seconds to wait for such a frame where there is none yet",
        ),
    ] = 0.0,
    after: Annotated[
        int,
        Query(
            ge=0,
            le=MAX_NUMBER,
            description="of `latest`: only a frame with a greater number will do",
        ),
    ] = 0,
) -> ChosenFrame:
    return ChosenFrame(service, frame, wait_s, after)


@router.get("/frames", summary="Which frames can be had")
async def read_frames(service: ServiceOf) -> HistoryDocument:
    """Return which frames are kept, and how much of them may be."""
    return HistoryDocument.model_validate(service.history)


add_frame_routes(
    router,
    _chosen,
    path="/frames/{frame}",
    missing=(kinds.UNKNOWN_FRAME, kinds.FRAME_GONE, kinds.NO_FRAME_YET, kinds.SHUTTING_DOWN),
    frame=("A frame", "Return what is known of the latest frame, or of one of the last seconds."),
    pixel="one pixel",
    product=("A product of a frame", _PRODUCT),
)

"""Frames: what is known of the latest and of former ones, their products, and single pixels."""

from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Response

from transientcam_server.api.dependencies import ServiceOf
from transientcam_server.api.documents.frame import FrameDocument, HistoryDocument
from transientcam_server.api.documents.pixel import PixelDocument
from transientcam_server.api.frame_query import (
    CSV_RESPONSES,
    LATEST,
    MAX_NUMBER,
    PRODUCT_PROBLEMS,
    PRODUCT_RESPONSES,
    FrameName,
    FrameQueryOf,
    PixelBins,
    ProductName,
    X,
    Y,
    invalid,
    pixel_answer,
    product_answer,
)
from transientcam_server.api.problems import documented
from transientcam_server.errors import kinds
from transientcam_server.imaging.frame import Frame
from transientcam_server.service import Service

router = APIRouter(tags=["frames"])

MAX_WAIT_S: Final = 10.0
_MISSING = (
    kinds.UNKNOWN_FRAME,
    kinds.FRAME_GONE,
    kinds.NO_FRAME_YET,
    kinds.SHUTTING_DOWN,
)


class LiveFrameChoice:
    """Which frame a request is about; asked for when it is needed."""

    def __init__(self, service: Service, name: str, wait_s: float, after: int) -> None:
        self._service = service
        self._name = name
        self._wait_s = wait_s
        self._after = after

    async def frame(self) -> Frame:
        """Return it, waiting for one that is still to come as long as the request allows.

        Raises
        ------
        Problem
            ``no-frame-yet``, ``unknown-frame``, ``frame-gone``, or ``invalid-request`` for
            ``after`` with a number.
        """
        hub, history = self._service.hub, self._service.history
        if self._name == LATEST:
            return await hub.newest(after=self._after, wait_s=self._wait_s)
        if self._after:
            raise invalid("after", self._after, "left out where the frame is named by its number")
        number = int(self._name)
        if self._wait_s and number > (history.last or 0):
            await hub.newest(after=number - 1, wait_s=self._wait_s)
        return history.frame(number)


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
) -> LiveFrameChoice:
    return LiveFrameChoice(service, frame, wait_s, after)


ChosenOf = Annotated[LiveFrameChoice, Depends(_chosen)]


@router.get("/frames", summary="Which frames can be had")
async def read_frames(service: ServiceOf) -> HistoryDocument:
    """Say which frames are kept, and how much of them may be."""
    return HistoryDocument(**service.history.to_document())


@router.get(
    "/frames/{frame}",
    summary="A frame",
    responses=documented(kinds.INVALID_REQUEST, *_MISSING),
)
async def read_frame(chosen: ChosenOf) -> FrameDocument:
    """Say what is known of the latest frame, or of one of the last seconds."""
    return FrameDocument.model_validate((await chosen.frame()).meta())


@router.get(
    "/frames/{frame}/pixel",
    summary="Everything about one pixel",
    response_model=PixelDocument,
    responses=documented(kinds.INVALID_REQUEST, kinds.PRODUCT_FAILED, *_MISSING),
)
async def read_pixel(
    service: ServiceOf, chosen: ChosenOf, x: X, y: Y, bins: PixelBins = 256
) -> Response:
    """Return range, returns, moments and the whole estimated impulse response of one pixel."""
    simulated = service.camera.simulation is not None
    return await pixel_answer(await chosen.frame(), x, y, bins, simulated=simulated)


@router.get(
    "/frames/{frame}/pixel.csv",
    summary="The impulse response of one pixel as a table",
    response_class=Response,
    responses=CSV_RESPONSES | documented(kinds.INVALID_REQUEST, kinds.PRODUCT_FAILED, *_MISSING),
)
async def read_pixel_csv(chosen: ChosenOf, x: X, y: Y, bins: PixelBins = 256) -> Response:
    """Return the density, its bounds and the cumulative light of one pixel as CSV."""
    return await pixel_answer(await chosen.frame(), x, y, bins, as_csv=True)


@router.get(
    "/frames/{frame}/{product}",
    summary="A product of a frame",
    response_class=Response,
    responses=PRODUCT_RESPONSES | documented(*PRODUCT_PROBLEMS, *_MISSING),
)
async def read_product(
    service: ServiceOf, chosen: ChosenOf, product: ProductName, wanted: FrameQueryOf
) -> Response:
    """Return a product of a frame as msgpack, npy, npz, PNG, TIFF, PLY or CSV, whichever fits it.

    What is over time of flight is evaluated at `time_s`, or at `bins` times (64 without either).
    A 16-bit PNG holds range in mm and everything else in DN; 0 is no value. `region` and
    `decimation` leave pixels out, and the frame's meta repeats them.
    """
    return await product_answer(
        product, wanted, product=service.pipeline.product, frame=chosen.frame
    )

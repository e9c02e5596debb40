"""Frames of recordings: what the camera's frames are asked, of any that was recorded."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Response

from transientcam_server.api.dependencies import ServiceOf
from transientcam_server.api.documents.frame import FrameDocument
from transientcam_server.api.documents.pixel import PixelDocument
from transientcam_server.api.documents.recording import TimelineDocument
from transientcam_server.api.frame_query import (
    CSV_RESPONSES,
    PRODUCT_PROBLEMS,
    PRODUCT_RESPONSES,
    FrameName,
    FrameQueryOf,
    PixelBins,
    ProductName,
    X,
    Y,
    pixel_answer,
    product_answer,
)
from transientcam_server.api.problems import documented
from transientcam_server.errors import kinds
from transientcam_server.imaging.frame import Frame
from transientcam_server.imaging.pipeline import Pipeline
from transientcam_server.recording.frames import SettingsChoice, timeline
from transientcam_server.service import Service

router = APIRouter(prefix="/recordings/{recording}/frames", tags=["recordings"])

_MISSING = (
    kinds.UNKNOWN_RECORDING,
    kinds.UNKNOWN_FRAME,
    kinds.RECORDING_UNFINISHED,
    kinds.RECORDING_DAMAGED,
)


RecordingName = Annotated[
    str,
    Path(
        description="its id, as the list has it",
        max_length=200,
        examples=["20261120T081500Z-3f9c2a"],
    ),
]


class RecordedFrameChoice:
    """Which frame of which recording a request is about."""

    def __init__(
        self,
        service: Service,
        recording: str,
        frame: str,
        settings: SettingsChoice,
    ) -> None:
        self._service = service
        self._recording = recording
        self._frame = frame
        self._settings: SettingsChoice = settings

    async def frame(self) -> Frame:
        """Read it."""
        opened = await self._service.recorded_frames.opened(self._recording)
        return await opened.frame(self._frame, self._settings)

    async def pipeline(self) -> Pipeline:
        """Return what computes its products."""
        return (await self._service.recorded_frames.opened(self._recording)).pipeline


# async, or FastAPI takes a thread for it
async def _chosen(
    service: ServiceOf,
    recording: RecordingName,
    frame: FrameName,
    reconstruction: Annotated[
        SettingsChoice,
        Query(description="settings it was recorded with, or those the service has now"),
    ] = "recorded",
) -> RecordedFrameChoice:
    return RecordedFrameChoice(service, recording, frame, reconstruction)


ChosenOf = Annotated[RecordedFrameChoice, Depends(_chosen)]


@router.get(
    "",
    summary="Which frames a recording has",
    responses=documented(kinds.INVALID_REQUEST, *_MISSING),
)
async def read_frames(service: ServiceOf, recording: RecordingName) -> TimelineDocument:
    """Say how many frames there are, and when they were captured; also while it is recorded."""
    opened = await service.recorded_frames.opened(recording)
    return TimelineDocument(**timeline(await opened.host_time_s()))


@router.get(
    "/{frame}",
    summary="A recorded frame",
    responses=documented(kinds.INVALID_REQUEST, *_MISSING),
)
async def read_frame(chosen: ChosenOf) -> FrameDocument:
    """Say what is known of a recorded frame; recorded frames are counted from 1."""
    return FrameDocument.model_validate((await chosen.frame()).meta())


@router.get(
    "/{frame}/pixel",
    summary="Everything about one pixel of a recorded frame",
    response_model=PixelDocument,
    responses=documented(kinds.INVALID_REQUEST, kinds.PRODUCT_FAILED, *_MISSING),
)
async def read_pixel(chosen: ChosenOf, x: X, y: Y, bins: PixelBins = 256) -> Response:
    """Return range, returns, moments and the whole estimated impulse response of one pixel."""
    return await pixel_answer(await chosen.frame(), x, y, bins)


@router.get(
    "/{frame}/pixel.csv",
    summary="The impulse response of one pixel of a recorded frame as a table",
    response_class=Response,
    responses=CSV_RESPONSES | documented(kinds.INVALID_REQUEST, kinds.PRODUCT_FAILED, *_MISSING),
)
async def read_pixel_csv(chosen: ChosenOf, x: X, y: Y, bins: PixelBins = 256) -> Response:
    """Return the density, its bounds and the cumulative light of one pixel as CSV."""
    return await pixel_answer(await chosen.frame(), x, y, bins, as_csv=True)


@router.get(
    "/{frame}/{product}",
    summary="A product of a recorded frame",
    response_class=Response,
    responses=PRODUCT_RESPONSES | documented(*PRODUCT_PROBLEMS, *_MISSING),
)
async def read_product(chosen: ChosenOf, product: ProductName, wanted: FrameQueryOf) -> Response:
    """Return what a product of the camera's frames is, of a recorded one."""
    pipeline = await chosen.pipeline()
    return await product_answer(product, wanted, product=pipeline.product, frame=chosen.frame)

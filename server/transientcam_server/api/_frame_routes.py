"""The routes of one frame, the same for the camera's frames and for those of recordings."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Final, Protocol

from fastapi import APIRouter, Depends, Query, Response

from transientcam_server.api._documents.frame import FrameDocument, PixelDocument
from transientcam_server.api._frame_query import (
    CSV_RESPONSES,
    PRODUCT_PROBLEMS,
    PRODUCT_RESPONSES,
    FrameQueryOf,
    PixelBins,
    ProductName,
    X,
    Y,
    pixel_answer,
    product_answer,
)
from transientcam_server.api._problems import documented
from transientcam_server.errors import ProblemKind, kinds
from transientcam_server.imaging import Frame, Pipeline

_JUDGED: Final = ("range", "range_error")
_Computed = Annotated[
    bool,
    Query(
        description="compute range and accuracy first, which are null else until a product needs "
        "them"
    ),
]


class ChosenFrame(Protocol):
    """The frame that a request is about; looked up only once the request is known to be valid."""

    async def frame(self) -> Frame:
        """Return the frame.

        Raises Problem: one of the kinds that `add_frame_routes` was given as ``missing``.
        """
        ...

    async def pipeline(self) -> Pipeline:
        """Return the pipeline that computes its products."""
        ...


def add_frame_routes(
    router: APIRouter,
    chosen_by: Callable[..., Awaitable[ChosenFrame]],
    *,
    path: str,
    missing: tuple[ProblemKind, ...],
    frame: tuple[str, str],
    pixel: str,
    product: tuple[str, str],
) -> None:
    """Add the routes for a frame, its pixels and its products below ``path``.

    ``chosen_by``: dependency that returns the frame a request is about.
    ``missing``: kinds of problems with which a frame cannot be found.
    ``frame``, ``pixel``, ``product``: how the OpenAPI document names each of them, and describes a
    frame and a product.
    """
    chosen_of = Depends(chosen_by)

    @router.get(path, summary=frame[0], description=frame[1], responses=documented(*missing))
    async def read_frame(
        chosen: ChosenFrame = chosen_of, *, computed: _Computed = False
    ) -> FrameDocument:
        found = await chosen.frame()
        if computed:
            products = (await chosen.pipeline()).products
            await found.computed(products[name] for name in _JUDGED if name in products)
        return found.meta()

    @router.get(
        f"{path}/pixel",
        summary=f"Everything about {pixel}",
        response_model=PixelDocument,
        responses=documented(kinds.PRODUCT_FAILED, *missing),
    )
    async def read_pixel(
        *, chosen: ChosenFrame = chosen_of, x: X, y: Y, bins: PixelBins = 256
    ) -> Response:
        """Return range, returns, moments and the whole estimated impulse response of one pixel."""
        simulated = "truth" in (await chosen.pipeline()).products
        return await pixel_answer(await chosen.frame(), x, y, bins, simulated=simulated)

    @router.get(
        f"{path}/pixel.csv",
        summary=f"The impulse response of {pixel} as a table",
        response_class=Response,
        responses=CSV_RESPONSES | documented(kinds.PRODUCT_FAILED, *missing),
    )
    async def read_pixel_csv(
        *, chosen: ChosenFrame = chosen_of, x: X, y: Y, bins: PixelBins = 256
    ) -> Response:
        """Return the density, its bounds and the cumulative light of one pixel as CSV."""
        return await pixel_answer(await chosen.frame(), x, y, bins, as_csv=True)

    @router.get(
        f"{path}/{{product}}",
        summary=product[0],
        description=product[1],
        response_class=Response,
        responses=PRODUCT_RESPONSES | documented(*PRODUCT_PROBLEMS, *missing),
    )
    async def read_product(
        *, chosen: ChosenFrame = chosen_of, product: ProductName, query: FrameQueryOf
    ) -> Response:
        pipeline = await chosen.pipeline()
        return await product_answer(product, query, product=pipeline.product, frame=chosen.frame)

"""What answers here, and which versions of the interface it serves."""

import asyncio

from fastapi import APIRouter

import transientcam_moments as tm
from transientcam import wire
from transientcam_moments import comparisons
from transientcam_server.api._auth.permissions import PrincipalOf
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._docs import asyncapi
from transientcam_server.api._documents.frame import HistoryDocument
from transientcam_server.api._documents.service import InfoDocument, VersionsDocument
from transientcam_server.imaging import ENCODINGS, Product, Recipe
from transientcam_server.service import VERSION

_STATED = ("label", "frequencies", "least_harmonics", "assumptions", "cost", "failure")
router = APIRouter(tags=["info"])
versions = APIRouter(tags=["info"])


@versions.get("/api/versions", summary="Versions of the interface")
async def read_versions(service: ServiceOf) -> VersionsDocument:
    """Return which versions of the interface are served; this path itself has no version."""
    api = [VersionsDocument.ApiDocument(name="v1", path=f"{service.settings.root_path}/api/v1")]
    return VersionsDocument(name="transientcam", version=VERSION, api=api)


@router.get("/info", summary="The service")
async def read_info(service: ServiceOf, principal: PrincipalOf) -> InfoDocument:
    """Return what this service is, which products its frames have, and what the caller may do."""
    device = tm.kernels.device_state()
    return InfoDocument(
        **service.identity,
        api="v1",
        stream=InfoDocument.StreamDocument(
            path=f"{service.settings.root_path}/api/v1/stream",
            subprotocol=wire.SUBPROTOCOL,
            asyncapi=f"{service.settings.root_path}{asyncapi.PATH}",
            encodings=list(wire.encoding_names()),
        ),
        products=[_product(product) for product in service.pipeline.products.values()],
        absent_products=[
            InfoDocument.AbsentDocument(name=name, reason=reason)
            for name, reason in service.pipeline.absent.items()
        ],
        estimators=[_estimator(*each) for each in comparisons.PLUGINS.statements().items()],
        caller=InfoDocument.CallerDocument.model_validate(
            {"name": principal.name, "role": str(principal.role), "may_light": principal.may_light}
        ),
        history=HistoryDocument.model_validate(service.history),
        clients=service.hub.clients,
        kernels=_kernels(service.pipeline.recipe_of(service.applied)),
        device=None if device is None else InfoDocument.DeviceDocument.model_validate(device),
        reconstruction=service.pipeline.reconstruction.settings.model_dump(),
    )


def _kernels(recipe: Recipe) -> InfoDocument.KernelsDocument | None:
    now_s, order = asyncio.get_running_loop().time(), recipe.applied.sequence.order
    preparing, left_s = tm.kernels.preparing(recipe.kernels, order, now_s)
    return InfoDocument.KernelsDocument(preparing=preparing, left_s=left_s) if preparing else None


def _estimator(
    name: str, found: comparisons.Technique | tm.PluginFailed
) -> InfoDocument.EstimatorDocument:
    stated = {each: getattr(found, each, None) for each in _STATED}  # a failure states nothing
    unusable = found.reason if isinstance(found, tm.PluginFailed) else None
    return InfoDocument.EstimatorDocument.model_validate(
        {"name": name, "unusable": unusable} | stated
    )


def _product(product: Product) -> InfoDocument.ProductDocument:
    return InfoDocument.ProductDocument(
        name=product.name,
        unit=product.description.unit,
        axes=list(product.description.axes),
        dtype=product.description.dtype,
        summary=product.description.summary,
        formats=[name for name, encoding in ENCODINGS.items() if encoding.fits(product)],
        over_time=product.over_time,
        streamed=not product.over_time,
        stated=None
        if product.stated is None
        else {each: getattr(product.stated, each) for each in _STATED[-3:]},
    )

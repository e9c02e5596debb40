"""The JSON documents about the service itself."""

from typing import Literal

from pydantic import Field

from transientcam_server.api._documents.document import Document
from transientcam_server.api._documents.frame import HistoryDocument


class InfoDocument(Document):
    """What answers here."""

    class CallerDocument(Document):
        """The client that sent this request, as the service authenticated it."""

        name: str = Field(description="of the token; `anybody` where none is required")
        role: Literal["viewer", "operator", "admin"]
        may_light: bool
        """Whether it may do what switches the light on."""

    class ProductDocument(Document):
        """An array that can be requested of a frame."""

        name: str
        unit: str
        axes: list[str]
        dtype: str
        summary: str
        formats: list[str]
        """Suffixes it can be had in."""
        over_time: bool
        """Whether it takes `time_s` or `bins`."""
        streamed: bool
        """Whether the stream offers it."""
        stated: dict[str, str] | None
        """Of another package's its assumptions, cost and failure; null for ours."""

    class AbsentDocument(Document):
        """A product that frames of this camera do not have."""

        name: str
        reason: str

    class EstimatorDocument(Document):
        """An estimator of another package, and what it states of itself."""

        name: str
        """The value of `reconstruction.estimator`."""
        label: str | None
        """Where it comes from; this and what follows is null where it cannot be used."""
        frequencies: str | None = Field(description="what it needs to be measured")
        least_harmonics: int | None
        assumptions: str | None
        cost: str | None
        failure: str | None
        """What happens where its assumptions do not hold."""
        unusable: str | None
        """Why it cannot be used; null where it can."""

    class StreamDocument(Document):
        """Where the stream is."""

        path: str
        subprotocol: str
        asyncapi: str = Field(description="where its messages are described, as AsyncAPI 3")
        encodings: list[str] = Field(description="which a subscription may request")

    class DeviceDocument(Document):
        """A device that was asked for; see `serve --device`."""

        wanted: str
        name: str | None
        """Of the adapter; null until one was looked for, or where there is none."""
        results: dict[str, int]
        """Passes, likelihoods, films that the device was asked for, by what made them: `device`,
        or `processor` where it failed."""
        refused: str | None
        """Why nothing, or not everything, is computed there."""

    class KernelsDocument(Document):
        """Compiled code for the present sequence and estimator that is still being prepared."""

        preparing: list[str] = Field(description="kernels by their names, the next one first")
        left_s: float = Field(description="about how long it takes until the last one is ready")

    name: str
    version: str
    service_id: str
    """Another one with each start of the service."""
    path: list[str]
    """The `service_id` of this service and of all that it relays; the camera's own is the last."""
    api: str
    stream: StreamDocument
    products: list[ProductDocument]
    absent_products: list[AbsentDocument]
    """What other cameras have, or other packages would, and why this one does not."""
    estimators: list[EstimatorDocument]
    """Those of other packages; what is offered is `reconstruction.estimator` of `GET
    /parameters`."""
    caller: CallerDocument
    history: HistoryDocument
    """Which frames can be had, as in `GET /frames`."""
    clients: int
    """Streams open now."""
    kernels: KernelsDocument | None = None
    """What frames are computed without until it is compiled: more slowly, with the same results;
    null where nothing is being prepared."""
    device: DeviceDocument | None = None
    """Null where frames are computed on the processor."""
    reconstruction: dict[str, float | str]
    """Settings of the reconstruction."""


class LivenessDocument(Document):
    """The process answers."""

    status: Literal["alive"] = "alive"


class ReadinessDocument(Document):
    """Frames can be had."""

    status: Literal["ready"] = "ready"


class VersionsDocument(Document):
    """Which interfaces are served."""

    class ApiDocument(Document):
        """One version of the interface."""

        name: str
        path: str

    name: str
    version: str
    api: list[ApiDocument]

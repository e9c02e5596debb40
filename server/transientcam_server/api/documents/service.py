"""The JSON documents about the service itself."""

from typing import Any, Literal

from pydantic import ConfigDict, Field

from transientcam_server.api.documents.document import Document
from transientcam_server.api.documents.frame import HistoryDocument


class InfoDocument(Document):
    """What answers here."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "transientcam",
                    "version": "0.1.0",
                    "api": "v1",
                    "stream": {
                        "path": "/api/v1/stream",
                        "subprotocol": "transientcam.v1.msgpack",
                        "asyncapi": "/asyncapi.json",
                        "encodings": ["f32", "u16", "reflection16"],
                    },
                    "products": [
                        {
                            "name": "range",
                            "unit": "m",
                            "axes": ["y", "x"],
                            "dtype": "<f4",
                            "summary": "range of the first return; NaN without one",
                            "formats": ["msgpack", "npy", "npz", "png", "tiff", "csv"],
                            "over_time": False,
                            "streamed": True,
                        }
                    ],
                    "history": {
                        "first": 1099,
                        "last": 1204,
                        "count": 106,
                        "bytes": 66347520,
                        "seconds": 9.94,
                        "limit_bytes": 268435456,
                        "limit_seconds": 10.0,
                    },
                    "caller": {"name": "bench-2", "role": "operator"},
                    "clients": 1,
                    "kernels": {"enabled": True, "compiled": [], "compiling": None, "failed": []},
                    "reconstruction": {
                        "smoothing_px": 0.6,
                        "bias": 0.004,
                        "return_threshold": 0.1,
                        "estimator": "pisarenko",
                        "minimum_brightness_dn": 0.0,
                    },
                }
            ]
        }
    )

    class CallerDocument(Document):
        """Who the service takes the one who asks for."""

        name: str = Field(description="of the token; anybody where none is needed")
        role: Literal["viewer", "operator", "admin"]

    class ProductDocument(Document):
        """An array that a frame can be asked for."""

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

    class StreamDocument(Document):
        """Where the stream is."""

        path: str
        subprotocol: str
        asyncapi: str = Field(description="where its messages are described, as AsyncAPI 3")
        encodings: list[str] = Field(description="which a subscription may ask for")

    name: str
    version: str
    api: str
    stream: StreamDocument
    products: list[ProductDocument]
    caller: CallerDocument
    history: HistoryDocument
    """Which frames can be had, as `GET /frames` says."""
    clients: int
    """Streams open now."""
    kernels: dict[str, Any]
    """Which compiled kernels are ready; the others are computed with NumPy meanwhile."""
    reconstruction: dict[str, float | str]
    """Settings of the reconstruction."""


class LivenessDocument(Document):
    """The process answers."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "alive"}]})

    status: Literal["alive"] = "alive"


class ReadinessDocument(Document):
    """Frames can be had."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "ready"}]})

    status: Literal["ready"] = "ready"


class VersionsDocument(Document):
    """Which interfaces are served."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "transientcam",
                    "version": "0.1.0",
                    "api": [{"name": "v1", "path": "/api/v1"}],
                }
            ]
        }
    )

    class ApiDocument(Document):
        """One version of the interface."""

        name: str
        path: str

    name: str
    version: str
    api: list[ApiDocument]

"""The JSON documents of stores of products."""

from typing import Any, Literal

from pydantic import Field

from transientcam_server.api._documents.document import Document


class ProductStoreDocument(Document):
    """Products of all frames of a recording, as `transientcam reconstruct` wrote them."""

    id: str
    """Name of the store, without `.zarr`."""
    generation: str
    """Names what it holds. At `/products/{id}~{generation}/zarr` a reader gets an error instead of
    the data of another store that has taken its place."""
    recording: str = Field(validation_alias="recording_id")
    """Id of the recording whose products these are; it may have been deleted."""
    name: str = Field(validation_alias="title")
    """What people call that."""
    state: Literal["complete", "unfinished", "damaged"]
    """`unfinished`: frames are still computed, or an interrupted run was not gone on with.
    `damaged`: it cannot be read, and what is said of it is empty."""
    problem: str | None = None
    """Why it cannot be read."""
    frames: int
    products: list[str]
    bins: int
    """Times of flight of products over time."""
    reconstruction: dict[str, Any]
    """Settings that they were computed with."""


class ProductStoresDocument(Document):
    """Stores of products beside the recordings, by their ids."""

    directory: str
    """Where they are, on the machine of the service: that of the recordings."""
    stores: list[ProductStoreDocument]

"""The JSON documents of stores of products."""

from typing import Any, Literal

from transientcam_server.api._documents.document import Document
from transientcam_server.recording import ProductStore


class ProductStoreDocument(Document):
    """Products of all frames of a recording, as `transientcam reconstruct` wrote them."""

    id: str
    """Name of the store, without `.zarr`."""
    recording: str
    """Id of the recording whose products these are; it may have been deleted."""
    name: str
    """What people call that."""
    state: Literal["complete", "unfinished"]
    """`unfinished`: frames are still computed, or an interrupted run was not gone on with."""
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


def document(store: ProductStore) -> ProductStoreDocument:
    """Return a store as its document."""
    return ProductStoreDocument(
        id=store.id,
        recording=store.recording_id,
        name=store.title,
        state="complete" if store.complete else "unfinished",
        frames=store.frames,
        products=list(store.products),
        bins=store.bins,
        reconstruction=dict(store.reconstruction),
    )

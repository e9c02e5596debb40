"""The JSON documents about cameras on the local network."""

from typing import Literal

from pydantic import Field

from transientcam_server.api._documents.document import Document


class NeighboursDocument(Document):
    """The cameras that announce themselves on the local network by mDNS.

    Everything in it is what they announce: no request was sent to any of them.
    """

    class NeighbourDocument(Document):
        """The service of a camera, as it announces itself."""

        name: str = Field(description="unique on the network")
        url: str
        """Of its dashboard, and what clients take as its address."""
        model: str
        serial: str
        firmware: str
        api: str = Field(description="versions of its interface")
        tls: bool
        state: Literal["", "arming", "starting", "streaming", "stopped", "calibrating", "lost"]
        """What its camera does; empty where that is not announced."""
        seen_s: float = Field(ge=0.0, description="since it answered, in s")

    cameras: list[NeighbourDocument] = Field(max_length=256)
    left_out: int = Field(ge=0, description="how many more were announced")
    reason: str | None = Field(default=None, description="why the network could not be searched")

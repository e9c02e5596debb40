"""Which encoding an HTTP answer has: by its suffix or by the Accept header."""

from transientcam import wire
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import ENCODINGS, MSGPACK, PNG, TIFF, Encoding, Product

_BY_MEDIA_TYPE = {encoding.media_type: encoding for encoding in ENCODINGS.values()} | dict.fromkeys(
    wire.MEDIA_TYPE_ALIASES, MSGPACK
)


def negotiate(product: Product, *, suffix: str | None, accept: str | None) -> Encoding:
    """Return the encoding that a suffix names, else the one an Accept header prefers.

    Raises Problem ``not-acceptable``, with the list of those the product has.
    """
    supported = [encoding for encoding in ENCODINGS.values() if encoding.fits(product)]
    if suffix is not None:
        for encoding in supported:
            if encoding.name == suffix:
                return encoding
        raise _not_acceptable(product, supported, field="suffix", value=suffix)
    for media_type in _preferences(accept or "*/*"):
        preferred = _matching(media_type, supported)
        if preferred is not None:
            return preferred
    raise _not_acceptable(product, supported, field="Accept", value=accept)


def _matching(media_type: str, supported: list[Encoding]) -> Encoding | None:
    if media_type in ("*/*", "application/*"):
        return MSGPACK
    if media_type == "image/*":
        return next((each for each in (PNG, TIFF) if each in supported), None)
    encoding = _BY_MEDIA_TYPE.get(media_type)
    return encoding if encoding in supported else None


def _preferences(accept: str) -> list[str]:
    """Return the media types of an Accept header, best first (RFC 9110, Sec. 12.5.1)."""
    weighted = []
    for item in accept.lower().split(","):
        media_type, *parameters = (part.strip() for part in item.split(";"))
        quality = 1.0
        for parameter in parameters:
            if parameter.startswith("q="):
                try:
                    quality = float(parameter[2:])
                except ValueError:
                    quality = 0.0
        if media_type and quality > 0.0:
            weighted.append((quality, media_type))
    return [media_type for _, media_type in sorted(weighted, key=lambda each: -each[0])]


def _not_acceptable(
    product: Product, supported: list[Encoding], *, field: str, value: object
) -> Problem:
    names = [encoding.name for encoding in supported]
    return Problem(
        kinds.NOT_ACCEPTABLE,
        f"{product.name} is not available in this format, but as {', '.join(names)}.",
        field=field,
        value=value,
        supported=names,
        media_types=[encoding.media_type for encoding in supported],
    )

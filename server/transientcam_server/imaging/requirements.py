"""What products need of the frequencies that a camera measures."""

from collections.abc import Collection

from transientcam_driver import Sampling
from transientcam_server.imaging.products import Product
from transientcam_server.imaging.recipe import listed


def unmet(product: Product, sampling: Sampling, zeroths: Collection[str]) -> str | None:
    """Return why frames have too few frequencies for a product; None where they do not.

    Parameters
    ----------
    zeroths
        Where the zeroth moment may come from.
    """
    if sampling.consecutive:
        return None
    measured = f"this camera measures the multiples {listed(sampling.multiples)}"
    if product.of_toeplitz:
        return f"it needs consecutive multiples of one frequency, and {measured}"
    if product.of_brightness and set(zeroths) == {"estimated"}:
        return f"it needs a zeroth moment, which cannot be estimated: {measured}"
    return None

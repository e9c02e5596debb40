"""What products need of a camera: its frequencies, its noise, and the truth of a simulation."""

from collections.abc import Collection
from typing import Final

from transientcam_driver import Capabilities, Sampling
from transientcam_moments import PluginFailed
from transientcam_server.imaging._products.products import Product, product_names, product_of
from transientcam_server.imaging._recipe.recipe import listed

LEAST_TO_SEPARATE: Final = 3
"""Frequencies with gaps that tell more than one return: fewer are `unwrapped-phase`'s alone."""


def absent_products(
    capabilities: Capabilities, *, truth_known: bool, noise_known: bool, images_known: bool
) -> dict[str, str]:
    """Return the products that frames of a camera do not have, each with the reason.

    ``truth_known``: whether a simulation knows the true range.
    ``noise_known``: whether the noise of the sensor is stated, or there are images to tell it.
    ``images_known``: whether they have images, and not their moments alone.
    """

    def lacks(product: Product) -> str | None:
        if product.needs == "truth" and not truth_known:
            return "only a simulated camera knows the true range"
        if product.needs == "raw" and not images_known:
            return "this service relays moments alone, without the images they are of"
        if product.of_noise and not noise_known:
            return "the noise of this camera's sensor is not known"
        return unmet(product, capabilities.sampling, capabilities.zeroths)

    def why(name: str) -> str | None:
        try:
            return lacks(product_of(name))
        except PluginFailed as failed:
            return failed.reason

    reasons = {name: why(name) for name in product_names()}
    return {name: reason for name, reason in reasons.items() if reason is not None}


def unmet(product: Product, sampling: Sampling, zeroths: Collection[str]) -> str | None:
    """Return why frames have too few frequencies for a product; None where they do not.

    ``zeroths``: where the zeroth moment may come from.
    """
    if sampling.consecutive:
        return None
    measured = f"this camera measures the multiples {listed(sampling.multiples)}"
    if product.of_toeplitz:
        return f"it needs consecutive multiples of one frequency, and {measured}"
    if product.of_brightness and set(zeroths) == {"estimated"}:
        return f"it needs a zeroth moment, which cannot be estimated: {measured}"
    if product.name == "indirect" and len(sampling.multiples) < LEAST_TO_SEPARATE:
        return f"it needs {LEAST_TO_SEPARATE} frequencies, as one return is assumed: {measured}"
    return None

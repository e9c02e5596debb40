"""From captures to products: frames, what is computed of them, and their encodings."""

from transientcam_server.imaging.frame import Frame
from transientcam_server.imaging.history import History
from transientcam_server.imaging.pipeline import Pipeline
from transientcam_server.imaging.products import PRODUCTS, Product
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.imaging.workers import Workers

__all__ = [
    "PRODUCTS",
    "Frame",
    "History",
    "Pipeline",
    "Product",
    "Recipe",
    "Workers",
]

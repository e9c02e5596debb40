"""From captures to products: frames, what is computed of them, and their encodings."""

from transientcam_server.imaging._calibrations.board import Board
from transientcam_server.imaging._calibrations.diffuser import judge
from transientcam_server.imaging._calibrations.lens import (
    beam_of_wall,
    lens_of_walls,
    second_in_first,
)
from transientcam_server.imaging._calibrations.verdict import Verdict
from transientcam_server.imaging._encodings.compact import (
    encoding_name,
    stream_encoding,
    travelling,
)
from transientcam_server.imaging._encodings.encoding import (
    COLOUR_JPEG,
    COLOUR_PNG,
    ENCODINGS,
    MSGPACK,
    PNG,
    TIFF,
    Encoding,
)
from transientcam_server.imaging._errors_of_range.deviation import (
    MEDIAN_OF_NORMAL,
    typical_deviation,
)
from transientcam_server.imaging._errors_of_range.noise import contradictory_share
from transientcam_server.imaging._errors_of_range.ranging import ranges_m
from transientcam_server.imaging._frames.bands import BAND_BYTES, STREAMED_BYTES, banded, size_of
from transientcam_server.imaging._frames.frame import Frame
from transientcam_server.imaging._frames.history import History
from transientcam_server.imaging._frames.meta import frame_meta
from transientcam_server.imaging._frames.other_packages import OtherPackages
from transientcam_server.imaging._frames.pipeline import Pipeline
from transientcam_server.imaging._frames.stages import FIRST, Computed, compute
from transientcam_server.imaging._frames.workers import Workers
from transientcam_server.imaging._products.labelling import (
    Column,
    image_columns,
    in_words,
    moment_columns,
    parts_of,
)
from transientcam_server.imaging._products.pixel import pixel_csv, pixel_json
from transientcam_server.imaging._products.products import (
    PRODUCTS,
    Product,
    product_names,
    product_of,
)
from transientcam_server.imaging._products.requirements import absent_products, unmet
from transientcam_server.imaging._products.view import DEFAULT_BINS, WHOLE, Crop, View, evenly
from transientcam_server.imaging._recipe.calibration import (
    FACTORY_ID,
    NOMINAL_ID,
    Calibration,
    Gains,
    calibration_id,
    evaluate,
    factory_gains,
    load_calibration,
    nominal_gains,
)
from transientcam_server.imaging._recipe.lens import Intrinsics, known_intrinsics
from transientcam_server.imaging._recipe.moment_frame import OF_IMAGES, MomentFrame
from transientcam_server.imaging._recipe.recipe import (
    Recipe,
    SettingsVersion,
    listed,
    require_estimator,
    suited,
    unusable,
)
from transientcam_server.imaging._recipe.waveform import (
    SWEEP_ON_A_SCENE,
    SweepEvaluation,
    to_document,
    usable,
)

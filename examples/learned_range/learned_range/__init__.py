"""The estimator ``learned-range``: a small network, trained by train.py on simulated responses.

It sees four moments turned back by the phase of the first one, so that a delay of all light moves
its answer by that delay, and their noise. It answers with the phase of the first return, the
deviation of that, and the light of that return. The product ``learned-range-std`` is the deviation.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np

from transientcam_moments.comparisons import SparseEstimate, Technique
from transientcam_moments.plugins import MapProduct

NETWORK = Path(__file__).with_name("learned_range.onnx")
M = 4
ASSUMED_NOISE = 0.02
"""Over the first moment, where nobody knows it."""
RADIAN_M_HZ = 299_792_458.0 / (4 * math.pi)


def features(b, std):
    """Return what the network sees of moments b (5, P) with this deviation (P): (P, 7), float32."""
    size = np.abs(b[1])
    size = np.where(size > 0, size, 1)
    turned = b[2:] * np.exp(-1j * np.arange(2, M + 1)[:, None] * np.angle(b[1])) / size
    noise = np.log(np.clip(std / size, 1e-4, 1))
    return np.stack([*turned.real, *turned.imag, noise], axis=1).astype(np.float32)


@cache
def network():
    """Return the network as a function of `features`: earlier, log std and light (P, 3)."""
    import onnxruntime  # 100 ms that listing estimators need not wait for

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(NETWORK, options, providers=["CPUExecutionProvider"])
    return lambda x: session.run(None, {"x": x})[0]


def answers(b, noise):
    """Return phase and its deviation in rad, and light, each (...), of the first return."""
    planes = b[: M + 1].reshape(M + 1, -1)
    std = ASSUMED_NOISE * np.abs(planes[1])
    if noise is not None:
        variance = np.broadcast_to(noise.variance, b.shape)[1 : M + 1]
        std = np.sqrt(variance.reshape(M, -1).mean(axis=0))
    earlier, log_std, light = network()(features(planes, std)).T
    lit = np.abs(planes[1]) > 0
    phase = np.where(lit, np.remainder(np.angle(planes[1]) - earlier, 2 * np.pi), np.nan)
    found = phase, np.exp(log_std), np.abs(planes[1]) * np.exp(light)
    return tuple(each.reshape(b.shape[1:]) for each in found)


def learned_range(b, *, noise=None, frequencies_hz=None):
    """Estimate the first return; what else there is has no time."""
    phase, _, light = answers(b, noise)
    later = np.maximum(b[0].real - light, 0)
    return SparseEstimate(phase[None], light[None], np.where(np.isfinite(later), later, 0))


def learned_range_std(b, *, noise=None, frequencies_hz):
    """Return the deviation of the range in m, as the network states it."""
    return answers(b, noise)[1] * RADIAN_M_HZ / frequencies_hz[1]


STATED = {
    "assumptions": "Light like that of train.py: one to three sharp returns, or one and a tail.",
    "cost": "A network of 7, 48, 48 and 3 nodes.",
    "failure": "Light unlike that it was trained on: it is as sure as ever.",
}
ESTIMATOR = Technique(
    name="learned-range",
    label="a learned posterior",
    returns="1",
    frequencies="f .. 4 f",
    harmonics=lambda m: tuple(range(1, M + 1)),
    least_harmonics=M,
    estimate=learned_range,
    informed=True,
    **STATED,
)
DEVIATION = MapProduct(
    name="learned-range-std",
    unit="m",
    summary="standard deviation of learned-range, by its network",
    least_harmonics=M,
    consecutive=True,
    compute=learned_range_std,
    **STATED,
)

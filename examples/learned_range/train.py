"""Trains the network of learned_range on simulated responses, and calibrates its deviation.

``python train.py`` writes learned_range.onnx; it needs numpy and onnx, and some minutes.
"""

# ruff: noqa: T201 - an example prints what it finds

from itertools import pairwise

import numpy as np
import onnx
from learned_range import NETWORK, M, features
from onnx import TensorProto, helper, numpy_helper

NODES = (7, 48, 48, 3)
PIXELS, BATCH, EPOCHS, RATE = 60_000, 500, 80, 3e-3


def simulated(pixels, rng):
    """Return noisy moments (M + 1, pixels), their noise, and phase and light of first returns."""
    j = np.arange(M + 1)[:, None]
    first = rng.uniform(0, 2 * np.pi, pixels)
    light = np.ones(pixels)
    b = np.exp(1j * j * first)
    kind = rng.integers(0, 4, pixels)  # returns beside the first one: 0, 1, 2, or a tail
    for least in (1, 2):
        apart, weight = rng.uniform(0.1, 2.5, pixels), rng.uniform(0.05, 1.0, pixels)
        there = (kind >= least) & (kind < 3)
        b += np.where(there, weight * np.exp(1j * j * (first + apart)), 0)
        light += np.where(there, weight, 0)
    begins, decay = rng.uniform(0, 2.0, pixels), rng.uniform(0.1, 1.5, pixels)
    weight = rng.uniform(0.1, 2.0, pixels)
    tail = weight * np.exp(1j * j * (first + begins)) / (1 - 1j * j * decay)
    b += np.where(kind == 3, tail, 0)
    light += np.where(kind == 3, weight, 0)
    std = np.exp(rng.uniform(np.log(1e-3), np.log(0.05), pixels)) * light
    drawn = rng.normal(size=(2, *b.shape)) * std
    drawn[:, 0] = 0
    scale = rng.uniform(10, 1000, pixels)  # of the sensor
    return scale * (b + drawn[0] + 1j * drawn[1]), scale * std, first, scale


def wanted(b, first, light):
    """Return how much earlier than the first moment the first return is, and its light."""
    earlier = np.remainder(np.angle(b[1]) - first + np.pi, 2 * np.pi) - np.pi
    return earlier, np.log(light / np.abs(b[1]))


def forward(weights, x):
    """Return the activations of all layers."""
    layers = [x]
    for at in range(0, len(weights), 2):
        z = layers[-1] @ weights[at] + weights[at + 1]
        layers.append(z if at == len(weights) - 2 else np.tanh(z))
    return layers


def slopes(weights, x, target):
    """Return the derivatives of the negative log-likelihood of the targets (P, 2)."""
    layers = forward(weights, x)
    off, log_std = layers[-1][:, 0] - target[:, 0], np.clip(layers[-1][:, 1], -9, 2)
    ratio = off * np.exp(-2 * log_std)
    back = np.stack([ratio, 1 - off * ratio, layers[-1][:, 2] - target[:, 1]], axis=1) / len(x)
    back[:, :2] = np.clip(back[:, :2], -30 / len(x), 30 / len(x))  # a rare answer is no reason
    found = []
    for at in range(len(weights) - 2, -1, -2):
        found[:0] = [layers[at // 2].T @ back, back.sum(axis=0)]
        back = (back @ weights[at].T) * (1 - layers[at // 2] ** 2)
    return found


def trained(x, target, rng):
    """Return the weights that Adam finds, its rate falling to 0."""
    weights = []
    for many, few in pairwise(NODES):
        weights += [rng.normal(size=(many, few)) / np.sqrt(many), np.zeros(few)]
    mean, square = [np.zeros_like(w) for w in weights], [np.zeros_like(w) for w in weights]
    steps, step = EPOCHS * (len(x) // BATCH), 0
    while step < steps:
        for part in rng.permutation(len(x))[: len(x) // BATCH * BATCH].reshape(-1, BATCH):
            step += 1
            rate = RATE * np.sqrt(1 - 0.999**step) / (1 - 0.9**step) * (1 - step / (steps + 1))
            for w, m, v, slope in zip(
                weights, mean, square, slopes(weights, x[part], target[part]), strict=True
            ):
                m += 0.1 * (slope - m)
                v += 0.001 * (slope**2 - v)
                w -= rate * m / (np.sqrt(v) + 1e-9)
    return weights


def exported(weights):
    """Return the network as an ONNX model."""
    nodes, name = [], "x"
    for layer in range(len(weights) // 2):
        last = layer == len(weights) // 2 - 1
        out = "y" if last else f"z{layer}"
        nodes.append(helper.make_node("Gemm", [name, f"w{layer}", f"c{layer}"], [out]))
        if not last:
            nodes.append(helper.make_node("Tanh", [out], [name := f"h{layer}"]))
    tensors = [
        numpy_helper.from_array(each.astype(np.float32), f"{'wc'[at % 2]}{at // 2}")
        for at, each in enumerate(weights)
    ]
    ends = [
        helper.make_tensor_value_info(end, TensorProto.FLOAT, ["pixels", size])
        for end, size in (("x", NODES[0]), ("y", NODES[-1]))
    ]
    graph = helper.make_graph(nodes, "learned_range", ends[:1], ends[1:], tensors)
    opset = [helper.make_opsetid("", 17)]
    return helper.make_model(graph, opset_imports=opset, ir_version=8)


def main():
    """Train, calibrate on pixels that were not trained on, and write the network."""
    rng = np.random.default_rng(1)
    b, std, first, light = simulated(PIXELS, rng)
    weights = trained(features(b, std), np.stack(wanted(b, first, light), axis=1), rng)
    b, std, first, light = simulated(PIXELS // 4, rng)
    earlier, log_std, _ = forward(weights, features(b, std))[-1].T
    ratio = np.abs(earlier - wanted(b, first, light)[0]) / np.exp(log_std)
    factor = np.quantile(ratio, 0.6827)  # what makes 68 % of the errors less than the deviation
    weights[-1][1] += np.log(factor)
    onnx.save(exported(weights), NETWORK)
    print(f"{NETWORK.name}: deviation times {factor:.3f} by calibration")


if __name__ == "__main__":
    main()

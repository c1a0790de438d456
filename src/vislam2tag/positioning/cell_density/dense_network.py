"""A trained network of dense layers, as arrays: it answers without PyTorch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.cell_density.scan_kernels import directions
from vislam2tag.positioning.checked_arrays import CheckedArrays

INPUT_LENGTH = 5.0
"""Of a scan's vector, where its direction alone is looked at."""


@dataclass(frozen=True)
class DenseNetwork:
    """From levels of ``a`` access points to probabilities of ``c`` cells, which sum to 1."""

    weights: tuple[FloatArray, ...]
    """(inputs, outputs) of each layer."""
    biases: tuple[FloatArray, ...]
    """(outputs,) of each layer."""
    exponent: float
    """Power of levels; with 1 they are taken as they are, with others only their direction counts."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Return probabilities (n, c) for levels (n, a) from 0 to 1."""
        hidden = self.inputs(level, self.exponent)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            hidden = np.maximum(hidden @ weight + bias, 0.0)
        logit = hidden @ self.weights[-1] + self.biases[-1]
        share = np.exp(logit - logit.max(axis=1, keepdims=True))
        return np.asarray(share / share.sum(axis=1, keepdims=True))

    @staticmethod
    def inputs(level: FloatArray, exponent: float) -> FloatArray:
        """Make the first layer's inputs (n, a) of levels (n, a) from 0 to 1."""
        return level if exponent == 1.0 else INPUT_LENGTH * directions(level, exponent)


def network_arrays(networks: Sequence[DenseNetwork]) -> dict[str, AnyArray]:
    """Return all weights and biases, for saving."""
    arrays: dict[str, AnyArray] = {}
    for number, network in enumerate(networks):
        for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
            arrays |= {f"network_{number}_weight_{layer}": weight, f"network_{number}_bias_{layer}": bias}
    return arrays


def networks_restored(arrays: CheckedArrays, exponents: Sequence[float]) -> tuple[DenseNetwork, ...]:
    """Take back what :func:`network_arrays` gave, from ``a`` access points to ``c`` cells; one exponent a network.

    Raises ValueError where it does not fit.
    """
    networks = []
    for number, exponent in enumerate(exponents):
        count = arrays.count(f"network_{number}_weight_")
        ends = ["a", *(f"network {number}, layer {layer}" for layer in range(count - 1)), "c"][: count + 1]
        layers = [
            (
                arrays.floats(f"network_{number}_weight_{layer}", ends[layer], ends[layer + 1]),
                arrays.floats(f"network_{number}_bias_{layer}", ends[layer + 1]),
            )
            for layer in range(count)
        ]
        if not layers or not 0 < exponent < math.inf:
            raise ValueError(f"network {number} has no layers, or the exponent {exponent}")
        weights, biases = zip(*layers, strict=True)
        networks.append(DenseNetwork(weights, biases, exponent))
    return tuple(networks)

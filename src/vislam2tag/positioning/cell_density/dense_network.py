"""A trained network of dense layers, as arrays: it answers without PyTorch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.cell_density.scan_kernels import directions

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


def networks_restored(arrays: Mapping[str, AnyArray], exponents: Sequence[float]) -> tuple[DenseNetwork, ...]:
    """Take back what :func:`network_arrays` gave; one exponent for each network."""
    networks = []
    for number, exponent in enumerate(exponents):
        count = sum(name.startswith(f"network_{number}_weight_") for name in arrays)
        weights, biases = (
            tuple(arrays[f"network_{number}_{kind}_{layer}"] for layer in range(count)) for kind in ("weight", "bias")
        )
        networks.append(DenseNetwork(weights, biases, exponent))
    return tuple(networks)

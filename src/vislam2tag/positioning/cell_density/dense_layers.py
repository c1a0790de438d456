"""A trained network of dense layers, as arrays: it answers without PyTorch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.cell_density.scan_kernel import directions

LENGTH = 5.0
"""Of a scan's vector, where its direction alone is looked at."""


@dataclass(frozen=True)
class DenseLayers:
    """From levels to probabilities that sum to 1."""

    weights: tuple[FloatArray, ...]
    """(inputs, outputs) of each layer."""
    biases: tuple[FloatArray, ...]
    exponent: float
    """Power of levels; with 1 they are taken as they are, with others only their direction counts."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Return probabilities (n, c) for levels (n, a) from 0 to 1."""
        hidden = self.seen(level, self.exponent)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            hidden = np.maximum(hidden @ weight + bias, 0.0)
        logit = hidden @ self.weights[-1] + self.biases[-1]
        share = np.exp(logit - logit.max(axis=1, keepdims=True))
        return np.asarray(share / share.sum(axis=1, keepdims=True))

    @staticmethod
    def seen(level: FloatArray, exponent: float) -> FloatArray:
        """Make the first layer's inputs."""
        return level if exponent == 1.0 else LENGTH * directions(level, exponent)


def layer_arrays(networks: Sequence[DenseLayers]) -> dict[str, AnyArray]:
    """Return all weights and biases, for saving."""
    arrays: dict[str, AnyArray] = {}
    for number, network in enumerate(networks):
        for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
            arrays |= {f"network_{number}_weight_{layer}": weight, f"network_{number}_bias_{layer}": bias}
    return arrays


def layers_kept(arrays: Mapping[str, AnyArray], exponents: Sequence[float]) -> tuple[DenseLayers, ...]:
    """Take back what :func:`layer_arrays` gave."""
    networks = []
    for number, exponent in enumerate(exponents):
        count = sum(name.startswith(f"network_{number}_weight_") for name in arrays)
        weights, biases = (
            tuple(arrays[f"network_{number}_{part}_{layer}"] for layer in range(count)) for part in ("weight", "bias")
        )
        networks.append(DenseLayers(weights, biases, exponent))
    return tuple(networks)

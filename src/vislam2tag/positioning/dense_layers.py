"""A trained network of dense layers, as arrays: it answers without PyTorch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.scan_kernel import directions

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

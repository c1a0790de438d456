"""Draws that several modules need."""

from __future__ import annotations

import cmath
from typing import TypeVar

import numpy as np
from scipy.signal import lfilter

from vislam2tag.core.arrays import ComplexArray, FloatArray

Option = TypeVar("Option")


def one_of(rng: np.random.Generator, *options: Option) -> Option:
    """Draw one of the options."""
    return options[int(rng.integers(len(options)))]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number that is as likely in each octave."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def direction(rng: np.random.Generator) -> complex:
    """Draw a complex number of size 1."""
    return cmath.exp(1j * rng.uniform(-np.pi, np.pi))


def gross_error(rng: np.random.Generator, low_m: float = 0.3, high_m: float = 3.0) -> complex:
    """Draw an error far beyond the usual, metres."""
    return log_uniform(rng, low_m, high_m) * direction(rng)


def normal_plane(rng: np.random.Generator, count: int) -> ComplexArray:
    """Draw complex normal numbers (count,) with standard deviation 1 per axis."""
    return np.asarray(rng.standard_normal(count) + 1j * rng.standard_normal(count))


def wander(time_s: FloatArray, memory_s: float, rng: np.random.Generator) -> FloatArray:
    """Draw Gauss-Markov noise (n,) of standard deviation 1 at times (n,) that are nearly even."""
    keep = np.exp(-float(np.median(np.diff(time_s))) / memory_s)
    drive = np.sqrt(1 - keep**2) * rng.standard_normal(len(time_s))
    noise, _ = lfilter([1.0], [1.0, -keep], drive, zi=[keep * rng.standard_normal()])
    return np.asarray(noise)

"""Base class of positioning models: scikit-learn's interface, known access points, and the registry.

For removed models of version 0.2 it names replacements, for names, parameters and files.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator

from vislam2tag.common import plugins
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.plugins import Registry
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import AnyArray
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import LabelledScans, Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans

REMOVED: Mapping[str, str] = MappingProxyType(
    {
        "knn": "use weighted-knn",
        "probabilistic": "use weighted-knn",
        "extra-trees": "use weighted-knn",
        "combined": "train without --model, which chooses the best model",
        "cell-density-networks": "use cell-density",
    }
)
"""Replacements, by name."""
REMOVED_PARAMETERS: frozenset[tuple[str, str]] = frozenset({("cell-density", "networks")})
"""By model and parameter; an empty value in a file means the present model."""


def removed_model(name: str) -> str | None:
    """Return the message for a removed model, without a full stop at the end; None for any other name."""
    return f"the model {name} was removed; {REMOVED[name]}" if name in REMOVED else None


def removed_parameter(model: str, parameter: str) -> str | None:
    """Return the message for a removed parameter; None for any other."""
    if (model, parameter) not in REMOVED_PARAMETERS:
        return None
    return f"the parameter {parameter} of {model} was removed; use {model} without it"


def without_idle(model: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters that a file states, except removed ones that have no effect."""
    return {name: value for name, value in parameters.items() if value or (model, name) not in REMOVED_PARAMETERS}


NamedArrays = dict[str, AnyArray]


class Positioner(BaseEstimator):  # type: ignore[misc]  # scikit-learn has no types
    """A model from radio scans to places. ``__init__`` has the parameters, as scikit-learn requires.

    ``fit`` and ``predict`` here do what all models need. A model implements ``_fit``, ``_predict`` and, to be saved,
    ``arrays`` and ``restore``.
    """

    access_points_: tuple[str, ...]
    """Access points of the training set; all others are ignored."""
    storeys_: tuple[Storey, ...]
    progress: Progress[float] = staticmethod(silent)
    """Called during ``fit`` by slow models with the completed steps; not a parameter, and not copied."""

    def fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None = None) -> Self:
        """Learn from scans (n) and their places (n).

        ``validation`` is used for early stopping and calibration; without it the model draws a part of the training
        set. Raises DatasetError if there is nothing to learn from.
        """
        if len(scans) != len(places):
            raise ValueError(f"{len(scans)} scans and {len(places)} places")
        usable = (scans.heard > 0) & np.isfinite(places.xy).all(axis=1) & (places.storey >= 0)
        if not usable.any():
            raise DatasetError(
                "no fingerprint to learn from: none has both a label and a reading; check labelled_share and readings "
                "in "
                "fingerprints.parquet"
            )
        scans, places = scans[usable], places[usable]
        heard = np.bincount(scans.column, minlength=len(scans.access_points)) > 0
        self.access_points_ = tuple(name for name, known in zip(scans.access_points, heard, strict=True) if known)
        self.storeys_ = places.storeys
        if validation is not None:
            validation = validation[0].over(self.access_points_), validation[1]
        self._fit(scans.over(self.access_points_), places, validation)
        return self

    def predict(self, scans: RadioScans) -> Positions:
        """Estimate where scans were taken; scans without a known access point are unknown."""
        known = scans.over(self.access_points_)
        deaf = known.heard == 0
        alone = replace(known, session=np.where(deaf, "", known.session))  # empty scans must not affect their walk
        return self._predict(alone).without(deaf)

    def score(self, scans: RadioScans, places: ScanPlaces) -> float:
        """Return the mean error in the plane in metres, negated (scikit-learn: greater is better)."""
        error = np.hypot(*(self.predict(scans).xy - places.xy).T)
        return -float(np.nanmean(error))

    def remarks(self) -> Sequence[str]:
        """Return remarks about the training data for the user, one sentence each."""
        return ()

    def learned(self) -> LabelledScans | None:
        """Return the scans that the model stores, and their places; None if it stores none."""
        return None

    def torch_module(self) -> Any:
        """Return the fitted model as a PyTorch module with the outputs of :mod:`.networks.layers`; None without one."""
        return None

    @abstractmethod
    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        """Learn; the scans' columns are ``access_points_``, and every scan has a reading and a place."""

    @abstractmethod
    def _predict(self, scans: RadioScans) -> Positions:
        """Predict for scans over ``access_points_``; the result for empty scans is ignored."""

    @abstractmethod
    def arrays(self) -> NamedArrays:
        """Return everything learned besides access points and storeys, as named arrays."""

    @abstractmethod
    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Restore from the result of :meth:`arrays`; ``access_points_`` and ``storeys_`` are already set."""


GREATEST = 2**32 - 1
"""Upper limit of parameters and seeds."""
ModelFactory = Callable[..., Positioner]
MODELS: Registry[ModelFactory] = Registry(plugins.MODELS)
register = MODELS.add
model_names = MODELS.names


def model_named(name: str, **parameters: Any) -> Positioner:
    """Make a model of this name, not fitted; raises UsageError for an unknown or removed name, or a parameter."""
    if name not in model_names() and (removed := removed_model(name)):
        raise UsageError(removed)
    factory = MODELS.named(name)
    own = factory().get_params(deep=False)
    for parameter, value in parameters.items():
        if parameter not in own and (removed := removed_parameter(name, parameter)):
            raise UsageError(removed)
        if parameter not in own:
            raise UsageError(f"model {name} has no parameter '{parameter}'; it has: {', '.join(own)}")
        if not _alike(value, own[parameter]) or (parameter == "seed" and value < 0):
            raise UsageError(f"model {name}: {parameter}={value!r}: expected a value such as {own[parameter]!r}")
    return factory(**parameters)


def model_modules(name: str) -> tuple[str, str]:
    """Names of the modules in which a model is registered and implemented."""
    factory = MODELS.named(name)
    return factory.__module__, type(factory()).__module__


def _alike(value: Any, default: Any) -> bool:
    """Whether a value has the type of its default and is at most ``GREATEST``; whole numbers are valid as floats."""
    if default is None:
        return True
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(default, bool) and isinstance(value, bool)
    if isinstance(value, int | float) and not abs(value) <= GREATEST:
        return False
    if isinstance(default, float):
        return isinstance(value, int | float)
    if isinstance(default, list | tuple):
        return isinstance(value, list | tuple)
    return isinstance(value, type(default))

"""What every positioning model shares: scikit-learn's interface, the access points it knows, and its registry.

Of models of version 0.2 that were removed it says what to use instead: one message for names, parameters and files.
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
"""What to do instead, by name."""
REMOVED_PARAMETERS: frozenset[tuple[str, str]] = frozenset({("cell-density", "networks")})
"""By model and parameter; an empty value in a file means the model as it is now."""


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
    """A model from radio scans to places, with the parameters of ``__init__`` as scikit-learn wants them.

    ``fit`` and ``predict`` here do what all models need; a model implements ``_fit``, ``_predict`` and, to be saved,
    ``arrays`` and ``restore``.
    """

    access_points_: tuple[str, ...]
    """What was heard in training; nothing else is looked at."""
    storeys_: tuple[Storey, ...]
    progress: Progress[float] = staticmethod(silent)
    """Called during ``fit`` by models that take long, with the steps done; no parameter, and not copied."""

    def fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None = None) -> Self:
        """Learn from scans (n) and their places (n).

        ``validation`` is for early stopping and calibration; without it a model draws its own from the training data.
        Raises DatasetError if there is nothing to learn from.
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
        """Say where scans were taken; those that hear none of the known access points are unknown."""
        known = scans.over(self.access_points_)
        deaf = known.heard == 0
        alone = replace(known, session=np.where(deaf, "", known.session))  # deaf ones tell nothing of their walk
        return self._predict(alone).without(deaf)

    def score(self, scans: RadioScans, places: ScanPlaces) -> float:
        """Return the mean error in the plane in metres, negated (scikit-learn: greater is better)."""
        error = np.hypot(*(self.predict(scans).xy - places.xy).T)
        return -float(np.nanmean(error))

    def remarks(self) -> Sequence[str]:
        """Return what someone who trained the model should know of its training data, a sentence each."""
        return ()

    def learned(self) -> LabelledScans | None:
        """Return the scans that the model keeps, and where they were taken; None if it keeps none."""
        return None

    def torch_module(self) -> Any:
        """Return the fitted model as a PyTorch module with the outputs of :mod:`.networks.layers`; None without one."""
        return None

    @abstractmethod
    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        """Learn; the scans' columns are ``access_points_``, every scan hears one of them and has a place."""

    @abstractmethod
    def _predict(self, scans: RadioScans) -> Positions:
        """Predict for scans over ``access_points_``; those that hear nothing may get anything."""

    @abstractmethod
    def arrays(self) -> NamedArrays:
        """Return everything learned besides access points and storeys, as named arrays."""

    @abstractmethod
    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave; ``access_points_`` and ``storeys_`` are set already."""


GREATEST = 2**32 - 1
"""No parameter is greater; seeds go so far."""
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
    """Names of the modules that a model is made in and is written in."""
    factory = MODELS.named(name)
    return factory.__module__, type(factory()).__module__


def _alike(value: Any, default: Any) -> bool:
    """Whether a value is of its default's kind, and no number beyond ``GREATEST``; a whole one will do for any."""
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

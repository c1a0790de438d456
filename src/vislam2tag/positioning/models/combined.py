"""Several models asked together: the storey that they find likeliest on average, and the mean of their places on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.registry import NamedArrays, Positioner, model_named, register
from vislam2tag.positioning.scans.places import LabelledScans, Positions, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans

NAME = "combined"


class Combined(Positioner):
    """The mean of models; radii are the mean of theirs."""

    parts_: tuple[Positioner, ...]

    def __init__(
        self,
        *,
        models: Sequence[str] = ("local-kriging", "weighted-knn"),
        settings: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        """Take the names of the models, and the settings of each that are not its defaults."""
        self.models = models
        self.settings = settings

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        self.parts_ = self._made()
        for number, part in enumerate(self.parts_):
            part.fit(scans, places, validation)
            self.progress(number + 1, len(self.parts_))

    def _made(self) -> tuple[Positioner, ...]:
        if not self.models or NAME in self.models:
            raise UsageError(f"models={self.models}: name at least one, and none that is combined itself")
        missing = len(self.models) - len(self.settings)
        if missing < 0:
            raise UsageError(f"settings={self.settings}: give at most one for each of models={self.models}")
        settings = (*self.settings, *({},) * missing)
        return tuple(model_named(str(name), **own) for name, own in zip(self.models, settings, strict=True))

    def _predict(self, scans: RadioScans) -> Positions:
        return mean_positions([part.predict(scans) for part in self.parts_])

    def stated_params(self) -> dict[str, Any]:
        """Return all settings of the parts."""
        return {**self.get_params(), "settings": [part.stated_params() for part in self.parts_]}

    def remarks(self) -> Sequence[str]:
        """Say what the parts say."""
        return [remark for part in self.parts_ for remark in part.remarks()]

    def learned(self) -> LabelledScans | None:
        """Return what one of the parts keeps."""
        return next((kept for part in self.parts_ if (kept := part.learned()) is not None), None)

    def arrays(self) -> NamedArrays:
        """Return what the parts learned, each under its number."""
        return {
            f"{number}.{name}": array
            for number, part in enumerate(self.parts_)
            for name, array in part.arrays().items()
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave."""
        self.parts_ = self._made()
        for number, part in enumerate(self.parts_):
            start = f"{number}."
            part.access_points_, part.storeys_ = self.access_points_, self.storeys_
            own = {name.removeprefix(start): array for name, array in arrays.items() if name.startswith(start)}
            part.restore(own)


def mean_positions(found: Sequence[Positions]) -> Positions:
    """Return the mean of answers of several models to the same scans (n); what none of them knows stays unknown.

    Unlike all that was learned is what one of them calls so.
    """
    told = [one.unlike for one in found if one.unlike is not None]
    probability = np.mean([one.storey_probability for one in found], axis=0)
    known = found[0].known
    storey = np.where(known, np.nan_to_num(probability).argmax(axis=1), -1)
    on = np.array([one.storey == storey for one in found], dtype=np.float64)
    share = np.where(on.sum(axis=0) > 0, on, 1.0)
    share /= share.sum(axis=0)

    def mean(values: Sequence[FloatArray]) -> FloatArray:
        return np.asarray(sum(one * own for one, own in zip(share, values, strict=True)))

    return Positions(
        storeys=found[0].storeys,
        storey=storey,
        xy=np.column_stack([mean([one.xy[:, axis] for one in found]) for axis in (0, 1)]),
        z=mean([one.z for one in found]),
        storey_probability=probability,
        radius_68_m=mean([one.radius_68_m for one in found]),
        radius_95_m=mean([one.radius_95_m for one in found]),
        unlike=np.any(told, axis=0) if told else None,
    )


register(NAME, Combined)

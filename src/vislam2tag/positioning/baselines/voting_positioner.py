"""The model that all baselines are whose training scans vote: how it is calibrated, asked and saved."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.baselines.votes import VotedPositions
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.error_radii import SpreadRadii, fitted_radii
from vislam2tag.positioning.registry import NamedArrays, Positioner
from vislam2tag.positioning.scans.held_out import usable_validation
from vislam2tag.positioning.scans.places import LabelledScans, Positions, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans


class VotingPositioner(Positioner):
    """Learned places vote; radii follow how far the votes lie apart, fitted to the errors of scans that are held out.

    A model implements ``_check``, ``_learn``, ``_left_out`` and ``_answer``. It is saved as the scans it learned, of
    which it is made again; one that is not so quickly made overrides ``arrays`` and ``restore``.
    """

    radii_: SpreadRadii
    _scans: RadioScans
    _places: ScanPlaces

    @abstractmethod
    def _check(self) -> None:
        """Raise UsageError for parameters that cannot be."""

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        """Learn all but the radii; a model adds to it what it asks."""
        self._scans, self._places = scans, places

    @abstractmethod
    def _left_out(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        """Return errors and spreads of learned scans (some or all) as if their walks had not been learned, metres."""

    def _asked(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        """Return errors and spreads of scans that were not learned, metres."""
        answer = self._answer(scans)
        return places.distance_m(answer.xy), answer.spread_m

    @abstractmethod
    def _answer(self, scans: RadioScans) -> VotedPositions:
        """Let the learned places vote for where scans were taken."""

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        self._check()
        self._learn(scans, places)
        held_out = usable_validation(validation)
        if held_out is None:
            error_m, spread_m = self._left_out(scans, places)
        else:
            error_m, spread_m = self._asked(*held_out)
        self.radii_ = fitted_radii(error_m, spread_m)
        self.progress(1, 1)

    def _predict(self, scans: RadioScans) -> Positions:
        answer = self._answer(scans)
        return answer.positions(self._places, self.radii_.radii_m(answer.spread_m))

    def arrays(self) -> NamedArrays:
        """Return the scans learned, their places, and the radii."""
        return {**self._scans.arrays(), **self._places.arrays(), "radii": self.radii_.array()}

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave."""
        self._check()
        checked = CheckedArrays(arrays)
        scans = RadioScans.restored(checked, self.access_points_)
        self._learn(scans, ScanPlaces.restored(checked, self.storeys_))
        self.radii_ = SpreadRadii.restored(checked, "radii")

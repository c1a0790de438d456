"""Probabilistic fingerprinting: the cell whose level maps explain a scan best (Horus, Youssef and Agrawala 2005).

A phone that hears everything louder or fainter by an unknown offset is allowed for: the offset is integrated out.
"""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_limits

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.baselines.level_maps import LevelMaps, level_maps
from vislam2tag.positioning.baselines.votes import VotedPositions, Votes, counted_votes, joined_answers
from vislam2tag.positioning.baselines.voting_positioner import VotingPositioner
from vislam2tag.positioning.registry import register
from vislam2tag.positioning.scans.held_out import calibration_rows, folds, walk_numbers
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans

FOLDS = 5
"""Maps that are made without some walks to calibrate the radii, where no validation part is given."""
_SEED = 0
"""Of dealing walks to folds."""
_MOST_CELLS = 200
"""Cells that vote for a scan, the likeliest."""
_LIKELIHOODS_AT_ONCE = 4_000_000


class Probabilistic(VotingPositioner):
    """Cells vote with their likelihood; radii follow how far the likely cells lie apart."""

    def __init__(
        self,
        *,
        cell_m: float = 3.0,
        smoothing_m: float = 4.0,
        prior_scans: float = 0.1,
        noise_db: float = 6.0,
        offset_db: float = 4.0,
        sharpness: float = 0.3,
    ) -> None:
        """Take the cells' side, how far scans inform them, and how levels vary within a scan and from phone to phone.

        ``prior_scans``: see :func:`level_maps`. ``sharpness``: exponent of the likelihood, as access points do not
        vary independently of each other. The defaults are best in cross-validation over walks on training parts
        (docs/results/positioning-settings.md).
        """
        self.cell_m = cell_m
        self.smoothing_m = smoothing_m
        self.prior_scans = prior_scans
        self.noise_db = noise_db
        self.offset_db = offset_db
        self.sharpness = sharpness

    def _check(self) -> None:
        for name, value in self.get_params().items():
            if value <= 0:
                raise UsageError(f"{name}={value}: must be above 0")

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        super()._learn(scans, places)
        self._maps = self._maps_of(scans, places)

    def _maps_of(self, scans: RadioScans, places: ScanPlaces) -> LevelMaps:
        with threadpool_limits(limits=1):  # more threads would add in another order
            return level_maps(scans, places, self.cell_m, self.smoothing_m, self.prior_scans)

    def _left_out(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        error_m, spread_m = np.full(len(scans), np.nan), np.zeros(len(scans))
        calibrates = np.isin(np.arange(len(scans)), calibration_rows(len(scans)))
        for number, (learned, held_out) in enumerate(folds(walk_numbers(scans, places), FOLDS, _SEED)):
            asked = held_out & calibrates
            answer = self._voted(self._maps_of(scans[learned], places[learned]), scans[asked])
            error_m[asked], spread_m[asked] = places[asked].distance_m(answer.xy), answer.spread_m
            self.progress(number + 1, FOLDS)
        return error_m, spread_m

    def _answer(self, scans: RadioScans) -> VotedPositions:
        return self._voted(self._maps, scans)

    def _voted(self, maps: LevelMaps, scans: RadioScans) -> VotedPositions:
        """Let the cells of maps vote, block by block."""
        size = max(1, _LIKELIHOODS_AT_ONCE // len(maps.cells))
        with threadpool_limits(limits=1):
            blocks = (scans[start : start + size] for start in range(0, max(len(scans), 1), size))
            return joined_answers(
                [counted_votes(self._votes(self._log_likelihood(maps, block)), maps.cells) for block in blocks]
            )

    def _log_likelihood(self, maps: LevelMaps, scans: RadioScans) -> FloatArray:
        """(n, c) log-likelihood of each cell, but for a constant of each scan.

        With m access points heard, r their residuals, s the noise and o the offset's deviation: the residuals'
        covariance is s² I + o² 1 1', whose inverse is (I - 1 1' o² / (s² + m o²)) / s² (Sherman and Morrison).
        """
        level = scans.dense()
        heard = np.isfinite(level).astype(np.float64)
        level = np.nan_to_num(level)
        missed = np.log1p(-maps.heard)
        who = heard @ (np.log(maps.heard) - missed).T + missed.sum(axis=1)
        total = level.sum(axis=1)[:, None] - heard @ maps.level_dbm.T
        squares = (level**2).sum(axis=1)[:, None] - 2 * level @ maps.level_dbm.T + heard @ (maps.level_dbm**2).T
        noise, offset = self.noise_db**2, self.offset_db**2
        shared = offset / (noise + offset * heard.sum(axis=1)[:, None])
        return np.asarray(who - (squares - shared * total**2) / (2 * noise))

    def _votes(self, log_likelihood: FloatArray) -> Votes:
        """Let the likeliest cells vote, by log-likelihoods (n, c)."""
        most = min(_MOST_CELLS, log_likelihood.shape[1])
        likely = np.argpartition(-log_likelihood, most - 1, axis=1)[:, :most]
        log = self.sharpness * np.take_along_axis(log_likelihood, likely, axis=1)
        return Votes(likely, np.exp(log - log.max(axis=1, keepdims=True)))


register("probabilistic", Probabilistic)

"""Levels in another form than dBm are recognised by all levels of a file, and become dBm by two points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import polars as pl
import pytest

from vislam2tag.intake.level_scales import (
    GROWING,
    NORMALISED,
    WITHOUT_SIGN,
    LevelScale,
    OtherLevels,
    other_levels,
)


def measured(seed: int, count: int = 200) -> np.ndarray:
    """Levels of a walk, dBm: weak ones are frequent, as in public data sets."""
    rng = np.random.default_rng(seed)
    return np.round(np.clip(-88 + rng.gamma(1.6, 8.0, count), -97, -30))


FORMS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], OtherLevels, LevelScale]] = {
    "without sign": (lambda dbm: -dbm, WITHOUT_SIGN, LevelScale((1, -1), (100, -100))),
    "percent": (lambda dbm: np.clip(2 * (dbm + 100), 0, 100), GROWING, LevelScale((0, -100), (100, -50))),
    "from -105 dBm": (lambda dbm: dbm + 105, GROWING, LevelScale((0, -105), (105, 0))),
    "0 to 1": (lambda dbm: (dbm + 104) / 104, NORMALISED, LevelScale((0, -104), (1, 0))),
    "-1 to 0": (lambda dbm: dbm / 100, NORMALISED, LevelScale((-1, -100), (0, 0))),
}


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("filler", [None, 0.0, 100.0])
def test_every_form_is_recognised_and_becomes_dbm(name: str, filler: float | None) -> None:
    form, expected, scale = FORMS[name]
    for seed in range(20):
        dbm = measured(seed)
        numbers = pl.Series(form(dbm))
        unheard = pl.Series([] if filler is None else [filler] * 900, dtype=pl.Float64)
        assert other_levels(pl.concat([numbers, unheard])) is expected
        heard = dbm <= -50  # stronger ones are 100 %, too
        back = pl.select(scale.dbm(pl.lit(numbers))).to_series().to_numpy()
        assert back[heard] == pytest.approx(dbm[heard])
        assert scale.number(back[0]) == pytest.approx(numbers[0])


def test_levels_in_dbm_are_in_no_other_form() -> None:
    for seed in range(20):
        dbm = pl.Series(measured(seed))
        some = pl.Series([127.0, 65.0, 0.5, 0.0, 100.0] * 10)
        assert other_levels(dbm) is None
        assert other_levels(pl.concat([dbm, some])) is None
        assert other_levels(some, of=200) is None
    assert other_levels(pl.Series([], dtype=pl.Float64)) is None
    assert other_levels(pl.Series([-60.0, float("nan"), float("inf")])) is None


def test_a_finding_and_a_question_name_the_conversion() -> None:
    finding = GROWING.finding("wifi.csv", 9, list(range(2, 11)), "these rows are kept without their level")
    assert (finding.kind, finding.count, finding.lines) == ("levels_not_dbm", 9, (2, 3, 4, 5, 6))
    assert "percent / 2 - 100" in finding.message
    assert WITHOUT_SIGN.question.endswith("Negate the levels, or pass --levels 1=-1,100=-100")

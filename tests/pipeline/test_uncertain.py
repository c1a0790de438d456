"""What a strategy knows of its own uncertainty, through a whole run."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from tests.unsure import unsure_registered
from vislam2tag.pipeline.run import Selection, process
from vislam2tag.settings import LabelSettings, Settings

LIMIT_M = 0.5


@pytest.fixture(scope="module")
def runs(clean_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[float, Path]:
    """Output folders by limit of uncertainty."""
    folder = tmp_path_factory.mktemp("unsure")
    outs = {LIMIT_M: folder / "limited", float("inf"): folder / "unlimited"}
    with unsure_registered():
        for limit, out in outs.items():
            settings = Settings(strategy="unsure", labels=LabelSettings(max_sigma_m=limit))
            process(clean_survey, out, settings, selection=Selection(floors=(0,)))
    return outs


@pytest.mark.parametrize("table", ["trajectory", "wifi", "sensors"])
def test_rows_above_the_limit_are_uncertain_and_lose_nothing(runs: dict[float, Path], table: str) -> None:
    limited, unlimited = (pl.read_parquet(out / table / "*.parquet") for out in runs.values())
    assert limited.drop("status").equals(unlimited.drop("status"))
    assert "uncertain" not in unlimited["status"]
    above = (unlimited["status"] == "ok") & (unlimited["sigma"] > LIMIT_M)
    assert 0.1 < (above.sum() / len(above)) < 0.9
    expected = unlimited.select(pl.when(above).then(pl.lit("uncertain")).otherwise("status").alias("status"))
    assert limited.select("status").equals(expected)

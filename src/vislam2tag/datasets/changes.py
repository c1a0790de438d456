"""What changed in a building between two surveys: access points and places, tested against the surveys' own noise.

At each place that both surveys walked, each access point's mean signal strength (:mod:`.place_sums`) is compared. The
variance of a difference follows from the spread of a survey's walks at a place, pooled by strength. Mean squares of
standardised differences, over an access point's places or a place's access points, become normal scores (Wilson and
Hilferty 1931). Their median and spread are, within bounds, the null (the empirical null of Efron 2004): most of a
building is unchanged, and the way a phone was held moves all scores a little. Scores beyond the null are changes, with
a share of false discoveries of at most FALSE_SHARE (Benjamini and Hochberg 1995).

Access points are tested first. Places are then tested without changed access points, and also count as changed if one
of those did. A joined set contains the result as a summary (JSON) and as tables of access points and places (CSV).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import polars as pl
from scipy.stats import false_discovery_control, norm

from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.place_sums import PLACE, SURVEYS, PlaceSums, place_sums
from vislam2tag.datasets.settings import CHANGE_CELL_M
from vislam2tag.datasets.technologies import parts_of

FALSE_SHARE = 0.05
LEAST_PLACES = 3
"""Common places that an access point needs for a test."""
LEAST_CHANGE_DB = 3.0
"""Smallest reported root mean square change over an access point's places, or a place's access points: about the effect
of a phone's orientation."""
SURE = 3.0
"""Standard deviations from which a changed access point also changes a place."""
GONE_SHARE = 0.05
"""An access point is gone if less than this share of its strength remains."""
NOTABLE_DB = 10.0
"""Mean strength from which a changed access point makes a place outdated that was not walked again."""
MOST_NOISE, MOST_SPREAD = 4.0, 3.0
"""Bounds of the null, as variance and as spread of scores; anything beyond is a change."""
_BIN_DB = 5.0
_PRIOR, _PRIOR_VARIANCE_DB2 = 20.0, 9.0
"""Degrees of freedom of the prior, and its initial variance."""
_MAD_TO_SIGMA = 1.4826

UNCHANGED, CHANGED = "unchanged", "changed"
APPEARED, VANISHED, MOVED, LOUDER, FAINTER = "appeared", "vanished", "moved", "louder", "fainter"
MOBILE, NOT_COMPARED = "mobile", "not compared"
NEW, OUTDATED, NOT_WALKED = "new", "outdated", "not walked again"


@dataclass(frozen=True)
class Changes:
    """Changes of one technology."""

    technology: str
    cell_m: float
    offsets_db: Mapping[tuple[str, str], float]
    """Offset of each survey and device."""
    access_points: pl.DataFrame
    """bssid, ssid; the place of the strongest reading in each survey (base_floor, base_x, base_y, later_floor, later_x,
    later_y); change, places (compared), score, difference_db (mean, later - base)."""
    places: pl.DataFrame
    """building, floor, base, later (scans), x, y (centre), change, score, size_db (root mean square change over its
    access points), because (changed access points heard there)."""


def survey_changes(base: Dataset, later: Dataset, technology: str, cell_m: float = CHANGE_CELL_M) -> Changes:
    """Compare two surveys of a building; unlabelled data and mobile hotspots are ignored."""
    sums = place_sums({"base": base, "later": later}, technology, cell_m)
    names = _names(base, later, technology)
    mobile = names.filter("mobile")["bssid"].implode()
    pairs = _differences(sums.heard.filter(~pl.col("bssid").is_in(mobile)), sums.places)
    points = _judged_points(pairs)
    changed = points.filter(pl.col("change") != UNCHANGED)["bssid"].implode()
    judged = _judged_places(pairs, pl.col("bssid").is_in(changed))
    return Changes(
        technology,
        cell_m,
        sums.offsets_db,
        _access_points(names, points, sums, cell_m),
        _places(judged, sums, changed, cell_m),
    )


def _names(base: Dataset, later: Dataset, technology: str) -> pl.DataFrame:
    columns = ("bssid", "technology", "ssid", "mobile")
    both = pl.concat([dataset.access_points.select(columns) for dataset in (base, later)]).collect()
    return (
        both.filter(pl.col("technology").is_in((technology, *parts_of(technology))))
        .group_by("bssid")
        .agg(pl.col("ssid").drop_nulls().last(), pl.col("mobile").fill_null(False).any())
        .sort("bssid")
    )


def _differences(heard: pl.DataFrame, places: pl.DataFrame) -> pl.DataFrame:
    """Compare each access point at each common place where either survey heard it.

    Adds mean_base, mean_later (strength, dB), difference (dB), its variance (dB^2) and z (standard deviations).
    """
    common = places.filter((pl.col("walks_base") > 0) & (pl.col("walks_later") > 0))
    pairs = heard.join(common, on=PLACE).with_columns(
        mean_base=pl.col("sum_base") / pl.col("walks_base"), mean_later=pl.col("sum_later") / pl.col("walks_later")
    )
    walks = pl.col("walks_base") + pl.col("walks_later")
    pairs = pairs.with_columns(
        difference=pl.col("mean_later") - pl.col("mean_base"),
        level=(pl.col("sum_base") + pl.col("sum_later")) / walks,
        between=sum(pl.col(f"squares_{s}") - pl.col(f"walks_{s}") * pl.col(f"mean_{s}") ** 2 for s in SURVEYS),
        within=pl.sum_horizontal(f"within_{s}" for s in SURVEYS),
        freedom_between=walks - 2,
        freedom_within=pl.col("scans_base") + pl.col("scans_later") - walks,
    )
    variance = _variance(pairs) * (1 / pairs["walks_base"] + 1 / pairs["walks_later"]).to_numpy()
    return pairs.with_columns(z=pairs["difference"] / np.sqrt(variance), variance=variance)


def _variance(pairs: pl.DataFrame) -> FloatArray:
    """Variance (p,) (dB^2) of a walk's mean strength at the levels of p pairs, between walks, pooled in bins.

    With few walks it is shrunk towards the variance of scans within walks, and that towards the bin below.
    """
    place = (pairs["level"] // _BIN_DB).cast(pl.Int64).to_numpy()
    sums = {
        name: np.bincount(place, weights=pairs[name].to_numpy())
        for name in ("between", "freedom_between", "within", "freedom_within")
    }
    variance, prior = np.empty(int(place.max(initial=-1)) + 1), _PRIOR_VARIANCE_DB2
    for number in range(len(variance)):
        prior = (sums["within"][number] + _PRIOR * prior) / (sums["freedom_within"][number] + _PRIOR)
        variance[number] = (sums["between"][number] + _PRIOR * prior) / (sums["freedom_between"][number] + _PRIOR)
    return np.asarray(variance[place], dtype=np.float64)


def _scores(squares: FloatArray, count: FloatArray) -> FloatArray:
    """Normal scores (k,) of mean squares of ``count`` standard normal differences, without their common shift."""
    noise = np.clip(np.median(squares), 1.0, MOST_NOISE)
    spread = 2 / (9 * count)
    score = (np.cbrt(squares / noise) - (1 - spread)) / np.sqrt(spread)
    scale = np.clip(_MAD_TO_SIGMA * np.median(np.abs(score - np.median(score))), 1.0, MOST_SPREAD)
    return np.asarray(score / scale, dtype=np.float64)


def _found(scores: FloatArray) -> BoolArray:
    """Return a mask (k,) of scores that are too large, with a share of false discoveries of at most FALSE_SHARE."""
    return np.asarray(false_discovery_control(norm.sf(scores)) <= FALSE_SHARE, dtype=np.bool_)


def _judged_points(pairs: pl.DataFrame) -> pl.DataFrame:
    """Test each access point with enough places: bssid, places, score, difference_db, change."""
    table = (
        pairs.group_by("bssid")
        .agg(
            places=pl.len(),
            squares=(pl.col("z") ** 2).mean(),
            size_db=_size_db(),
            shifted=_squares_without_shift(),
            difference_db=pl.col("difference").mean(),
            loud_base=pl.col("mean_base").sum(),
            loud_later=pl.col("mean_later").sum(),
        )
        .filter(pl.col("places") >= LEAST_PLACES)
        .sort("bssid")
    )
    if table.is_empty():
        return table.with_columns(score=pl.lit(0.0), change=pl.lit(UNCHANGED))
    score = _scores(table["squares"].to_numpy(), table["places"].to_numpy().astype(np.float64))
    found = pl.lit(pl.Series(_found(score))) & (pl.col("size_db") >= LEAST_CHANGE_DB)
    return table.with_columns(score=score, change=pl.when(found).then(_kind_of_change()).otherwise(pl.lit(UNCHANGED)))


def _size_db() -> pl.Expr:
    """Root mean square change, dB: the part of the differences beyond their variance."""
    return (pl.col("difference") ** 2 - pl.col("variance")).mean().clip(0.0).sqrt()


def _squares_without_shift() -> pl.Expr:
    """Share of the squared differences, at places where both surveys heard it, that no change of power explains."""
    both = (pl.col("mean_base") > _BIN_DB) & (pl.col("mean_later") > _BIN_DB)
    difference = pl.col("difference").filter(both)
    left = (difference - difference.median()) ** 2
    return left.sum() / (difference**2).sum()


def _kind_of_change() -> pl.Expr:
    """Name a change: gone, new, other power (which explains at least half of the squared differences), else moved."""
    base, later = pl.col("loud_base"), pl.col("loud_later")
    power = pl.when(pl.col("difference_db") > 0).then(pl.lit(LOUDER)).otherwise(pl.lit(FAINTER))
    return (
        pl.when(later < GONE_SHARE * base)
        .then(pl.lit(VANISHED))
        .when(base < GONE_SHARE * later)
        .then(pl.lit(APPEARED))
        .when(pl.col("shifted") < 0.5)
        .then(power)
        .otherwise(pl.lit(MOVED))
    )


def _judged_places(pairs: pl.DataFrame, changed: pl.Expr) -> pl.DataFrame:
    """Test each common place: PLACE, score, size_db (over all its access points), because, change."""
    sure = changed & (pl.col("z").abs() >= SURE) & (pl.col("difference").abs() >= LEAST_CHANGE_DB)
    others = pairs.filter(~changed).group_by(PLACE).agg(squares=(pl.col("z") ** 2).mean(), count=pl.len()).sort(PLACE)
    if len(others):
        score = _scores(others["squares"].to_numpy(), others["count"].to_numpy().astype(np.float64))
        others = others.with_columns(score=score, found=_found(score))
    else:
        others = others.with_columns(score=pl.lit(0.0), found=pl.lit(False))
    table = pairs.group_by(PLACE).agg(size_db=_size_db(), because=pl.col("bssid").filter(sure).sort())
    found = (pl.col("because").list.len() > 0) | pl.col("found").fill_null(False)
    return table.join(others, on=PLACE, how="left").with_columns(
        change=pl.when(found & (pl.col("size_db") >= LEAST_CHANGE_DB))
        .then(pl.lit(CHANGED))
        .otherwise(pl.lit(UNCHANGED))
    )


def _access_points(names: pl.DataFrame, points: pl.DataFrame, sums: PlaceSums, cell_m: float) -> pl.DataFrame:
    """All access points of both surveys, including those that could not be compared."""
    table = names.join(points, on="bssid", how="left")
    for survey in SURVEYS:
        table = table.join(_loudest(sums, survey, cell_m), on="bssid", how="left")
    change = pl.when("mobile").then(pl.lit(MOBILE)).otherwise(pl.col("change").fill_null(NOT_COMPARED))
    where = [f"{survey}_{what}" for survey in SURVEYS for what in ("floor", "x", "y")]
    return table.select(
        "bssid",
        "ssid",
        *where,
        change=change,
        places=pl.col("places").fill_null(0).cast(pl.Int32),
        score=pl.col("score").round(2),
        difference_db=pl.col("difference_db").round(2),
    ).sort("bssid")


def _loudest(sums: PlaceSums, survey: str, cell_m: float) -> pl.DataFrame:
    """The place with the greatest mean of each access point in one survey."""
    heard = sums.heard.filter(pl.col(f"heard_{survey}") > 0).join(sums.places, on=PLACE)
    mean = (pl.col(f"sum_{survey}") / pl.col(f"walks_{survey}")).round(6)
    loudest = heard.sort(mean, *PLACE, descending=[True, *(False for _ in PLACE)]).group_by(
        "bssid", maintain_order=True
    )
    x, y = _centre(cell_m)
    return loudest.first().select(
        "bssid", pl.col("floor").alias(f"{survey}_floor"), x.alias(f"{survey}_x"), y.alias(f"{survey}_y")
    )


def _centre(cell_m: float) -> tuple[pl.Expr, pl.Expr]:
    return (pl.col("column") + 0.5) * cell_m, (pl.col("row") + 0.5) * cell_m


def _places(judged: pl.DataFrame, sums: PlaceSums, changed: pl.Series, cell_m: float) -> pl.DataFrame:
    """All places of both surveys; those in the base only are outdated if a changed access point was there."""
    lost = sums.heard.filter(pl.col("bssid").is_in(changed)).join(
        sums.places.filter(pl.col("walks_later") == 0), on=PLACE
    )
    outdated = (
        lost.filter(pl.col("sum_base") / pl.col("walks_base") >= NOTABLE_DB)
        .group_by(PLACE)
        .agg(was=pl.col("bssid").sort())
    )
    x, y = _centre(cell_m)
    table = sums.places.join(judged, on=PLACE, how="left").join(outdated, on=PLACE, how="left").sort(PLACE)
    change = (
        pl.when(pl.col("walks_base") == 0)
        .then(pl.lit(NEW))
        .when(pl.col("was").is_not_null())
        .then(pl.lit(OUTDATED))
        .when(pl.col("walks_later") == 0)
        .then(pl.lit(NOT_WALKED))
        .otherwise(pl.col("change").fill_null(UNCHANGED))
    )
    return table.select(
        "building",
        "floor",
        base=pl.col("scans_base"),
        later=pl.col("scans_later"),
        x=x,
        y=y,
        change=change,
        score=pl.col("score").round(2),
        size_db=pl.col("size_db").round(2),
        because=pl.coalesce("was", "because").fill_null([]),
    )


RECORD = "changes.json"
MOST_CHANGED: FindingKind = "most_changed"
NOTHING_COMPARED: FindingKind = "nothing_compared"
CHANGED_POINTS = (APPEARED, VANISHED, MOVED, LOUDER, FAINTER)


class SurveyDeviceOffset(Record):
    """How much stronger a phone's readings are than the mean of all phones, dB."""

    survey: str
    """``base`` or ``later``."""
    device: str
    offset_db: float


class ChangedPoint(Record):
    """An access point that changed. Places are centres of cells, BCS metres."""

    bssid: str
    ssid: str | None
    change: str
    difference_db: float
    """Mean over its common places, later - base, dB."""
    base_floor: int | None
    base_x: float | None
    base_y: float | None
    """Place of its strongest reading in the base."""
    later_floor: int | None
    later_x: float | None
    later_y: float | None


class TechnologyChanges(Record):
    """Changes of one technology."""

    technology: str
    cell_m: float
    offsets: tuple[SurveyDeviceOffset, ...]
    access_points: dict[str, int]
    """Number of access points by kind of change."""
    places: dict[str, int]
    changed: tuple[ChangedPoint, ...]


class SurveyChanges(Result):
    """Changes between a data set and a later survey of the same building."""

    main_table: ClassVar[str] = "technologies"

    base: str
    later: str
    technologies: tuple[TechnologyChanges, ...]
    findings: tuple[Finding, ...] = ()


def survey_record(base: str, later: str, changes: Sequence[Changes]) -> SurveyChanges:
    """Summarise the changes between the data sets of these names."""
    technologies = tuple(_record(one) for one in changes)
    findings = tuple(finding for one in technologies for finding in _findings(one))
    return SurveyChanges(base=base, later=later, technologies=technologies, findings=findings)


def _findings(one: TechnologyChanges) -> tuple[Finding, ...]:
    """Report that almost everything changed, or that nothing could be compared: it may be another building."""
    compared = len(one.changed) + one.access_points.get(UNCHANGED, 0)
    if not compared:
        count = sum(one.places.values())
        message = (
            f"{one.technology}: the surveys have no place in common, or too few readings there, so changes cannot be "
            "detected"
        )
        return (Finding(kind=NOTHING_COMPARED, file="", count=count, message=message),)
    if 2 * len(one.changed) <= compared:
        return ()
    message = (
        f"{one.technology}: {len(one.changed)} of {compared} access points changed. Check that the later survey is of "
        "the same building, with the same floor numbers and coordinates"
    )
    return (Finding(kind=MOST_CHANGED, file="", count=len(one.changed), message=message),)


def _record(changes: Changes) -> TechnologyChanges:
    changed = changes.access_points.filter(pl.col("change").is_in(CHANGED_POINTS))
    return TechnologyChanges(
        technology=changes.technology,
        cell_m=changes.cell_m,
        offsets=tuple(
            SurveyDeviceOffset(survey=survey, device=device, offset_db=round(offset, 2))
            for (survey, device), offset in sorted(changes.offsets_db.items())
        ),
        access_points=_counts(changes.access_points),
        places=_counts(changes.places),
        changed=tuple(ChangedPoint(**row) for row in changed.select(ChangedPoint.model_fields.keys()).rows(named=True)),
    )


def _counts(table: pl.DataFrame) -> dict[str, int]:
    return dict(table.group_by("change").len().sort("change").iter_rows())

from __future__ import annotations

import datetime as dt
from dataclasses import replace

import pytest
from matplotlib.patches import Rectangle

from tests.datasets.factory import small_dataset
from vislam2tag.datasets.model import Storey
from vislam2tag.datasets.schema import REQUIRED, empty_table
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import (
    DeviceRssi,
    Distribution,
    FloorLabels,
    LabelCounts,
    SessionStatistics,
    SigmaDistribution,
    TechnologyStatistics,
)
from vislam2tag.views.dataset_figures import (
    access_points_heard,
    covered_floors,
    dataset_figures,
    fingerprints_by_device_and_floor,
    fingerprints_over_time,
    rssi_by_device,
    sigma_distribution,
)


def technology(devices: list[str]) -> TechnologyStatistics:
    by_device = {device: LabelCounts.of(10 * (n + 1), 9 * (n + 1)) for n, device in enumerate(devices)}
    total = LabelCounts.of(sum(x.fingerprints for x in by_device.values()), sum(x.labelled for x in by_device.values()))
    return TechnologyStatistics(
        labels=total,
        readings=0,
        labelled_readings=0,
        transmitters=0,
        by_device=by_device,
        by_floor=(FloorLabels(building="B", floor=2, labels=total, by_device=by_device),),
        statuses={},
        heard=Distribution.of({0: 1}),
        rssi={},
        sigma=None,
        labelled_per_minute=None,
        labelled_per_person_hour=None,
    )


@pytest.mark.parametrize(("count", "colours"), [(2, 3), (9, 2)])
def test_figure_8_splits_floors_by_device(count: int, colours: int) -> None:
    figure = fingerprints_by_device_and_floor(technology([f"phone {n}" for n in range(count)]))
    left, right = figure.axes
    assert [label.get_text() for label in left.get_yticklabels()] == [f"phone {n}" for n in range(count)]
    assert [label.get_text() for label in right.get_yticklabels()] == ["B, floor 2"]
    bars = [patch for patch in right.patches if isinstance(patch, Rectangle)]
    *labelled_widths, unlabelled_width = (bar.get_width() for bar in bars)
    labelled, unlabelled = 9 * count * (count + 1) // 2, count * (count + 1) // 2
    assert (sum(labelled_widths), unlabelled_width) == (labelled, unlabelled)
    assert len({bar.get_facecolor() for bar in bars}) == colours
    assert [text.get_text() for text in right.texts] == [str(labelled)]


def test_bars_hold_every_fingerprint_however_many_access_points() -> None:
    (axes,) = access_points_heard(Distribution.of({0: 3, 7: 20, 200: 2})).axes
    assert sum(patch.get_height() for patch in axes.patches if isinstance(patch, Rectangle)) == 25
    assert axes.texts[0].get_text() == "median 7"


def test_rssi_names_the_offsets_that_are_known() -> None:
    heard = Distribution.of({-80: 5, -60: 5})
    rssi = {
        "A&A": DeviceRssi(rssi_dbm=heard, offset_db=2.5, shared=9),
        "B": DeviceRssi(rssi_dbm=heard, offset_db=-2.5, shared=9),
        "C": DeviceRssi(rssi_dbm=heard, offset_db=None, shared=0),
    }
    left, right = rssi_by_device(rssi).axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["A&A", "B", "C"]
    assert [label.get_text() for label in right.get_yticklabels()] == ["B", "A&A"]
    assert "(unknown: C)" in right.get_title(loc="left") + right.get_title()
    assert [text.get_text() for text in right.texts] == ["-2.5", "+2.5"]
    assert len(rssi_by_device({"C": rssi["C"]}).axes) == 1


def test_sigma_ends_at_all_fingerprints() -> None:
    (axes,) = sigma_distribution(SigmaDistribution(fingerprints=4, median_m=0.1, p95_m=0.3, counts={50: 3, 66: 1})).axes
    curve = axes.lines[0]
    assert list(curve.get_ydata()) == [0, 0.75, 1.0]  # type: ignore[arg-type]


@pytest.mark.parametrize(("devices", "lines"), [("AB", 3), ("A", 1)])
def test_fingerprints_add_up_over_dated_walks(devices: str, lines: int) -> None:
    def walk(device: str, day: int | None) -> SessionStatistics:
        return SessionStatistics(
            session=f"{device}{day}",
            device=device,
            building="",
            floor=0,
            started=None if day is None else dt.datetime(2026, 3, day),
            duration_s=60,
            distance_m=50,
            labelled_s=60,
            labelled_m=50,
            labels={"wifi": LabelCounts.of(12, 10)},
        )

    walks = [walk(device, day) for device in devices for day in (2, 1, None)]
    (axes,) = fingerprints_over_time(walks, "wifi").axes
    assert len(axes.lines) == lines
    assert list(axes.lines[0].get_ydata()) == list(range(10, 20 * len(devices) + 1, 10))  # type: ignore[arg-type]


def test_every_figure_that_there_is_data_for_is_made() -> None:
    dataset = small_dataset()
    floors = covered_floors(dataset, "wifi", CoverageSettings(), {})
    figures = dict(dataset_figures(dataset_statistics(dataset), floors))
    assert set(figures) == {"fingerprints", "coverage", "access_points", "rssi", "sigma", "over_time"}
    assert [axes.get_title("left")[:11] for axes in figures["coverage"].axes] == ["(a) Floor 0", "(b) Floor 1"]


def test_an_empty_set_has_no_figure() -> None:
    empty = replace(small_dataset(), tables={name: empty_table(name).lazy() for name in REQUIRED})
    assert list(dataset_figures(dataset_statistics(empty), covered_floors(empty, "wifi", CoverageSettings(), {}))) == []


@pytest.mark.parametrize(("start", "length_m"), [(None, 0.0), ((5.0, 11.0), 32.0)])
def test_the_walk_begins_where_it_is_told_to(start: tuple[float, float] | None, length_m: float) -> None:
    dataset = small_dataset(unlabelled=0)
    wide = CoverageSettings(cell_m=4.0, radius_m=0.1)
    tight = covered_floors(dataset, "none", wide, {} if start is None else {Storey("", 0): start})
    assert tight[0].coverage.share == 0
    assert sum(walk.length_m for walk in tight[0].walks) >= length_m

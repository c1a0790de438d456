"""The site's own files, with and without the optional columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.simulation.worlds import sessions_of
from vislam2tag.simulation.building.building import make_building
from vislam2tag.simulation.choices import SiteColumn
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.simulation.writing.session import SimulatedSession
from vislam2tag.simulation.writing.site_files import site_text
from vislam2tag.site.discover import read_site

ALL = frozenset(SiteColumn)


@pytest.fixture(scope="module")
def session() -> SimulatedSession:
    return sessions_of("clean")[0]


def test_site_files(session: SimulatedSession) -> None:
    files = site_text(session.building, control_points=True)
    assert set(files) == {"floor_dimensions.csv", "floor_0/marker_dict.csv", "floor_0/refmarker.csv"}
    assert files["floor_dimensions.csv"] == b"id,width,height\n0,60.0,32.0\n"
    markers = pl.read_csv(files["floor_0/marker_dict.csv"])
    assert markers.columns == ["id", "x", "y"]
    assert np.allclose(markers.select("x", "y").to_numpy(), session.floor.landmark_position[:, :2], atol=1e-4)
    points = pl.read_csv(files["floor_0/refmarker.csv"], has_header=False).to_numpy()
    assert np.allclose(points, session.floor.control_points, atol=1e-4)
    assert "floor_0/refmarker.csv" not in site_text(session.building, control_points=False)


def test_optional_columns_are_off_by_what_they_say(tmp_path: Path) -> None:
    building = make_building(BuildingSettings(landmarks=20), 1, tuple(range(12)))
    for name, text in site_text(building, False, ALL, seed=4).items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text)
    marks = read_site(tmp_path)[0].landmarks
    place = np.vstack([floor.landmark_position for floor in building.floors])
    heading = np.concatenate([floor.landmark_heading_rad for floor in building.floors])
    sigma = np.sqrt(marks.covariance_bcs[:, 0, 0])
    assert len(set(sigma.tolist())) > 50
    assert np.std((marks.position_bcs - place[:, :2]) / sigma[:, None]) == pytest.approx(1.0, abs=0.15)
    assert np.std(marks.z_m - place[:, 2]) == pytest.approx(0.02, abs=0.005)
    turned = (marks.heading_rad - heading + np.pi) % (2 * np.pi) - np.pi
    assert np.std(turned / marks.heading_sigma_rad) == pytest.approx(1.0, abs=0.15)


def test_one_more_column_leaves_the_others_as_they_are(session: SimulatedSession) -> None:
    def table(columns: frozenset[SiteColumn]) -> pl.DataFrame:
        return pl.read_csv(site_text(session.building, False, columns, seed=4)["floor_0/marker_dict.csv"])

    assert table(ALL).select("id", "x", "y", "sigma_m").equals(table(frozenset({SiteColumn.SIGMA})))
    assert table(ALL).select("z").equals(table(frozenset({SiteColumn.Z})).select("z"))


def test_elevations_are_read_back(tmp_path: Path) -> None:
    scenario = regular_survey(1, "none", (0, 1), ("LG",), 1, 20.0)
    simulate(scenario, tmp_path, WritingOptions(columns=frozenset({SiteColumn.ELEVATION})))
    assert [floor.elevation_m for floor in read_site(tmp_path)[0].floors] == [0.0, 3.6]

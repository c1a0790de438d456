"""``site.toml``: what it says comes back, and what it cannot say is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Transformer

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.limits import MAX_FLOOR_M
from vislam2tag.site.georeference import georeference_of, to_wgs84
from vislam2tag.site.plans.source import Extent, PlanSource, ScaleDistance, ScalePoint
from vislam2tag.site.site_file import FloorPart, GeoreferencePart, Relation, SiteFile, read_site_file, site_file_text

metres = st.floats(-1e5, 1e5)
lengths = st.floats(0.01, 1e5)
places = st.tuples(metres, metres)
two_points = st.tuples(places, places).filter(lambda ends: ends[0] != ends[1])
names = st.text(max_size=12)
sides = st.floats(1.0, MAX_FLOOR_M)
extents = st.builds(Extent, width_m=sides, height_m=sides, lower_left_m=places)
distances = st.builds(
    lambda ends, metres, corner: ScaleDistance.model_validate(
        {"from": ends[0], "to": ends[1], "metres": metres, "lower_left_m": corner}
    ),
    two_points,
    lengths,
    places,
)
known_points = st.builds(
    lambda plan, bcs: (ScalePoint(plan=plan[0], bcs_m=bcs[0]), ScalePoint(plan=plan[1], bcs_m=bcs[1])),
    two_points,
    two_points,
)
scales: st.SearchStrategy[dict[str, Any]] = st.one_of(
    st.fixed_dictionaries({"extent": extents}),
    st.fixed_dictionaries({"distance": distances}),
    st.fixed_dictionaries({"points": known_points}),
    st.fixed_dictionaries({"unit_m": lengths}),
    st.just({}),
)
sources = st.builds(
    lambda file, scale, page, layers, level: PlanSource(file=file, page=page, layers=layers, level=level, **scale),
    st.from_regex(r"[a-z]{1,8}/[ -.0-9a-z]{1,8}", fullmatch=True).filter(lambda name: ".." not in name),
    scales,
    st.integers(1, 9),
    st.tuples(names, names),
    st.none() | names,
)
floors = st.builds(
    FloorPart,
    number=st.integers(-9, 99),
    name=names,
    elevation_m=st.none() | metres,
    site_T_bcs=st.builds(Relation, x_m=metres, y_m=metres, angle_deg=st.floats(-360, 360)),
    plan=st.none() | sources,
)
sites = st.builds(
    SiteFile,
    name=names,
    georeference=st.none()
    | st.builds(
        GeoreferencePart,
        latitude_deg=st.floats(-80, 80),
        longitude_deg=st.floats(-180, 180),
        bearing_deg=st.floats(-360, 360),
    ),
    floors=st.lists(floors, min_size=1, max_size=3, unique_by=lambda floor: floor.number).map(tuple),
)


@given(site=sites)
def test_what_is_written_is_read(tmp_path_factory: pytest.TempPathFactory, site: SiteFile) -> None:
    folder = tmp_path_factory.mktemp("site")
    (folder / "site.toml").write_text(site_file_text(site), encoding="utf-8")
    assert read_site_file(folder) == site


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"floors: missing"),
        ("floors = 3\n", r"\[\[floors\]\]: each entry must start with its name in double brackets"),
        ("floors = []\n", r"\[\[floors\]\]: .*at least 1"),
        ("[[floors]]\nname = 'x'\n", r"\[\[floors\]\] number 1, number: missing; add it"),
        ("[[floors]]\nnumber = 1\n[[floors]]\nnumber = 1\n", r"floor 1 is given 2 times; give each floor once"),
        (
            "[[floors]]\nnumber = 1\n[[floors]]\nnumber = 2\nwidht = 3\n",
            r"number 2, widht: unknown name, check the spelling",
        ),
        (
            "[[floors]]\nnumber = 1\n[floors.plan]\nfile = 'a.png'\npoints = [{plan=[1,1]}]\n",
            r"plan, points 1, bcs_m: m",
        ),
        (
            "[[floors]]\nnumber = 1\n[floors.plan]\nfile = 'a.png'\n"
            "points = [{plan=[1,1], bcs_m=[0,0]}, {plan=[1,1], bcs_m=[3,0]}]\n",
            r"\[\[floors\]\] number 1, plan: points are identical, so they give no scale",
        ),
        (
            "[georeference]\nepsg = 25832\n[[floors]]\nnumber = 1\n",
            r"\[georeference\]|georeference: specify either epsg",
        ),
        (
            "[georeference]\nepsg = 4326\neasting_m = 6.0\nnorthing_m = 50.0\n[[floors]]\nnumber = 1\n",
            "has no eastings and northings; give latitude_deg",
        ),
        (
            "[georeference]\nepsg = 1\neasting_m = 6.0\nnorthing_m = 50.0\n[[floors]]\nnumber = 1\n",
            "EPSG:1 is not a known reference system",
        ),
        ("not toml", "the file is not valid TOML"),
    ],
)
def test_mistakes_are_told_with_file_and_entry(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "site.toml").write_text(text)
    with pytest.raises(SurveyError, match=message) as told:
        read_site_file(tmp_path)
    assert str(told.value).startswith(f"{tmp_path / 'site.toml'}: ")


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"contains no site.toml; make one with vislam2tag site init"):
        read_site_file(tmp_path)


@settings(max_examples=10)
@given(x=st.floats(-200, 200), y=st.floats(-200, 200), rotation=st.floats(-180, 180))
def test_grid_coordinates_are_those_of_proj(x: float, y: float, rotation: float) -> None:
    """A place of the site lies where the grid has it, but for the grid's scale (ETRS89 / UTM 32N: 0.9996 and more)."""
    part = GeoreferencePart(epsg=25832, easting_m=294_405.0, northing_m=5_628_801.0, rotation_deg=rotation)
    turn = np.radians(rotation)
    grid = Transformer.from_crs(4326, 25832, always_xy=True)
    found = grid.transform(*to_wgs84(np.array([[x, y]]), part.georeference())[0])
    expected = (x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn))
    assert np.subtract(found, (294_405.0, 5_628_801.0)) == pytest.approx(expected, abs=0.15)


@given(x=metres.filter(lambda x: abs(x) < 300), y=st.floats(-300, 300), angle=st.floats(-180, 180))
def test_floors_lie_in_the_site(x: float, y: float, angle: float) -> None:
    site = GeoreferencePart(latitude_deg=50.0, longitude_deg=6.0, bearing_deg=33.0).georeference()
    site_T_bcs = Relation(x_m=x, y_m=y, angle_deg=angle).similarity()
    points = np.array([[0.0, 0.0], [40.0, 10.0]])
    own = to_wgs84(points, georeference_of(site, site_T_bcs))
    assert own == pytest.approx(to_wgs84(site_T_bcs @ points, site), abs=1e-7)

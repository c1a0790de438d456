from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.preparation.registration.networks import SHOT_M, survey, swapped_shots
from tests.site.site import write_survey
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.preparation.registration.names import NameRules
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.preparation.registration.record import (
    PositionSource,
    RegisteredPoint,
    Registration,
    RegistrationSettings,
)
from vislam2tag.preparation.registration.register import (
    FloorMeasurements,
    known_points_of_site,
    read_known_points,
    read_stations,
    register_floor,
)
from vislam2tag.preparation.registration.results import LEAST_SIGMA_M
from vislam2tag.preparation.registration.tape_and_clicks import Click, TapeDistance, Target
from vislam2tag.site.discover import read_site


def shot(point: str, place: complex, height_m: float = math.nan) -> Measurement:
    return Measurement(point=point, place=place, station="S", sigma_m=SHOT_M, height_m=height_m)


def known(point: str, place: complex) -> Measurement:
    return Measurement(point=point, place=place, sigma_m=SHOT_M)


CORNERS = {"A": 0j, "B": 20 + 0j, "C": 20 + 10j, "D": 10j}
BASE = [shot(name, place) for name, place in CORNERS.items()]
GIVEN = [known(name, place) for name, place in CORNERS.items()]


def registered(measured: FloorMeasurements, *, free_scale: bool = False) -> Registration:
    return register_floor(1, measured, free_scale=free_scale)


def by_id(found: Registration) -> dict[str, RegisteredPoint]:
    return {one.point: one for one in found.landmarks}


def test_landmarks_get_position_height_sigma_and_covariance() -> None:
    measured = FloorMeasurements(
        shots=[shot("A", 0j, 50.0), *BASE[1:], shot("7", 5 + 4j, 51.4), shot("10", 6 + 4j)],
        known=[replace(GIVEN[0], height_m=0.0), *GIVEN[1:]],
    )
    found = registered(measured)
    one = by_id(found)["7"]
    assert list(by_id(found)) == ["7", "10"]
    assert (one.x_m, one.y_m, one.z_m, one.source) == (5, 4, 1.4, PositionSource.STATION)
    (xx, _), (_, yy) = one.covariance_m2
    assert one.sigma_m == pytest.approx(math.sqrt((xx + yy) / 2), abs=1e-5)
    assert one.sigma_m > 0.8 * SHOT_M
    assert one.checked == 0
    assert found.complete
    assert {residual.measurement.split(" from")[0] for residual in found.residuals} > {"shot of A", "known point C"}


def test_no_landmark_is_stated_better_than_paper_hangs() -> None:
    many = [shot("7", 5 + 4j) for _ in range(40)]
    sure = [replace(one, sigma_m=1e-4) for one in (*BASE, *many)]
    exact = [replace(one, sigma_m=1e-4) for one in GIVEN]
    assert by_id(registered(FloorMeasurements(shots=sure, known=exact)))["7"].sigma_m == LEAST_SIGMA_M


def test_edges_give_heading_and_centre() -> None:
    # A sheet on the south wall: who looks at it looks south, and its X axis points west.
    measured = FloorMeasurements(
        shots=[*BASE, shot("7_L", 5.3 + 0j), shot("7_R", 5.0 + 0j), shot("8_L", 1j)], known=GIVEN
    )
    found = registered(measured)
    one = by_id(found)["7"]
    assert (one.x_m, one.y_m) == (5.15, 0)
    assert one.heading_rad is not None
    assert abs(one.heading_rad) == pytest.approx(math.pi, abs=1e-6)
    assert one.heading_sigma_rad == pytest.approx(math.sqrt(2) * SHOT_M / 0.3, rel=0.3)
    assert found.unplaced == {"8": "only one edge of its sheet was measured"}
    assert not found.complete


def test_heading_sigma_holds() -> None:
    off = []
    sheets = [shot(f"{x}_{side}", x + y) for x in range(3, 17) for side, y in (("L", 4j), ("R", 4.3j))]
    for seed in range(15):
        rng = np.random.default_rng(seed)
        noisy = [replace(one, place=one.place + complex(*rng.normal(0, SHOT_M, 2))) for one in (*BASE, *sheets)]
        for one in registered(FloorMeasurements(shots=noisy, known=GIVEN)).landmarks:
            assert one.heading_rad is not None
            assert one.heading_sigma_rad is not None
            off.append(abs(one.heading_rad - math.pi / 2) / one.heading_sigma_rad)
    assert len(off) == 210
    assert 0.57 < np.mean(np.array(off) < 1) < 0.79


def test_control_points_and_ties_are_kept_apart() -> None:
    shots = [*BASE, shot("control point 0", 3 + 3j), shot("tie TP1", 9 + 9j), shot("7", 5 + 4j)]
    found = registered(FloorMeasurements(shots=shots, known=GIVEN))
    assert [one.point for one in found.control_points] == ["0"]
    assert list(by_id(found)) == ["7"]


def test_the_best_source_counts_and_clicks_are_compared() -> None:
    measured = FloorMeasurements(
        shots=[*BASE, shot("7", 5 + 4j)],
        known=GIVEN,
        distances=[
            TapeDistance("7", "A", 6.4, 0.02),
            TapeDistance("8", "W", 2.0, 0.02),
            TapeDistance("8", "7", 3.0, 0.02),
        ],
        targets={"W": Target("W", 0j, 20 + 0j, 0.01)},
        clicks={
            "7": Click("7", 5 + 5j, 0.1, ""),
            "8": Click("8", 7.2 + 2.1j, 0.1, ""),
            "9": Click("9", 9j, 0.1, ""),
            "A": Click("A", 0j, 0.1, ""),
        },
        extent_m=(0, 20, 0, 10),
    )
    found = registered(measured)
    assert {name: one.source for name, one in by_id(found).items()} == {
        "7": PositionSource.STATION,
        "8": PositionSource.TAPE,
        "9": PositionSource.CLICK,
    }
    assert by_id(found)["8"].x_m == pytest.approx(5 + math.sqrt(5), abs=0.02)
    assert by_id(found)["8"].note == "two positions are possible; the one closer to the expected position was used"
    (differs,) = (one for one in found.findings if one.kind == "click_differs")
    assert differs.message.startswith("landmark 7 was clicked 1.0")


def test_a_scale_that_is_off_is_told() -> None:
    drawn = survey(1, noise=0.3)
    longer = [replace(one, place=1.002 * one.place) for one in drawn.shots]
    found = registered(FloorMeasurements(shots=longer, known=drawn.known))
    assert found.scale is not None
    assert found.scale.value == pytest.approx(1 / 1.002, abs=1e-4)
    assert "station_scale" in {one.kind for one in found.findings}
    free = registered(FloorMeasurements(shots=longer, known=drawn.known), free_scale=True)
    assert free.sigma0 is not None
    assert found.sigma0 is not None
    assert free.sigma0 < found.sigma0
    fine = registered(FloorMeasurements(shots=drawn.shots, known=drawn.known))
    assert "station_scale" not in {one.kind for one in fine.findings}


def test_few_known_points_and_large_residuals_are_told() -> None:
    two = registered(FloorMeasurements(shots=BASE[:2], known=GIVEN[:2]))
    assert {one.kind for one in two.findings} == {"few_known_points"}
    drawn = survey(3, noise=4.0, stations=3)
    noisy = registered(FloorMeasurements(shots=drawn.shots, known=drawn.known))
    assert not noisy.plausible
    assert "large_sigma0" in {one.kind for one in noisy.findings}


def test_landmarks_that_are_lost_are_told() -> None:
    drawn = swapped_shots(survey(1, seen=1.0), "S1", "3", "4")
    found = registered(FloorMeasurements(shots=drawn.shots, known=drawn.known))
    assert found.unplaced == {"3": "its shots contradict others", "4": "its shots contradict others"}
    assert len(found.errors) == 1


def test_differences_to_the_site_are_told() -> None:
    shots = [*BASE, shot("7", 5 + 4j), shot("8", 9 + 4j), shot("9", 15 + 4j), shot("11", 1 + 1j)]
    expected = {"7": 9 + 4.2j, "8": 5 + 4j, "9": 15 + 8j}
    found = registered(FloorMeasurements(shots=shots, known=GIVEN, expected=expected))
    assert {one.kind: one.message for one in found.findings} == {
        "interchanged_landmarks": "landmarks 7 and 8 are at each other's position in the site: "
        "check whether their sheets or names are interchanged",
        "moved_landmark": "landmark 9 is 4.00 m from its position in the site",
        "new_landmark": "the site has no position of landmark 11: it is new, or its id is mistyped",
    }
    assert not found.complete


def test_repeated_shots_have_their_spread() -> None:
    found = registered(FloorMeasurements(shots=[*BASE, shot("7", 5 + 4j), shot("7", 5.004 + 4j)], known=GIVEN))
    (repeat,) = found.repeats
    assert (repeat.point, repeat.station, repeat.shots, repeat.spread_m) == ("7", "S", 2, 0.002)
    assert by_id(found)["7"].x_m == pytest.approx(5.002, abs=1e-4)


def test_the_record_is_read_back() -> None:
    drawn = survey(4)
    one = registered(FloorMeasurements(shots=drawn.shots, known=drawn.known))
    assert Registration.model_validate_json(one.model_dump_json()) == one


READING, RULES = RegistrationSettings(), NameRules(landmarks="LM*")


def test_a_file_is_a_station_unless_a_column_says_so(tmp_path: Path) -> None:
    (tmp_path / "S1.csv").write_text("Point,E,N,H,Code\nLM7,1,2,3,M\nK,1,1,,F\n")
    (tmp_path / "S2.csv").write_text("Station;Point;E;N\nA;LM7;1,5;2\nB;LM8;3;4\n")
    shots, _ = read_stations([tmp_path / "S1.csv", tmp_path / "S2.csv"], None, (), RULES, READING)
    assert [(one.station, one.point) for one in shots] == [("S1", "7"), ("S1", "tie K"), ("A", "7"), ("B", "8")]
    assert [one.height_m for one in shots] == pytest.approx([3, math.nan, math.nan, math.nan], nan_ok=True)


def test_other_codes_are_left_out_and_counted(tmp_path: Path) -> None:
    (tmp_path / "S1.csv").write_text("Point,E,N,H,Code\nLM7,1,2,3,M\nK,1,1,,F\n")
    shots, (finding,) = read_stations([tmp_path / "S1.csv"], None, ("M",), RULES, READING)
    assert [one.point for one in shots] == ["7"]
    assert (finding.kind, finding.lines) == ("other_code", (3,))


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="another file has the same name"):
        read_stations([tmp_path / "a/S1.csv", tmp_path / "b/S1.txt"], None, (), RULES, READING)


def test_known_points_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "known.csv"
    path.write_text("name,x,y,z,sigma_m\nA,1,2,0.5,0.001\nLM7,3,4,,\n")
    known, _ = read_known_points(path, RULES, READING)
    assert [(one.point, one.place, one.sigma_m) for one in known] == [
        ("tie A", 1 + 2j, 0.001),
        ("7", 3 + 4j, READING.control_sigma_m),
    ]
    assert [one.height_m for one in known] == pytest.approx([0.5, math.nan], nan_ok=True)
    path.write_text("name,x,y\nLM7,1,2\nLM07,3,4\n")
    with pytest.raises(SurveyError, match=r"known\.csv:3: known point LM07 is listed twice \(first: known\.csv:2\)"):
        read_known_points(path, RULES, READING)


def test_known_points_of_a_grid_are_refused(tmp_path: Path) -> None:
    (tmp_path / "known.csv").write_text("point,E,N,H\nA,294405,5628801,0\nB,294425,5628801,0\n")
    with pytest.raises(SurveyError, match=r"known.csv:2: known point A is at \(294405, 5628801\) m, as in a national"):
        read_known_points(tmp_path / "known.csv", NameRules(), RegistrationSettings())


def test_known_points_of_the_site(tmp_path: Path) -> None:
    site, _ = read_site(write_survey(tmp_path))
    known = known_points_of_site(site, 1, ["all"], RULES, READING)
    assert {one.point: one.place for one in known} == {
        "10": 1.5 + 2.5j,
        "7": 30 + 4j,
        "control point 0": 1 + 2j,
        "control point 1": 3.5 + 4j,
    }
    chosen = known_points_of_site(site, 1, ["LM7", "CP1"], RULES, READING)
    assert [one.point for one in chosen] == ["7", "control point 1"]
    with pytest.raises(UsageError, match="--known 99: floor 1 has no measured position of this landmark"):
        known_points_of_site(site, 1, ["LM99"], RULES, READING)

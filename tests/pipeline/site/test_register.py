"""From a station's export to labels: a simulated survey whose landmarks are registered."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import make_survey
from vislam2tag.common.errors import OutputError
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.site.register import FloorFiles, floor_of, register, write_into_site
from vislam2tag.preparation.registration.names import NameRules
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.site.discover import read_site

RULES = NameRules("LM*")
SETTINGS = RegistrationSettings()
CORNERS = {"K1": 1 + 1j, "K2": 59 + 1j, "K3": 59 + 31j, "K4": 1 + 31j}


@pytest.fixture(name="surveyed")
def _surveyed(tmp_path: Path) -> tuple[Path, Path]:
    """A simulated survey with exact landmarks, and a copy that has none yet but two stations' exports of them."""
    exact = make_survey(tmp_path / "exact", devices=("LG",), seconds=60.0, severity="default")
    bare = tmp_path / "bare"
    shutil.copytree(exact, bare)
    landmarks = read_site(exact)[0].landmarks
    places = {f"LM{name}": complex(*at) for name, at in zip(landmarks.ids, landmarks.position_bcs, strict=True)}
    rng = np.random.default_rng(1)
    for number, turn_rad in enumerate((0.4, 2.9), start=1):
        lines = ["Punkt;Rechtswert;Hochwert;Höhe"]
        for name, place in (CORNERS | places).items():
            seen = (place - 10j) * np.exp(1j * turn_rad) + 1000 + complex(*rng.normal(0, 0.003, 2))
            lines.append(f"{name};{seen.real:.3f};{seen.imag:.3f};{100 + 1.4 * (name in places):.3f}".replace(".", ","))
        (tmp_path / f"S{number}.csv").write_text("\r\n".join(lines), encoding="cp1252")
    known = [f"{name},{place.real},{place.imag},0" for name, place in CORNERS.items()]
    (tmp_path / "known.csv").write_text("\n".join(["name,x,y,z", *known]))
    (bare / "floor_0/marker_dict.csv").write_text("id,x,y\n" + "".join(f"{name},,\n" for name in landmarks.ids))
    return exact, bare


def mean_error_m(survey: Path, out: Path) -> float:
    process(survey, out)
    (result,) = (json.loads(path.read_text())["errors"] for path in (out / "sessions").glob("*.json"))
    rows = result["rows"]
    return float(sum(row["sum_m"] for row in rows) / sum(sum(row["errors"].values()) for row in rows))


def test_labels_from_registered_landmarks_are_those_from_exact_ones(
    surveyed: tuple[Path, Path], tmp_path: Path
) -> None:
    exact, bare = surveyed
    site, floor = floor_of(bare, None)
    files = [tmp_path / "S1.csv", tmp_path / "S2.csv"]
    found = register(site, floor, FloorFiles(files, tmp_path / "known.csv", rules=RULES), SETTINGS)
    assert found.complete
    written = write_into_site(bare, floor, found, replace=False)
    assert [path.name for path in written] == ["marker_dict.csv", "landmark_states.csv", "registration.json"]

    true, landmarks = read_site(exact)[0].landmarks, read_site(bare)[0].landmarks
    assert landmarks.ids == true.ids
    assert np.linalg.norm(landmarks.position_bcs - true.position_bcs, axis=1).max() < 0.02
    assert landmarks.z_m == pytest.approx(1.4, abs=0.01)
    assert np.sqrt(landmarks.covariance_bcs[:, 0, 0]).max() < 0.01
    both = mean_error_m(exact, tmp_path / "out-exact"), mean_error_m(bare, tmp_path / "out-bare")
    assert both[1] == pytest.approx(both[0], abs=0.02)


def test_nothing_is_written_where_one_file_cannot_be(surveyed: tuple[Path, Path], tmp_path: Path) -> None:
    _, bare = surveyed
    (tmp_path / "S1.csv").write_text((tmp_path / "S1.csv").read_text("cp1252").replace("LM1;", "CP7;"))
    site, floor = floor_of(bare, None)
    found = register(site, floor, FloorFiles([tmp_path / "S1.csv"], tmp_path / "known.csv", rules=RULES), SETTINGS)
    before = (bare / "floor_0/marker_dict.csv").read_text()
    with pytest.raises(OutputError, match="control point 0 is missing"):
        write_into_site(bare, floor, found, replace=False)
    assert (bare / "floor_0/marker_dict.csv").read_text() == before

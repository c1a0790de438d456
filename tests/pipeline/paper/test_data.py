from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.pipeline.paper.paper_copy import SECONDS
from tests.surveys import make_survey
from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.pipeline.paper.data import Collection, PaperWalks, open_paper_data, paper_collection, paper_walks
from vislam2tag.quality.evaluation.paper import STRATEGIES, labelled_shares
from vislam2tag.settings import Settings
from vislam2tag.site.model import SessionKey


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two surveys: one phone that collects and one that evaluates; the second holds the collecting walk once more."""
    root = tmp_path_factory.mktemp("data")
    make_survey(root / "one", devices=("LG", "LG_ref"))
    shutil.copytree(root / "one", root / "two", ignore=shutil.ignore_patterns("LG_ref"))
    return root


@pytest.fixture(scope="module")
def collection(data: Path) -> Collection:
    return paper_collection(open_paper_data(data), Settings())


def test_walks_that_collect_count_once_and_those_that_evaluate_not_at_all(collection: Collection) -> None:
    assert collection.failed == ()
    assert collection.statistics is not None
    assert list(collection.statistics.by_device) == ["LG"]
    assert collection.statistics.walks.trajectories == 1
    assert collection.statistics.walks.duration_s == pytest.approx(40, abs=1)
    wifi = collection.statistics.technologies["wifi"]
    assert 0 < wifi.labels.labelled <= wifi.labels.fingerprints


def test_every_walk_is_told_as_progress(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "two", tmp_path / "survey")
    told: list[tuple[int, int]] = []
    paper_collection(open_paper_data(tmp_path), Settings(), lambda done, total: told.append((done, total)))
    assert told == [(1, 1)]


def test_a_walk_that_cannot_be_labelled_is_told(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "two", tmp_path / "survey")
    (poses,) = tmp_path.glob("survey/floor_0/LG/*/poses.csv")
    poses.write_text("nothing\n")
    found = paper_collection(open_paper_data(tmp_path), Settings())
    assert len(found.failed) == 1
    assert "floor 0 / LG" in found.failed[0]


def test_evaluation_alone_collects_nothing(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "one", tmp_path / "survey", ignore=shutil.ignore_patterns("LG"))
    assert paper_collection(open_paper_data(tmp_path), Settings()) == Collection(None, ())


@pytest.fixture(scope="module")
def walks(paper_copy: Path) -> PaperWalks:
    return paper_walks(open_paper_data(paper_copy), Settings())


def test_surveys_are_found_below_the_folder(paper_copy: Path) -> None:
    (survey,) = open_paper_data(paper_copy.parent).surveys
    assert survey.root == paper_copy
    assert {ref.key for _, ref in open_paper_data(paper_copy).refs()} == set(SECONDS)


def test_a_session_may_be_called_like_a_floor(paper_copy: Path, tmp_path: Path) -> None:
    device = tmp_path / "floor_1" / "LG"
    shutil.copytree(next((paper_copy / "floor_1" / "LG_ref").iterdir()), device / "floor_2_again")
    (survey,) = open_paper_data(tmp_path).surveys
    assert [ref.key for ref in survey.sessions] == [SessionKey(1, "LG", "floor_2_again")]


def test_missing_session_is_named(paper_copy: Path) -> None:
    key = SessionKey(3, "S20", "never")
    with pytest.raises(SessionError, match="floor 3 / S20 / never does not exist in this data"):
        open_paper_data(paper_copy).find(key)


def test_a_folder_without_survey_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="not a survey"):
        open_paper_data(tmp_path)


def test_walks_over_control_points_have_the_walkers_error(walks: PaperWalks) -> None:
    assert [walk.key.device for walk in walks.pressed] == ["LG_ref", "OnePlus_ref"]
    for walk in walks.pressed:
        assert not walk.faulty
        assert walk.movement_m < 0.05
        assert all(0.1 < walk.errors.error_m[name] < 0.8 for name in STRATEGIES)


def test_shares_are_over_all_points(walks: PaperWalks) -> None:
    shares = labelled_shares(walks.pressed)
    assert set(shares) == set(STRATEGIES)
    points = [walk.points["local"] for walk in walks.pressed]
    assert shares["local"] == pytest.approx(sum(p.labelled.sum() for p in points) / sum(map(len, points)))
    assert labelled_shares([]) == {}


def test_walks_before_the_station_are_right_to_a_few_centimetres(walks: PaperWalks) -> None:
    assert walks.failed == []
    assert len(walks.tracked) == 2
    assert all(walk.errors.error_m["local"] < 0.15 for walk in walks.tracked)


def test_what_fails_is_told_and_the_rest_goes_on(paper_copy: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(paper_copy, copy)
    shutil.rmtree(copy / "floor_4" / "tachymeter")
    counted: list[tuple[int, int]] = []
    walks = paper_walks(open_paper_data(copy), Settings(), lambda done, total: counted.append((done, total)))
    (sentence,) = walks.failed
    assert sentence.startswith("floor 4 / OnePlus_tachy: the total station's frame needs at least two common points")
    assert len(walks.pressed) == 2
    assert counted[-1] == (6, 6)


def test_excluded_sessions_do_not_count(paper_copy: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(paper_copy, copy)
    (copy / "corrections.toml").write_text(
        '[[exclude_session]]\nfloor = 1\ndevice = "LG_ref"\nsession = "2022-01-19T16:06:28"\n'
    )
    assert len(open_paper_data(copy).refs()) == len(SECONDS) - 1

"""From a drawn video to labels: tags and sheets on a room's walls, seen by a moving camera with a rolling shutter."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.preparation.rendered_walk import HEIGHT_M, Walk, posters_round_the_room, write_stray_scanner
from vislam2tag.preparation.detect_landmarks import Seen, search
from vislam2tag.preparation.sheets.features import GreyImage
from vislam2tag.preparation.sheets.images import read_grey
from vislam2tag.sessions.apps import Pictures

TAG_SIDE_M, PAPER_M = 0.2, 0.25
VIDEO = cv2.VideoCapture
WALK = Walk.round_the_room(1.0)


def tag(number: int) -> GreyImage:
    """A tag on paper whose white edge is an eighth of its side."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    return np.pad(np.asarray(cv2.aruco.generateImageMarker(dictionary, number, 400), np.uint8), 50, constant_values=255)


def survey_of(root: Path, pictures: Mapping[str, GreyImage], paper_m: float) -> Path:
    posters = posters_round_the_room(pictures, paper_m)
    write_stray_scanner(root / "floor_1" / "iPhone" / "walk", WALK, list(posters.values()))
    rows = [f"{name},{one.centre_m[0]},{one.centre_m[1]},{HEIGHT_M}\n" for name, one in posters.items()]
    (root / "floor_1" / "marker_dict.csv").write_text("id,x,y,z\n" + "".join(rows), encoding="utf-8")
    return root


def errors_m(labels: Path) -> np.ndarray:
    (path,) = (labels / "trajectory").glob("*.parquet")
    found = pl.read_parquet(path)
    at = found["time_ns"].to_numpy() * 1e-9
    true = [np.interp(at, WALK.time_s, WALK.position_bcs[:, i]) for i in (0, 1)]
    return np.asarray(np.hypot(found["x"].to_numpy() - true[0], found["y"].to_numpy() - true[1]))


@pytest.fixture(scope="module")
def tagged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return survey_of(tmp_path_factory.mktemp("iphone") / "survey", {str(n): tag(n) for n in range(8)}, PAPER_M)


@pytest.mark.slow
def test_tags_in_a_video_map_the_walk(tagged: Path, tmp_path: Path) -> None:
    before = {path: path.read_bytes() for path in tagged.rglob("*") if path.is_file()}
    assert "vislam2tag sightings" in vislam2tag("inspect", tagged).stdout
    options = ("--tags", "apriltag-36h11", "--tag-side-m", str(TAG_SIDE_M))
    done = vislam2tag("sightings", tagged, *options, "--json")
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)
    assert set(found["landmarks"]) == {str(n) for n in range(8)}
    (again,) = json.loads(vislam2tag("sightings", tagged, *options, "--json").stdout)
    assert "sightings.csv already exists" in again["skipped"]
    assert {path: path.read_bytes() for path in before} == before, "the recording stays as it is"
    assert vislam2tag("process", tagged, "--out", tmp_path / "labels", "--jobs", "1").returncode == 0
    errors = errors_m(tmp_path / "labels")
    assert np.isfinite(errors).mean() > 0.95
    assert np.nanmean(errors) < 0.2


@pytest.mark.slow
def test_printed_sheets_in_a_video_map_the_walk(tmp_path: Path) -> None:
    assert vislam2tag("sheets", "--ids", "1-8", "--width-m", "0.1", "--out", tmp_path / "sheets").returncode == 0
    images = tmp_path / "sheets" / "images"
    enlarged = "id,file,width_m\n" + "".join(f"{n},{n}.png,0.5\n" for n in range(1, 9))
    (images / "manifest.csv").write_text(enlarged, encoding="utf-8")
    pictures = {str(n): read_grey(images / f"{n}.png") for n in range(1, 9)}
    survey = survey_of(tmp_path / "survey", pictures, 0.5)
    done = vislam2tag("sightings", survey, "--images", images)
    assert done.returncode == 0, done.stderr
    assert vislam2tag("process", survey, "--out", tmp_path / "labels", "--jobs", "1").returncode == 0
    assert np.nanmean(errors_m(tmp_path / "labels")) < 0.2


def test_a_video_that_was_cut_off_is_an_error_of_its_session(tagged: Path, tmp_path: Path) -> None:
    walk = tmp_path / "survey" / "floor_1" / "iPhone" / "walk"
    walk.mkdir(parents=True)
    for name in ("odometry.csv", "camera_matrix.csv", "rgb.mp4"):
        whole = (tagged / "floor_1" / "iPhone" / "walk" / name).read_bytes()
        (walk / name).write_bytes(whole[: 3000 if name == "rgb.mp4" else None])
    done = vislam2tag("sightings", tmp_path / "survey", "--tags", "apriltag-36h11", "--tag-side-m", "0.2")
    assert done.returncode == 1
    assert "rgb.mp4: the file cannot be opened: it is not a video, or it is incomplete" in done.stderr
    assert not (walk / "sightings.csv").exists()


class Bright:
    """Finds a landmark in bright pictures, and keeps all that it was shown."""

    def __init__(self) -> None:
        self.shown: list[int] = []

    def __call__(self, picture: GreyImage) -> list[Seen]:
        self.shown.append(int(picture[0, 0]))
        corners = np.array(((100, 100), (140, 100), (140, 140), (100, 140)), np.float64)
        return [Seen("7", corners, 0.5, (0.2, 0.2))] if picture[0, 0] >= 200 else []


LEVELS = [10] * 40 + [220] * 5 + [10] * 55


def ten_a_second(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and lenses of pictures, ten a second."""
    return np.arange(count) * 100_000_000, np.tile((300.0, 300.0, 160.0, 120.0), (count, 1))


def test_only_pictures_that_can_show_a_landmark_are_looked_at_closely_and_progress_is_told(tmp_path: Path) -> None:
    files = tuple(tmp_path / f"{number}.png" for number in range(100))
    for file, level in zip(files, LEVELS, strict=True):
        cv2.imwrite(str(file), np.full((240, 320), level, np.uint8))
    detector, told = Bright(), list[tuple[int, int]]()
    pictures = Pictures(*ten_a_second(100), files=files)
    found = search(pictures, [detector], lambda passed, total: told.append((passed, total)))
    assert [each.time_ns for each in found.sightings] == [n * 100_000_000 for n in range(40, 45)]
    assert len(detector.shown) == 25 + 17, "every fourth, then those within 0.6 s of what the first look found"
    assert told == [(number + 1, 100) for number in range(100)]


def test_a_video_is_decoded_once_and_pictures_after_its_end_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    video = tmp_path / "walk.avi"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"MJPG"), 10, (320, 240))
    for level in LEVELS:
        writer.write(np.full((240, 320, 3), level, np.uint8))
    writer.release()
    decoded = list[bool]()

    class Counting:
        def __init__(self, *arguments: Any) -> None:
            self.video = VIDEO(*arguments)

        def grab(self) -> bool:
            decoded.append(self.video.grab())
            return decoded[-1]

        def __getattr__(self, name: str) -> Any:
            return getattr(self.video, name)

    monkeypatch.setattr(cv2, "VideoCapture", Counting)
    detector = Bright()
    found = search(Pictures(*ten_a_second(120), video=video, frame=np.arange(120)), [detector])
    assert decoded == [True] * 100 + [False]
    assert [each.time_ns for each in found.sightings] == [n * 100_000_000 for n in range(40, 45)]
    assert (found.pictures, found.missing) == (120, 5)
    assert len(detector.shown) == 25 + 17


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "no landmarks to search for"),
        (("--tags", "qr"), "one of apriltag-16h5"),
        (("--tags", "apriltag-36h11"), "needs --tag-side-m"),
        (("--images", "nowhere"), "nowhere"),
    ],
)
def test_wrong_usage_says_what_to_give(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    done = vislam2tag("sightings", tmp_path, *options)
    assert done.returncode == 2
    assert message in done.stderr

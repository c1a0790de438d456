"""Sessions in zips."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.sessions.companion_walks import OtherClock, write_sensor_logger
from tests.sessions.formats.app_recordings import APPS, POSITION
from tests.stores import Bucket
from tests.surveys import bytes_of, make_survey
from vislam2tag.pipeline.labels.attach import attach
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.inspection import inspect_survey
from vislam2tag.sessions.registry import at_hand, hash_inputs, open_survey, read_session


def packed(folder: Path, path: Path, within: str = "") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(each for each in folder.rglob("*") if each.is_file()):
            archive.write(file, f"{within}{file.relative_to(folder).as_posix()}")
    return path


@pytest.fixture(scope="module")
def unpacked_survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A walk whose readings are those of a second phone, tied to it."""
    survey = make_survey(tmp_path_factory.mktemp("zips") / "survey", devices=("LG",), seconds=70.0)
    walk = open_survey(survey).sessions[0].folder
    session = read_session(open_survey(survey).sessions[0])
    pixel = walk / "companions" / "pixel"
    write_sensor_logger(pixel, session, OtherClock(7.0, 0.0, int(session.camera.time_ns[0])))
    packed(pixel, pixel.with_suffix(".zip"))
    shutil.rmtree(pixel)
    attach(walk, pixel.with_suffix(".zip"))
    return survey


@pytest.fixture(scope="module")
def zipped_survey(unpacked_survey: Path) -> Path:
    """The same with the walk's own files in a zip, its companion in the folder beside."""
    survey = unpacked_survey.with_name("zipped")
    shutil.copytree(unpacked_survey, survey)
    walk = open_survey(survey).sessions[0].folder
    companions = walk / "companions"
    shutil.move(companions, survey / "aside")
    packed(walk, walk.with_name(f"{walk.name}.zip"), "recording/")
    shutil.rmtree(walk)
    walk.mkdir()
    shutil.move(survey / "aside", companions)
    return survey


@pytest.fixture(scope="module")
def labels(unpacked_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("labels") / "out"
    process(unpacked_survey, out)
    return out


def tables(labels: Path) -> dict[str, str]:
    return {name: of for name, of in bytes_of(labels).items() if name.endswith(".parquet")}


def test_a_zip_gives_the_labels_of_the_folder_that_it_holds(
    unpacked_survey: Path, zipped_survey: Path, labels: Path, tmp_path: Path
) -> None:
    before = bytes_of(zipped_survey)
    (folder,), (zipped,) = (open_survey(survey).sessions for survey in (unpacked_survey, zipped_survey))
    assert (zipped.key, zipped.slug, zipped.format) == (folder.key, folder.slug, folder.format)
    assert hash_inputs(zipped) == hash_inputs(folder)
    process(zipped_survey, tmp_path / "out")
    assert tables(tmp_path / "out") == tables(labels)
    assert any(name.startswith("sensors_pixel/") for name in tables(labels)), "with the companion's readings"
    assert bytes_of(zipped_survey) == before, "the zip stays as it is"
    outcomes: list[bool] = []
    process(zipped_survey, tmp_path / "out", progress=lambda outcome, _: outcomes.append(outcome.repeated))
    assert outcomes == [False]
    shutil.copytree(zipped_survey, tmp_path / "untied")
    (tie,) = (tmp_path / "untied").rglob("companions/pixel.json")
    tie.unlink()
    process(tmp_path / "untied", tmp_path / "out")
    assert not list(tmp_path.glob("out/sensors_pixel/*.parquet")), "labels of a companion go with its tie"


def test_companions_and_zips_in_a_store_are_read_as_on_disk(
    s3: Bucket, unpacked_survey: Path, zipped_survey: Path, labels: Path, tmp_path: Path
) -> None:
    for survey in (unpacked_survey, zipped_survey):
        stored = s3.upload(survey, f"{survey.name}-in-place")
        process(stored, Path(s3.store(f"{survey.name}-labels").address))
        assert tables(s3.download(f"{survey.name}-labels", tmp_path / survey.name)) == tables(labels)
    store = s3.store("survey-in-place")
    (tie,) = (each.name for each in store.list() if each.name.endswith("companions/pixel.json"))
    changed = json.loads(bytes(store.get(tie).data))  # type: ignore[union-attr]
    store.put(tie, json.dumps(changed | {"lever_arm_m": 2.0}).encode())
    outcomes: list[bool] = []
    process(
        Path(store.address),
        Path(s3.store("survey-labels").address),
        progress=lambda outcome, _: outcomes.append(outcome.repeated),
    )
    assert outcomes == [True], "another tie gives other labels"
    readings = pl.read_parquet(s3.download("survey-labels", tmp_path / "again") / "sensors_pixel" / "*.parquet")
    assert float(np.nanmin(readings["sigma"].drop_nulls().to_numpy())) > 1.0
    store.delete([tie])
    process(Path(store.address), Path(s3.store("survey-labels").address))
    assert not any(each.name.startswith("sensors_pixel/") for each in s3.store("survey-labels").list())


def test_sightings_and_ties_of_a_zip_lie_beside_it(tmp_path: Path) -> None:
    device = tmp_path / "survey" / "floor_2" / "iPhone"
    device.mkdir(parents=True)
    recording = tmp_path / "recording"
    recording.mkdir()
    APPS["Polycam"][1](recording)
    packed(recording, device / "scan.1.zip", "some scan/")
    (device / "scan.1").mkdir()
    (device / "scan.1" / "sightings.csv").write_text("7; 500000000000; 0; 0; -1; 0; 0; 0; 1; 0.02\n", encoding="utf-8")
    (ref,) = open_survey(tmp_path / "survey").sessions
    session = read_session(ref)
    np.testing.assert_allclose(session.camera.position_acs, POSITION, atol=1e-6)
    assert session.landmarks.ids == ("7",)
    with at_hand(ref, whole=True) as here:
        assert here.own == device / "scan.1"
        assert not here.folder.is_relative_to(tmp_path)
    found = vislam2tag("sightings", tmp_path / "survey", "--tags", "apriltag-36h11", "--tag-side-m", "0.2", "--replace")
    assert "it has no pictures" in found.stderr


def test_zips_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    device = tmp_path / "survey" / "floor_2" / "iPhone"
    device.mkdir(parents=True)
    for name in ("good", "flipped", "twice"):
        recording = tmp_path / name
        recording.mkdir()
        APPS["ios_logger"][1](recording)
        packed(recording, device / f"{name}.zip")
    flipped = bytearray((device / "flipped.zip").read_bytes())
    flipped[200] ^= 0xFF
    (device / "flipped.zip").write_bytes(bytes(flipped))
    (device / "half.zip").write_bytes((device / "good.zip").read_bytes()[:500])
    shutil.copytree(tmp_path / "twice", device / "twice")
    (tmp_path / "notes.txt").write_text("hello", encoding="utf-8")
    with zipfile.ZipFile(device / "notes.zip", "w") as archive:
        archive.write(tmp_path / "notes.txt", "notes.txt")
    shown = inspect_survey(tmp_path / "survey")
    assert [each.session for each in shown.sessions] == ["flipped", "good", "twice"]
    errors = {each.session: each.error or "" for each in shown.sessions}
    assert "flipped.zip: cannot be unpacked" in errors["flipped"]
    assert not errors["good"]
    said = {each.file: each.message for each in shown.findings}
    assert "the zip file cannot be read" in said["floor_2/iPhone/half.zip"]
    assert "no known recording" in said["floor_2/iPhone/notes.zip"]
    assert "the folder twice next to it is already a session" in said["floor_2/iPhone/twice.zip"]

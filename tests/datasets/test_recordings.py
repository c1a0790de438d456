"""Recordings that are given to ``import``: one message with the command to run."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.format_registry import import_format_of
from vislam2tag.datasets.recordings import command_for

POSES = "1000000000; 0.1; 1.4; 0.2; 0.0; 0.0; 0.0; 1.0\n"
WIFI = "1; 639095472; WLAN; net; 02:1a:00:00:00:01; -60\n"


def session(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "poses.csv").write_text(POSES)
    (folder / "wifi.csv").write_text(WIFI)
    return folder


def refusal(path: Path) -> str:
    with pytest.raises(DatasetError) as caught:
        import_format_of(path)
    return str(caught.value)


def test_a_session_folder_is_received_or_attached(tmp_path: Path) -> None:
    folder = session(tmp_path / "my walk")
    said = refusal(folder)
    assert f"vislam2tag attach WALK '{folder}'" in said
    assert "vislam2tag receive SURVEY 'my walk.zip'" in said
    assert refusal(folder / "wifi.csv").startswith(f"{folder / 'wifi.csv'}: it is a file of the recording {folder}")


def test_a_zip_of_a_session_is_received(tmp_path: Path) -> None:
    session(tmp_path / "walk")
    packed = Path(shutil.make_archive(str(tmp_path / "packed"), "zip", tmp_path / "walk"))
    assert f"vislam2tag receive SURVEY {packed}. Without poses: vislam2tag attach WALK {packed}" in refusal(packed)


def test_a_survey_its_sessions_and_its_archive_become_data_sets(tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    walk = session(survey / "floor_-1" / "phone" / "walk")
    for path in (survey, walk):
        assert f"vislam2tag dataset {survey} --out OUT" in refusal(path)
    packed = Path(shutil.make_archive(str(tmp_path / "packed"), "zip", tmp_path, "survey"))
    assert "an archive of a survey; unpack it and run: vislam2tag dataset FOLDER --out OUT" in refusal(packed)


def test_a_sensor_loggers_recording_is_attached(tmp_path: Path) -> None:
    (tmp_path / "Metadata.csv").write_text("version,platform\n3,ios\n")
    (tmp_path / "Accelerometer.csv").write_text("time,seconds_elapsed,z,y,x\n1700000000000000000,0.1,1,2,3\n")
    assert f"(format sensor-logger), not a data set. With poses: copy it to SURVEY/floor_K/DEVICE/{tmp_path.name}" in (
        refusal(tmp_path)
    )


def test_a_log_with_times_is_labelled(tmp_path: Path) -> None:
    path = tmp_path / "co2.txt"
    path.write_text("Time Stamp|co2\n2024-05-01T09:14:01Z|412\n2024-05-01T09:14:02Z|415\n")
    said = refusal(path)
    assert f"vislam2tag label {path} --labels LABELS" in said
    assert f"vislam2tag attach WALK {path}" in said


def test_other_files_are_no_recordings(tmp_path: Path) -> None:
    notes = tmp_path / "notes.txt"
    notes.write_text("some notes\nof a, survey\n")
    assert command_for(notes) is None
    assert command_for(tmp_path) is None
    assert "not in a known format" in refusal(notes)

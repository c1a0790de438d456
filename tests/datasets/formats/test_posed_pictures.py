"""Pictures with poses in the building, read back by small readers of the layouts and compared with the truth."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from tests.preparation.rendered_walk import SIZE_PX as VIDEO_PX
from tests.preparation.rendered_walk import Walk, write_stray_scanner
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.pipeline.datasets.import_export import ExportOptions, export
from vislam2tag.pipeline.labels.process import process

SIZE_PX = (96, 72)
LENS = {"fx": 80.0, "fy": 81.0, "cx": 48.0, "cy": 36.0}
TIME_S = 500 + np.arange(240) / 4
ALONG = np.linspace(0, 4 * np.pi, 240)
POSITION_ACS = np.column_stack((6 * np.sin(ALONG), 1.4 + 0.02 * np.sin(9 * ALONG), 4 * np.cos(ALONG)))
TURN_ACS = Rotation.from_euler("yx", np.column_stack((ALONG, 0.1 * np.cos(3 * ALONG))))
LANDMARKS_ACS = np.array(((7.0, 1.5, 0.0), (0.0, 1.6, 5.0), (-7.0, 1.4, 0.0), (0.0, 1.5, -5.0)))
UP_FROM_Y = Rotation.from_euler("x", 90, degrees=True)
"""From a frame with y up to one with z up."""
BCS_FROM_ACS = Rotation.from_euler("z", 0.4) * UP_FROM_Y
SHIFT_M = np.array((20.0, 12.0, 0.0))
ELEVATION_M = 7.5


def to_bcs(points: FloatArray) -> FloatArray:
    return np.asarray(BCS_FROM_ACS.apply(points) + SHIFT_M)


def write_survey(root: Path, *, heights: bool = True) -> Path:
    """One walk that Polycam recorded past four landmarks, with a picture for each frame."""
    session = root / "floor_2" / "iPad" / "walk"
    cameras, images = session / "keyframes" / "cameras", session / "keyframes" / "images"
    cameras.mkdir(parents=True)
    images.mkdir()
    for i, t in enumerate(TIME_S.tolist()):
        matrix = np.column_stack((TURN_ACS[i].as_matrix(), POSITION_ACS[i]))
        values = {f"t_{row}{column}": matrix[row, column] for row in range(3) for column in range(4)}
        lens = LENS if i < 100 else {**LENS, "fx": 82.0}
        stamp = round(t * 1e6)
        (cameras / f"{stamp}.json").write_text(json.dumps({"timestamp": stamp, **values, **lens}), encoding="utf-8")
        Image.new("RGB", SIZE_PX).save(images / f"{stamp}.jpg")
    rows = []
    for number, landmark in enumerate(LANDMARKS_ACS):
        close = np.linalg.norm(POSITION_ACS - landmark, axis=1) < 2.5
        for i in np.flatnonzero(close).tolist():
            offset = TURN_ACS[i].inv().apply(landmark - POSITION_ACS[i])
            turn = TURN_ACS[i].inv().as_quat()
            numbers = "; ".join(f"{value:.6f}" for value in (*offset, *turn, 0.01))
            rows.append(f"{number}; {round(TIME_S[i] * 1e9)}; {numbers}\n")
    (session / "sightings.csv").write_text("".join(rows), encoding="utf-8")
    (root / "floor_dimensions.csv").write_text(
        f"id,width,height,elevation\n2,40,25,{ELEVATION_M if heights else ''}\n", encoding="utf-8"
    )
    places = [f"{number},{x:.4f},{y:.4f},{z:.4f}" for number, (x, y, z) in enumerate(to_bcs(LANDMARKS_ACS))]
    (root / "floor_2" / "marker_dict.csv").write_text("\n".join(("id,x,y,z", *places, "")), encoding="utf-8")
    return root


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_survey(tmp_path_factory.mktemp("pictures") / "survey")


@pytest.fixture(scope="module")
def labels(survey: Path) -> Path:
    out = survey.with_name("labels")
    process(survey, out)
    return out


def lines(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def written(name: str, labels: Path, survey: Path, out: Path) -> Path:
    record = export(labels, out, name, ExportOptions(survey=survey))
    assert not {each.kind for each in record.findings} & {"sessions_without_pictures", "pictures_without_pose"}
    return out / "floor_2"


def check(survey: Path, names: list[str], centres: FloatArray, to_world: Rotation) -> None:
    """Compare cameras (with y down) with the truth of the pictures that they name."""
    stamps = [int(Path(name).stem) for name in names]
    assert all((survey / name).is_file() for name in names)
    at = [int(np.flatnonzero(np.rint(TIME_S * 1e6) == stamp)[0]) for stamp in stamps]
    assert len(at) > 200
    assert np.abs(centres - to_bcs(POSITION_ACS[at]) - (0, 0, ELEVATION_M)).max() < 0.05
    ahead = (BCS_FROM_ACS * TURN_ACS[at]).apply((0, 0, -1))
    down = (BCS_FROM_ACS * TURN_ACS[at]).apply((0, -1, 0))
    assert np.abs(to_world.apply((0, 0, 1)) - ahead).max() < 0.02
    assert np.abs(to_world.apply((0, 1, 0)) - down).max() < 0.02


def poses(rows: list[list[str]]) -> tuple[Rotation, FloatArray]:
    numbers = np.array(rows, np.float64)
    return Rotation.from_quat(numbers[:, (1, 2, 3, 0)]), numbers[:, 4:7]


def test_colmap(survey: Path, labels: Path, tmp_path: Path) -> None:
    folder = written("colmap", labels, survey, tmp_path / "out")
    cameras = {row[0]: row[1:] for row in (line.split() for line in lines(folder / "cameras.txt"))}
    assert sorted(cameras.values()) == [["PINHOLE", "96", "72", fx, "81", "48", "36"] for fx in ("80", "82")]
    images = lines(folder / "images.txt")
    assert set(images[1::2]) == {""}  # the points of each image
    rows = [line.split(" ", 9) for line in images[::2]]
    assert [row[0] for row in rows] == [str(number) for number in range(1, len(rows) + 1)]
    turn, shift = poses([row[1:8] for row in rows])
    check(survey, [row[9] for row in rows], -turn.inv().apply(shift), turn.inv())
    later = [int(Path(row[9]).stem) >= round(TIME_S[100] * 1e6) for row in rows]
    assert [cameras[row[8]][3] for row in rows] == ["82" if each else "80" for each in later]
    assert lines(folder / "points3D.txt") == []
    covariances = [line.split(", ") for line in lines(folder / "covariances.txt")]
    assert [row[0] for row in covariances] == [row[9] for row in rows]
    variances = np.array([row[1:] for row in covariances], np.float64)
    assert (variances[:, (0, 2)] > 0).all()
    assert (variances[:, (0, 2)] < 0.2**2).all()


def test_kapture(survey: Path, labels: Path, tmp_path: Path) -> None:
    folder = written("kapture", labels, survey, tmp_path / "out") / "sensors"
    for name in ("sensors.txt", "trajectories.txt", "records_camera.txt"):
        assert (folder / name).read_text(encoding="utf-8").startswith("# kapture format: 1.1\n")
    sensors = {row[0]: row[1:] for row in (line.split(", ") for line in lines(folder / "sensors.txt"))}
    assert sorted(sensors.values()) == [
        ["", "camera", "PINHOLE", "96", "72", fx, "81", "48", "36"] for fx in ("80", "82")
    ]
    rows = [line.split(", ") for line in lines(folder / "trajectories.txt")]
    records = [line.split(", ") for line in lines(folder / "records_camera.txt")]
    assert [row[:2] for row in rows] == [row[:2] for row in records]
    assert {row[1] for row in rows} == set(sensors)
    turn, shift = poses([row[2:] for row in rows])
    check(survey, [row[2] for row in records], -turn.inv().apply(shift), turn.inv())


def test_lamar(survey: Path, labels: Path, tmp_path: Path) -> None:
    (folder,) = (written("lamar", labels, survey, tmp_path / "out") / "sessions").iterdir()
    rows = [line.split(", ") for line in lines(folder / "trajectories.txt")]
    images = [line.split(", ") for line in lines(folder / "images.txt")]
    assert [row[:2] for row in rows] == [row[:2] for row in images]
    turn, centre = poses([row[2:] for row in rows])
    check(survey, [row[2] for row in images], centre, turn)


@pytest.mark.parametrize("name", ["colmap", "kapture", "lamar"])
def test_the_same_labels_give_the_same_bytes(name: str, survey: Path, labels: Path, tmp_path: Path) -> None:
    first, second = (written(name, labels, survey, tmp_path / each) for each in "ab")
    assert {file.relative_to(first): file.read_bytes() for file in first.rglob("*.txt")} == {
        file.relative_to(second): file.read_bytes() for file in second.rglob("*.txt")
    }


def test_what_is_missing_is_said(survey: Path, labels: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="pass it with --survey"):
        export(labels, tmp_path / "out", "colmap")
    flat = write_survey(tmp_path / "flat", heights=False)
    process(flat, tmp_path / "labels")
    with pytest.raises(DatasetError, match="240 pictures has a pose with a height"):
        export(tmp_path / "labels", tmp_path / "out", "kapture", ExportOptions(survey=flat))
    shutil.copytree(survey, tmp_path / "bare")
    shutil.rmtree(tmp_path / "bare" / "floor_2" / "iPad" / "walk" / "keyframes" / "images")
    with pytest.raises(DatasetError, match="none of its sessions has pictures"):
        export(labels, tmp_path / "out", "lamar", ExportOptions(survey=tmp_path / "bare"))
    assert not (tmp_path / "out").exists()


def test_pictures_that_cannot_be_read_have_their_reason(survey: Path, labels: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "damaged")
    for picture in (tmp_path / "damaged").rglob("images/*"):
        picture.write_bytes(b"no picture")
    with pytest.raises(
        DatasetError, match=r"the pictures of 1 of its sessions cannot be read, .*cannot identify image"
    ):
        export(labels, tmp_path / "out", "lamar", ExportOptions(survey=tmp_path / "damaged"))


def test_raw_files_that_have_changed_are_refused(survey: Path, labels: Path, tmp_path: Path) -> None:
    shutil.copytree(survey, tmp_path / "changed")
    with next((tmp_path / "changed").rglob("sightings.csv")).open("a", encoding="utf-8") as file:
        file.write("\n")
    with pytest.raises(UsageError, match=r"sightings.csv has changed since the labels were made"):
        export(labels, tmp_path / "out", "colmap", ExportOptions(survey=tmp_path / "changed"))


@pytest.mark.parametrize(("name", "device"), [("colmap", "my iPad"), ("kapture", "iPad,2"), ("lamar", "iPad,2")])
def test_names_that_a_layout_would_cut_are_refused(name: str, device: str, tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    (survey / "floor_2" / "iPad").rename(survey / "floor_2" / device)
    process(survey, tmp_path / "labels")
    with pytest.raises(DatasetError, match="the layout separates fields by"):
        export(tmp_path / "labels", tmp_path / "out", name, ExportOptions(survey=survey))


def test_frames_of_a_video_are_named_as_they_can_be_extracted(tmp_path: Path) -> None:
    walk, places = Walk.round_the_room(0.5), {"a": (7.0, 1.0, 1.4), "b": (11.0, 5.0, 1.4)}
    session = tmp_path / "survey" / "floor_0" / "iPhone" / "walk"
    write_stray_scanner(session, walk, [])
    rows = []
    for time_s in walk.time_s.tolist():
        where, bcs_r_camera = walk.camera(time_s)
        for landmark, place in places.items():
            if np.linalg.norm(place - where) < 3:
                offset, turn = bcs_r_camera.T @ (place - where), Rotation.from_matrix(bcs_r_camera.T).as_quat()
                numbers = "; ".join(f"{value:.6f}" for value in (*offset, *turn, 0.01))
                rows.append(f"{landmark}; {round(time_s * 1e9)}; {numbers}\n")
    (session / "sightings.csv").write_text("".join(rows), encoding="utf-8")
    root = tmp_path / "survey"
    (root / "floor_dimensions.csv").write_text("id,width,height,elevation\n0,12,8,0\n", encoding="utf-8")
    (root / "floor_0" / "marker_dict.csv").write_text("id,x,y,z\na,7,1,1.4\nb,11,5,1.4\n", encoding="utf-8")
    process(root, tmp_path / "labels")
    record = export(tmp_path / "labels", tmp_path / "out", "colmap", ExportOptions(survey=root))
    (finding,) = (each for each in record.findings if each.kind == "pictures_in_video")
    assert "ffmpeg -i floor_0/iPhone/walk/rgb.mp4" in finding.message
    images = lines(tmp_path / "out" / "floor_0" / "images.txt")
    assert images[0].endswith(" floor_0/iPhone/walk/rgb/000000.jpg")
    (camera,) = lines(tmp_path / "out" / "floor_0" / "cameras.txt")
    assert camera.split()[1:4] == ["PINHOLE", *map(str, VIDEO_PX)]

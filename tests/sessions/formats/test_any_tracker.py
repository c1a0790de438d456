"""Poses of any tracker."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

from tests.sessions.formats.app_recordings import POSITION, TIME_S, TURN, mcap
from vislam2tag.common.errors import SessionError
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import read_session
from vislam2tag.site.model import SessionKey, SessionRef

POSE = "foxglove.PoseInFrame"
FIELDS = {
    "foxglove.Stamp": {"seconds": FieldDescriptorProto.TYPE_INT64, "nanos": FieldDescriptorProto.TYPE_INT32},
    "foxglove.Vector3": dict.fromkeys("xyz", FieldDescriptorProto.TYPE_DOUBLE),
    "foxglove.Quaternion": dict.fromkeys("xyzw", FieldDescriptorProto.TYPE_DOUBLE),
    "foxglove.Pose": {"position": "foxglove.Vector3", "orientation": "foxglove.Quaternion"},
    POSE: {"timestamp": "foxglove.Stamp", "frame_id": FieldDescriptorProto.TYPE_STRING, "pose": "foxglove.Pose"},
}


def read(folder: Path) -> Session:
    return read_session(SessionRef(SessionKey(1, "robot", "walk"), folder, "mcap", "slug"))


def descriptors() -> FileDescriptorSet:
    """What Foxglove's SDK puts into a file as the schema of PoseInFrame."""
    file = FileDescriptorProto(name="foxglove/PoseInFrame.proto", package="foxglove", syntax="proto3")
    for name, fields in FIELDS.items():
        message = file.message_type.add(name=name.rpartition(".")[2])
        for number, (field, kind) in enumerate(fields.items(), start=1):
            one = message.field.add(name=field, number=number, label=FieldDescriptorProto.LABEL_OPTIONAL)
            if isinstance(kind, str):
                one.type, one.type_name = FieldDescriptorProto.TYPE_MESSAGE, f".{kind}"
            else:
                one.type = kind
    return FileDescriptorSet(file=[file])


def write_protobuf(folder: Path, *topics: str) -> None:
    content = descriptors()
    pool = DescriptorPool()
    pool.Add(content.file[0])
    message = GetMessageClass(pool.FindMessageTypeByName(POSE))
    with (folder / "poses.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=1000)
        writer.start()
        schema = writer.register_schema(POSE, "protobuf", content.SerializeToString())
        for topic in topics:
            channel = writer.register_channel(topic, "protobuf", schema)
            for i, t in enumerate(TIME_S.tolist()):
                time_ns = round(t * 1e9)
                pose = {
                    "position": dict(zip("xyz", POSITION[i].tolist(), strict=True)),
                    "orientation": dict(zip("xyzw", TURN[i].as_quat().tolist(), strict=True)),
                }
                stamp = {"seconds": time_ns // 10**9, "nanos": time_ns % 10**9}
                data = message(timestamp=stamp, frame_id="map", pose=pose).SerializeToString()
                writer.add_message(channel, time_ns, data, time_ns)
        writer.finish()
    (folder / "poses.toml").write_text('camera = "y-up"\nframe = "y-up"\n', encoding="utf-8")


def test_poses_in_protobuf(tmp_path: Path) -> None:
    write_protobuf(tmp_path, "/pose")
    camera = read(tmp_path).camera
    np.testing.assert_allclose(camera.position_acs, POSITION, atol=1e-9)
    np.testing.assert_allclose(camera.time_ns * 1e-9, TIME_S, atol=1e-6)


def test_of_several_topics_one_must_be_named(tmp_path: Path) -> None:
    write_protobuf(tmp_path, "/left", "/right")
    with pytest.raises(SessionError, match=r'has poses of /left, /right: choose one in poses\.toml, topic = "/left"'):
        read(tmp_path)
    with (tmp_path / "poses.toml").open("a") as file:
        file.write('topic = "/right"\n')
    assert len(read(tmp_path).camera.time_ns) == len(TIME_S)


def test_a_file_that_is_cut_off_keeps_what_came_before(tmp_path: Path) -> None:
    write_protobuf(tmp_path, "/pose")
    path = tmp_path / "poses.mcap"
    path.write_bytes(path.read_bytes()[:3000])
    session = read(tmp_path)
    assert 5 < len(session.camera.time_ns) < len(TIME_S)
    assert "partial_last_line" in {each.kind for each in session.findings}


def test_a_file_without_poses_is_named(tmp_path: Path) -> None:
    mcap(tmp_path)
    path = tmp_path / "poses.mcap"
    path.write_bytes(b"no mcap at all")
    with pytest.raises(SessionError, match=r"contains no message of foxglove.PoseInFrame \(InvalidMagic"):
        read(tmp_path)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.Log", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/log", "json", schema), 1, b"{}", 1)
        writer.finish()
    with pytest.raises(SessionError, match=r"it contains foxglove\.Log: record poses with this schema"):
        read(tmp_path)


@pytest.mark.parametrize("unit_s", [1e-9, 1e-3])
def test_times_of_tum_poses_in_another_unit_are_recognised(tmp_path: Path, unit_s: float) -> None:
    lines = [f"{(1_700_000_000 + i / 30) / unit_s:.0f} {0.05 * i} 1.4 0 0 0 0 1" for i in range(60)]
    (tmp_path / "poses.tum").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "poses.toml").write_text('camera = "y-up"\nframe = "y-up"\n', encoding="utf-8")
    session = read_session(SessionRef(SessionKey(1, "robot", "walk"), tmp_path, "tum", "slug"))
    assert "time_unit" in {each.kind for each in session.findings}
    assert np.ptp(session.camera.time_ns) * 1e-9 == pytest.approx(59 / 30, abs=0.002)


def walk(folder: Path, file: str, fields: str, header: str = "", unit: float = 1.0, separator: str = " ") -> Session:
    """Round a block, looking ahead, of a camera with y up in a frame with z up; ``fields`` name the columns."""
    along = np.arange(0, 60, 0.1)
    corner = np.array(((0, 0), (15, 0), (15, 10), (0, 10), (0, 0)), np.float64)
    at = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(corner, axis=0), axis=1))))
    x, z = (np.interp(along % at[-1], at, corner[:, i]) for i in (0, 1))
    heading = np.arctan2(-np.gradient(x), -np.gradient(z))
    turn = Rotation.from_euler("x", 90, degrees=True) * Rotation.from_euler("y", heading[:, None])
    columns = dict(zip("abcd", turn.as_quat().T, strict=True)) | {"x": x, "y": -z, "z": 0 * x, "0": 0 * x}
    times = [f"{(1_700_000_000 + t) / unit:.0f}" if unit < 1 else f"{1_700_000_000 + t:.3f}" for t in along.tolist()]
    rows = [
        separator.join(times[i] if name == "t" else f"{columns[name][i]:.9f}" for name in fields)
        for i in range(len(along))
    ]
    (folder / file).write_text(header + "\n".join(rows) + "\n", encoding="utf-8")
    session = read_session(SessionRef(SessionKey(1, "robot", "walk"), folder, "tum", "slug"))
    np.testing.assert_allclose(session.camera.position_acs[:, 0], x, atol=1e-6)
    np.testing.assert_allclose(session.camera.position_acs[:, 2], z, atol=1e-6)
    assert np.ptp(session.camera.time_ns) * 1e-9 == pytest.approx(59.9, abs=0.002)
    return session


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-6, 1e-9])
def test_axes_are_found_by_plausibility_in_every_unit_of_time(tmp_path: Path, unit: float) -> None:
    session = walk(tmp_path, "poses.tum", "txyzabcd", unit=unit)
    (found,) = (each for each in session.findings if each.kind == "columns_guessed")
    assert 'camera = "y-up" and frame = "z-up"' in found.message


def test_layouts_of_other_programs(tmp_path: Path) -> None:
    walk(tmp_path, "poses.tum", "txyzabcd0", "#timestamp x y z qx qy qz qw id\n")
    walk(tmp_path, "poses.tum", "txyzabcd0", "timestamp,x,y,z,qx,qy,qz,qw,id\n", separator=",")
    walk(tmp_path, "poses.tum", "txyzabcd0")
    walk(tmp_path, "poses.tum", "txyzdabc")
    walk(tmp_path, "poses.tum", "tdabcxyz", "t qw qx qy qz x y z\n")
    (tmp_path / "poses.tum").unlink()
    walk(tmp_path, "poses_euroc.csv", "txyzdabc" + "0" * 9, unit=1e-9, separator=",")
    walk(tmp_path, "poses_euroc.csv", "txyzabcd", unit=1e-9, separator=",")


def test_other_columns_are_named_with_the_expected_ones(tmp_path: Path) -> None:
    (tmp_path / "poses.tum").write_text("time,lat,lon\n1,2,3\n", encoding="utf-8")
    with pytest.raises(SessionError, match=r"found 3 columns \(time, lat, lon\); expected time x y z qx qy qz qw"):
        read_session(SessionRef(SessionKey(1, "robot", "walk"), tmp_path, "tum", "slug"))

"""Zips that other apps share are recognised, bounded and filed whole."""

from __future__ import annotations

import hashlib
import io
import json
import stat
import struct
import warnings
import zipfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.cli.command import the_error, vislam2tag
from tests.sessions.formats.app_recordings import APPS
from tests.studio.receiving.zips import HEADER, SESSION, packed, record, session_files, session_zip, sums
from tests.surveys import bytes_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.sessions.registry import format_of
from vislam2tag.studio.receiving.uploads import Uploads, file_zip, is_filed
from vislam2tag.studio.receiving.zips import AppPlace, RefusedZipError, unpack

PLENTY = 1_000_000


def unpacked(tmp_path: Path, data: bytes, most: int = PLENTY) -> Path:
    path = tmp_path / "session.zip"
    path.write_bytes(data)
    unpack(path, Folder.at(tmp_path / "out"), most)
    return tmp_path / "out"


def test_a_session_comes_out_as_it_went_in(tmp_path: Path) -> None:
    folder = unpacked(tmp_path, session_zip())
    files = session_files()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == files | {"SHA256SUMS": sums(files)}


def test_stored_entries_and_a_folder_entry_are_fine(tmp_path: Path) -> None:
    files = session_files()
    entries = {f"{SESSION}/": b"", **{f"{SESSION}/{name}": files[name] for name in files}}
    data = packed(entries | {f"{SESSION}/SHA256SUMS": sums(files)}, zipfile.ZIP_STORED)
    assert (unpacked(tmp_path, data) / "session.json").is_file()


@pytest.mark.parametrize(
    "name",
    [
        "../evil.csv",
        f"{SESSION}/../../evil.csv",
        f"{SESSION}/sub/Sensors.csv",
        "/etc/passwd",
        f"{SESSION}\\..\\evil.csv",
        "C:\\evil.csv",
        f"{SESSION}/evil.sh",
        f"{SESSION}/.hidden",
        f"{SESSION}/Sensors.csv\x00.png",
        "Sensors.csv",
        "",
    ],
)
def test_names_that_no_session_has_are_refused(tmp_path: Path, name: str) -> None:
    files = session_files()
    entries = {f"{SESSION}/{each}": files[each] for each in files} | {f"{SESSION}/SHA256SUMS": sums(files)}
    with pytest.raises(RefusedZipError):
        unpacked(tmp_path, packed(entries | {name: b"evil"}))
    assert not list(tmp_path.rglob("*evil*"))


def special(kind: int) -> bytes:
    """A zip whose entry is a link or the like."""
    entry = zipfile.ZipInfo(f"{SESSION}/Sensors.csv")
    entry.external_attr = (kind | 0o777) << 16
    return packed({entry: b"/etc/passwd"})


def doubled() -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return packed({zipfile.ZipInfo(f"{SESSION}/WiFi.csv"): content for content in (b"1", b"2")})


def encrypted() -> bytes:
    data = bytearray(session_zip())
    data[data.index(b"PK\x01\x02") + 8] |= 1
    return bytes(data)


def without(name: str) -> bytes:
    files = session_files() | {"SHA256SUMS": sums(session_files())}
    return packed({f"{SESSION}/{each}": content for each, content in files.items() if each != name})


SPECIAL = (stat.S_IFLNK, stat.S_IFDIR, stat.S_IFCHR, stat.S_IFIFO)
FOLDERS = ("..", ".", "session", "2021-12-20T13:25:23", " 2021-12-20T132523")
SUMS = (b"", b"abc  session.json\n", sums(session_files()) * 2, b"\xff\xfe")
REFUSED = {
    "two folders": (packed({f"{SESSION}/Sensors.csv": b"", "2022-12-20T132523/WiFi.csv": b""}), "one folder"),
    **{f"folder {name!r}": (session_zip(folder=name), "one folder") for name in FOLDERS},
    "double": (doubled(), "twice"),
    **{
        f"special {kind:o}": (special(kind), "link")
        for kind in (stat.S_IFLNK, stat.S_IFDIR, stat.S_IFCHR, stat.S_IFIFO)
    },
    "encrypted": (encrypted(), "encrypted"),
    "too large": (session_zip(session_files() | {"Sensors.csv": bytes(10 * PLENTY)}), "unpacks to more"),
    "very many": (packed({f"{SESSION}/{number}": b"" for number in range(2000)}), "more files"),
    "empty": (b"", "the zip"),
    "no zip": (b"no zip", "the zip"),
    "without its end": (session_zip()[:-30], "the zip"),
    "without its start": (session_zip()[20:], "the zip"),
    "another checksum": (session_zip(ControlPoint_csv=HEADER + b"1,0,press\n"), r"checksum of ControlPoint\.csv"),
    "not in the list": (session_zip(Sensors_csv=b"time_ns,sensor\n"), "SHA256SUMS"),
    **{f"sums {text[:4]!r}": (session_zip(SHA256SUMS=text), "SHA256SUMS") for text in SUMS},
    **{f"without {name}": (without(name), name) for name in ("session.json", "SHA256SUMS")},
    "record no JSON": (session_zip({"session.json": record()[:-5]}), r"session\.json"),
}
"""Zips that are no session, and what their refusal says."""


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_session_is_refused_and_told_why(tmp_path: Path, case: str) -> None:
    data, told = REFUSED[case]
    assert len(data) < PLENTY
    with pytest.raises(RefusedZipError, match=told):
        unpacked(tmp_path, data)


def test_a_zip_that_hides_how_large_it_is_is_refused(tmp_path: Path) -> None:
    bomb = bytearray(session_zip(session_files() | {"Sensors.csv": bytes(10 * PLENTY)}))
    for at in (at for at in range(len(bomb)) if bomb[at : at + 4] == b"PK\x01\x02"):
        size = struct.unpack_from("<L", bomb, at + 24)[0]
        if size == 10 * PLENTY:
            struct.pack_into("<L", bomb, at + 24, 10)
    with pytest.raises(RefusedZipError):
        unpacked(tmp_path, bytes(bomb))
    assert sum(path.stat().st_size for path in (tmp_path / "out").iterdir()) <= PLENTY


def zip64_end(data: bytes, directory_bytes: int, directory_at: int) -> bytes:
    """A zip whose end says in ZIP64's words where its directory is, and lies in the usual ones."""
    end = data.rindex(b"PK\x05\x06")
    record = struct.pack("<4sQHHLLQQQQ", b"PK\x06\x06", 44, 45, 45, 0, 0, 9, 9, directory_bytes, directory_at)
    locator = struct.pack("<4sLQL", b"PK\x06\x07", 0, end, 1)
    return data[:end] + record + locator + data[end : end + 8] + b"\1\0\1\0" + bytes(8) + data[end + 20 :]


def test_zip64_s_word_for_a_large_directory_is_not_believed(tmp_path: Path) -> None:
    data = packed({f"{SESSION}/{number}": b"" for number in range(2000)})
    at = data.index(b"PK\x01\x02")
    forged = zip64_end(data, data.rindex(b"PK\x05\x06") - at, at)
    (tmp_path / "forged.zip").write_bytes(forged)
    with zipfile.ZipFile(tmp_path / "forged.zip") as archive:
        assert len(archive.infolist()) == 2000  # so reads the library
    with pytest.raises(RefusedZipError, match="more files"):
        unpacked(tmp_path, forged)


def test_zip64_s_word_for_a_far_entry_is_not_believed(tmp_path: Path) -> None:
    data = session_zip()
    at, end = data.index(b"PK\x01\x02"), data.rindex(b"PK\x05\x06")
    name = struct.unpack_from("<H", data, at + 28)[0]
    entry = bytearray(data[at : at + 46 + name])
    struct.pack_into("<H", entry, 30, 12)
    struct.pack_into("<L", entry, 42, 0xFFFFFFFF)
    directory = bytes(entry) + struct.pack("<HHQ", 1, 8, 2**63 - 1) + data[at + 46 + name : end]
    tail = bytearray(data[end:])
    struct.pack_into("<L", tail, 12, len(directory))
    with pytest.raises(RefusedZipError, match="incomplete"):
        unpacked(tmp_path, data[:at] + directory + bytes(tail))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"end": None}, "still being recorded"),
        ({"session": "2022-01-01T000000"}, "belongs to session"),
        ({"version": 2}, "update"),
        ({"floor": "ground"}, "floor"),
        ({"device": "../LG"}, "device"),
        ({"device": ".hidden"}, "device"),
        ({"device": "LG/x"}, "device"),
        ({"device": "LG."}, "device"),
        ({"device": "LG "}, "device"),
        ({"device": "CON"}, "Windows"),
        ({"device": "nul"}, "Windows"),
        ({"device": "Aux.phone"}, "Windows"),
        ({"device": ""}, "device"),
        ({"device": "a" * 65}, "device"),
        ({"format": "other"}, "format"),
    ],
)
def test_records_that_cannot_be_filed_are_refused(tmp_path: Path, changes: dict[str, object], told: str) -> None:
    with pytest.raises(RefusedZipError, match=told):
        unpacked(tmp_path, session_zip(session_files(**changes)))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)
@given(at=st.integers(0, len(session_zip()) - 1), value=st.integers(0, 255))
def test_any_changed_byte_is_refused_or_harmless(tmp_path: Path, at: int, value: int) -> None:
    data = bytearray(session_zip())
    data[at] = value
    path = tmp_path / "changed.zip"
    path.write_bytes(bytes(data))
    folder = tmp_path / f"{at}-{value}"
    try:
        unpack(path, Folder.at(folder), PLENTY)
    except RefusedZipError:
        return
    files = session_files()
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == files | {"SHA256SUMS": sums(files)}
    for each in folder.iterdir():
        each.unlink()
    folder.rmdir()


PLENTY_FOR_APPS = 10_000_000
SHARED = [app for app in APPS if app not in ("TUM", "EuRoC", "MCAP", "Stray Scanner, lens of each frame")]


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    (tmp_path / "survey" / "floor_2").mkdir(parents=True)
    return tmp_path / "survey"


def shared_zip(app: str, folder: Path, within: str = "") -> Path:
    """A zip as the app shares it, its files at the top or in a folder."""
    recording = folder / "recording"
    recording.mkdir()
    APPS[app][1](recording)
    path = folder / "walk-1.zip"
    files = {
        f"{within}{file.relative_to(recording).as_posix()}": file for file in recording.rglob("*") if file.is_file()
    }
    path.write_bytes(packed({name: file.read_bytes() for name, file in files.items()}))
    return path


@pytest.mark.parametrize("app", SHARED)
def test_each_app_is_filed_where_the_survey_has_its_floor(app: str, survey: Path, tmp_path: Path) -> None:
    path = shared_zip(app, tmp_path)
    done = file_zip(survey, path, PLENTY_FOR_APPS)
    assert (done.path, done.already) == ("floor_2/iPhone/walk-1", False)
    assert format_of(survey / done.path) == APPS[app][0]
    assert bytes_of(survey / done.path) == bytes_of(tmp_path / "recording")
    assert is_filed(survey / done.path, done.sums_sha256)
    (survey / done.path / "sightings.csv").write_text("")
    assert file_zip(survey, path, PLENTY_FOR_APPS).already, "what was found since stays"


def test_a_browser_may_send_it_too(survey: Path, tmp_path: Path) -> None:
    data = shared_zip("ios_logger", tmp_path, "2024-01-02/").read_bytes()
    name = hashlib.sha256(data).hexdigest()
    with Uploads(survey, PLENTY_FOR_APPS, PLENTY_FOR_APPS, AppPlace(3, "phone of Ann")) as uploads:
        with uploads.writing(name, len(data), 0) as file:
            file.write(data)
        assert uploads.finish(name).path == "floor_3/phone of Ann/2024-01-02"
        assert uploads.state(name).state == "filed"


def test_what_cannot_be_filed_is_refused_in_one_sentence(survey: Path, tmp_path: Path) -> None:
    def refused(data: bytes, place: AppPlace | None = None, most: int = PLENTY_FOR_APPS) -> str:
        path = tmp_path / "some.zip"
        path.write_bytes(data)
        with pytest.raises(RefusedZipError) as caught:
            file_zip(survey, path, most, place)
        assert not list((survey / ".receiving").iterdir())
        return str(caught.value)

    walk = shared_zip("ios_logger", tmp_path).read_bytes()
    assert "nor a recording of another known app" in refused(packed({"notes.txt": b"hello"}))
    assert "unpacks to more than" in refused(packed({"ARposes.txt": b"0" * 100_000}), most=10_000)
    buffer = io.BytesIO(walk)
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr("../outside.txt", "x")
    (tmp_path / "walk-2.zip").write_bytes(buffer.getvalue())
    assert file_zip(survey, tmp_path / "walk-2.zip", PLENTY_FOR_APPS).path == "floor_2/iPhone/walk-2"
    assert not (tmp_path / "outside.txt").exists()
    assert not list(survey.rglob("outside.txt"))
    file_zip(survey, tmp_path / "walk-1.zip", PLENTY_FOR_APPS)
    (survey / "floor_2" / "iPhone" / "walk-1" / "ARposes.txt").write_text("other")
    (tmp_path / "walk-1.zip").write_bytes(walk)
    with pytest.raises(RefusedZipError, match="floor_2/iPhone/walk-1 already contains another session"):
        file_zip(survey, tmp_path / "walk-1.zip", PLENTY_FOR_APPS)
    (survey / "floor_1").mkdir()
    assert "receive them with vislam2tag receive --floor" in refused(walk)


def test_wrong_places_are_told(survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    assert "not a valid name for a device" in the_error(vislam2tag("receive", survey, path, "--device", "../x"))
    for device in ("CON", "nul.phone", "mine.", "mine ", "tachymeter"):
        assert "not a valid name for a device" in the_error(vislam2tag("receive", survey, path, "--device", device))
    done = vislam2tag("receive", survey, path, "--floor", "-1", "--device", "mine", "--json")
    assert json.loads(done.stdout)["filed"][0]["path"] == "floor_-1/mine/walk-1"


@pytest.mark.parametrize(
    "name", ["CON", "nul.csv", "camera/AUX/1.txt", "notes.", "notes ", "a:b", "a\\b", "a\x01b", "arPoses.TXT"]
)
def test_names_that_some_system_does_not_take_are_refused(name: str, survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, "x")
    with pytest.raises(RefusedZipError, match="not a valid name on some systems"):
        file_zip(survey, path, PLENTY_FOR_APPS)


@pytest.mark.parametrize(("stem", "filed"), [("CON", "_CON"), ("nul.x", "_nul.x"), ("walk. ", "walk"), ("a:b", "a-b")])
def test_a_recording_is_filed_under_a_name_that_every_system_takes(
    stem: str, filed: str, survey: Path, tmp_path: Path
) -> None:
    path = shared_zip("ios_logger", tmp_path).rename(tmp_path / f"{stem}.zip")
    assert file_zip(survey, path, PLENTY_FOR_APPS).path == f"floor_2/iPhone/{filed}"


def test_names_that_differ_in_case_alone_are_one_folder_on_every_system(survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    file_zip(survey, path, PLENTY_FOR_APPS)
    other = path.rename(tmp_path / "WALK-1.zip")
    again = file_zip(survey, other, PLENTY_FOR_APPS, AppPlace(2, "IPHONE"))
    assert (again.path, again.already) == ("floor_2/iPhone/walk-1", True)

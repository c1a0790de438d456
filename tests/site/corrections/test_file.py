from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tests.mutations import mutate, some_or_many
from tests.site.site import write_survey
from vislam2tag.common.errors import SurveyError
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections, read_corrections, session_start
from vislam2tag.site.corrections.unknown import CHANGES_NOTHING
from vislam2tag.site.model import SessionKey

KEY = SessionKey(0, "LG", "2022-01-14T16:35:30")
EXAMPLE = """
[[exclude_session]]
floor = 4
device = "LG"
session = "2022-01-14T163530"
reason = "phone fell"

[[exclude_span]]
device = "LG"
from_s = 10
to_s = 12.5

[[exclude_landmark]]
id = 7

[[swap_landmarks]]
ids = ["3", 5]

[[move_landmark]]
id = "10"
x = 3
y = 4.5
from = 2022-01-10T00:00:00
until = "2022-02-01T120000"

[[shift_clock]]
table = "wifi"
offset_s = -0.35
"""


def corrections_of(tmp_path: Path, text: str) -> Corrections:
    (tmp_path / "corrections.toml").write_text(text)
    return read_corrections(tmp_path)


def test_every_kind_of_entry_is_read(tmp_path: Path) -> None:
    corrections = corrections_of(tmp_path, EXAMPLE)
    assert corrections.exclude_session[0].reason == "phone fell"
    assert (corrections.exclude_span[0].from_s, corrections.exclude_span[0].to_s) == (10.0, 12.5)
    assert corrections.exclude_landmark[0].id == "7"
    assert corrections.swap_landmarks[0].ids == ["3", "5"]
    assert (corrections.move_landmark[0].x, corrections.move_landmark[0].y) == (3.0, 4.5)
    assert corrections.move_landmark[0].until == session_start("2022-02-01T12:00:00")
    assert corrections.shift_clock[0].offset_s == -0.35


def test_the_example_of_the_documentation_is_right(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "reference" / "corrections.md").read_text(encoding="utf-8")
    corrections = corrections_of(tmp_path, text.split("```toml\n")[1].split("```")[0])
    assert all(len(getattr(corrections, name)) == 1 for name in Corrections.model_fields)


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    assert corrections_of(tmp_path, "\ufeff" + EXAMPLE) == corrections_of(tmp_path, EXAMPLE)


def test_no_file_means_no_corrections(tmp_path: Path) -> None:
    assert read_corrections(tmp_path) == Corrections()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[exclude_session]]\nreason = 'all'\n", r"\[\[exclude_session\]\] number 1: .*at least one of floor"),
        ("[[exclude_span]]\nfrom_s = 5\nto_s = 5\n", "from_s must be less than to_s"),
        ("[[exclude_span]]\nfrom_s = 'x'\n", r"\[\[exclude_span\]\] number 1, from_s: .*valid number"),
        ("[[exclude_landmark]]\n", r"number 1, id: missing; add it"),
        ("[[exclude_landmark]]\nid = ''\n", r"number 1, id: .*a landmark id must be a text"),
        ("[[swap_landmarks]]\nids = ['1']\n", r"ids: List should have at least 2"),
        ("[[swap_landmarks]]\nids = ['1', '1.0']\n", "two different landmarks"),
        ("[[move_landmark]]\nid='1'\nx=1\ny=nan\n", r"\[\[move_landmark\]\] number 1, y: .*finite"),
        ("[[move_landmark]]\nid='1'\nx=1\ny=2\nfrom='May'\n", r"from: .*datetime"),
        ("[[move_landmark]]\nid='1'\nx=1\ny=2\nfrom=2022-01-10T00:00:00Z\n", r"from: .*should not have timezone"),
        (
            "[[shift_clock]]\ntable='gps'\noffset_s=1\n",
            r"table: Input should be 'sensors', 'wifi'",
        ),
        ("[[shift_clock]]\ntable='wifi'\noffset_s=inf\n", r"offset_s: .*less than or equal"),
        ("[[exclude_landmark]]\nid='1'\nflor=1\n", r"flor: unknown name, check the spelling"),
        ("[[exclude_landmark]]\nid='1'\n[[exclude_landmark]]\nid='2'\nfloor='1'\n", "number 2, floor: .*valid integer"),
        ("[[unknown]]\nid='1'\n", r"\[\[unknown\]\]"),
        ("[[exclude_landmarks]]\nid='1'\n", r"check the spelling \(the closest name is exclude_landmark\)"),
        ("[[exclude_span]]\nfrom=1\n", r"number 1, from: .* \(the closest name is from_s\)"),
        ("[[move_landmark]]\nid=1\nx=1\ny=2\nform=1\n", r"number 1, form: .* \(the closest name is from\)"),
        ("exclude_landmark = 3\n", r"\[\[exclude_landmark\]\]: each entry must start with its name in double brackets"),
        ("not toml", "the file is not valid TOML"),
        ("a = '\x00'", "the file is not valid TOML"),
    ],
)
def test_errors_name_file_entry_and_what_was_expected(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message) as caught:
        corrections_of(tmp_path, text)
    assert str(tmp_path / "corrections.toml") in str(caught.value)


def test_selectors_choose_sessions_with_or_without_colons(tmp_path: Path) -> None:
    corrections = corrections_of(tmp_path, EXAMPLE)
    four = SessionKey(4, "LG", "2022-01-14T16:35:30")
    assert corrections.excludes(four)
    assert not corrections.excludes(KEY)
    assert not corrections.excludes(SessionKey(4, "OnePlus", four.session))
    assert len(corrections.for_session(SessionKey(0, "OnePlus", "walk")).exclude_span) == 0
    assert len(corrections.for_session(KEY).exclude_span) == 1


@pytest.mark.parametrize(
    ("session", "applies"),
    [
        ("2022-01-09T23:59:59", False),
        ("2022-01-10T00:00:00", True),
        ("2022-01-10T000000", True),
        ("2022-02-01T115959", True),
        ("2022-02-01T12:00:00", False),
        ("walk", False),
    ],
)
def test_a_move_holds_for_its_period_only(tmp_path: Path, session: str, applies: bool) -> None:
    (move,) = corrections_of(tmp_path, EXAMPLE).move_landmark
    assert move.applies(SessionKey(0, "LG", session)) is applies


@some_or_many
def test_damaged_files_raise_only_our_error(tmp_path: Path, files: int) -> None:
    rng = np.random.default_rng(9)
    path = tmp_path / "corrections.toml"
    for _ in range(files):
        path.write_bytes(mutate(EXAMPLE.encode(), rng))
        with suppress(SurveyError):
            read_corrections(tmp_path)


def test_a_sessions_true_floor_and_device(tmp_path: Path) -> None:
    text = """
[[set_floor]]
session = "2022-01-14T163530"
to = 2

[[set_device]]
floor = 0
device = "LG"
to = "Galaxy"
"""
    corrections = corrections_of(tmp_path, text)
    assert corrections.true_key(KEY) == SessionKey(2, "Galaxy", KEY.session)
    assert corrections.true_key(SessionKey(1, "LG", "other")) == SessionKey(1, "LG", "other")


def test_a_session_is_listed_by_its_true_floor_and_device(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey")
    before = open_survey(root)
    moved, *others = before.sessions
    other = next(floor.number for floor in before.site.floors if floor.number != moved.key.floor)
    entry = f'floor = {moved.key.floor}\ndevice = "{moved.key.device}"\nsession = "{moved.key.session}"\n'
    text = f'[[set_floor]]\n{entry}to = {other}\n[[set_device]]\n{entry}to = "Galaxy"\n'
    (root / "corrections.toml").write_text(text)
    after = open_survey(root)
    found = next(ref for ref in after.sessions if ref.folder == moved.folder)
    assert found.key == SessionKey(other, "Galaxy", moved.key.session)
    assert not CHANGES_NOTHING & {finding.kind for finding in after.findings}
    assert {ref.key for ref in others} <= {ref.key for ref in after.sessions}
    (root / "corrections.toml").write_text(f"[[set_floor]]\n{entry}to = 99\n")
    with pytest.raises(SurveyError, match="floor 99"):
        open_survey(root)


def test_a_control_point_is_moved_for_all_sessions(tmp_path: Path) -> None:
    text = "[[move_control_point]]\nfloor = 1\nid = {}\nx = 5.5\ny = 6.5\n"
    files = {"floor_1/refmarker.csv": "1,2\n3,4\n"}
    survey = open_survey(write_survey(tmp_path / "a", {**files, "corrections.toml": text.format(1)}))
    assert survey.site.floor(1).control_points.position_bcs.tolist() == [[1, 2], [5.5, 6.5]]
    assert not CHANGES_NOTHING & {finding.kind for finding in survey.findings}
    survey = open_survey(write_survey(tmp_path / "b", {**files, "corrections.toml": text.format(2)}))
    assert "floor 1 has no control point 2" in next(f.message for f in survey.findings if f.kind in CHANGES_NOTHING)

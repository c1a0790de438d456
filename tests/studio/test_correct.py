"""From what is wrong to labels that are right, as the page asks for it; what is changed is put back.

Faults of an earlier search that are still open are an answer, whatever the labels or their absence say.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.studio.running import Page
from vislam2tag.common.findings import Answer, FaultKind, Judgement
from vislam2tag.quality.diagnosis.record import Diagnosis, Fault
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.studio import fault_view
from vislam2tag.studio.outputs import LABELS

NEAR_M = 0.3
"""As right as the labels of the corrected survey must be."""


@pytest.fixture
def as_before(page: Page) -> Iterator[None]:
    yield
    page.save("", page.get("/api/corrections")["version"])
    page.do("process")


@pytest.mark.slow
@pytest.mark.usefixtures("as_before")
def test_all_faults_are_found_corrected_undone_and_done_again(page: Page, faulty: Path, faults: dict[str, Any]) -> None:
    assert page.do("diagnose")["state"] == "done"
    found = page.get("/api/diagnosis")
    assert found["state"] == "full"
    assert [fault["kind"] for fault in found["faults"]] == ["wrong_floor", "swapped", "mis_surveyed", "moved"]
    assert [fault["landmarks"] for fault in found["faults"][1:]] == [
        faults["swapped"],
        [faults["mis_surveyed"]],
        [faults["moved"]["landmark"]],
    ]
    conflicts = [page.get("/api/layers/conflicts", floor=floor)["features"] for floor in (1, 2)]
    misplaced = {*faults["swapped"], faults["mis_surveyed"], faults["moved"]["landmark"]}
    assert {feature["landmarks"][0] for feature in conflicts[0] if feature["shape"] == "line"} >= misplaced
    assert {feature["shape"] for feature in conflicts[1]} == {"point"}
    gains = [fault["gain"]["labelled_after"] - fault["gain"]["labelled_before"] for fault in found["faults"]]
    assert gains == sorted(gains, reverse=True)
    place = found["faults"][2]["places"][0]
    assert np.hypot(place["to_x"] - place["x"], place["to_y"] - place["y"]) > 2
    assert all(fault["lines"].startswith("[[") for fault in found["faults"])

    changes = [change for fault in found["faults"] for change in fault["changes"]]
    before = page.get("/api/corrections")
    preview = page.post("/api/corrections/preview", {"changes": changes})
    assert page.get("/api/corrections") == before, "nothing is saved by looking"
    sessions = {session["id"]: session for session in page.get("/api/sessions")["sessions"]}
    assert set(preview["touched"]) == {id for id, session in sessions.items() if session["folder"]["floor"] == 1}
    assert all(line.startswith(("@@", "+", " ")) for line in preview["lines"].splitlines())
    saved = page.save(preview["text"], before["version"]).json()
    assert (faulty / "survey" / "corrections.toml").read_text() == preview["text"] == saved["text"]
    listed = sorted(fault["id"] for fault in found["faults"])
    assert sorted(fault["id"] for fault in page.get("/api/diagnosis")["faults"]) == listed, "while labels are outdated"

    job = page.do("process")
    assert (job["state"], job["done"], job["failed"]) == ("done", len(preview["touched"]), {})
    now = {session["id"]: session for session in page.get("/api/sessions")["sessions"]}
    assert not any(session["stale"] for session in now.values())
    assert {id for id, session in now.items() if session["changed"]} == set(preview["touched"])
    assert all(session["error_m"] < NEAR_M for session in now.values())
    assert all(0 < session["expected_error_m"] < 3 * session["sigma_median_m"] for session in now.values())
    wrong = next(s for s in now.values() if s["folder"]["session"] == faults["wrong_floor"]["session"])
    assert (wrong["folder"]["floor"], wrong["key"]["floor"], wrong["floors"]) == (1, 2, [2])

    compared = page.get("/api/compare", a="before", b="labels")
    errors = {total["measure"]: total for total in compared["totals"]}
    assert errors["error_mean"]["b"] < NEAR_M < errors["error_mean"]["a"]
    uncertain = [len(page.columns("/api/tracks", output=name).filter(status=7)) for name in ("before", "labels")]
    assert uncertain[0] > 10 * uncertain[1]
    untouched = next(s["id"] for s in compared["sessions"] if s["id"] not in preview["touched"])
    assert [s["apart_p95_m"] for s in compared["sessions"] if s["id"] == untouched] == [0.0]

    undone = page.save("", saved["version"]).json()
    assert undone["version"] == ""
    assert sorted(fault["id"] for fault in page.get("/api/diagnosis")["faults"]) == listed, "open again"
    assert not (faulty / "survey" / "corrections.toml").exists()
    assert page.do("process")["done"] == len(preview["touched"])
    back = {session["id"]: session for session in page.get("/api/sessions")["sessions"]}
    assert {id: session["error_m"] for id, session in back.items()} == {id: s["error_m"] for id, s in sessions.items()}
    assert page.save(preview["text"], "").status_code == 200
    page.do("process")
    again = page.get("/api/sessions")["sessions"]
    assert [session["error_m"] for session in again] == [session["error_m"] for session in now.values()]
    corrected = page.get("/api/diagnosis")
    assert sorted(fault["id"] for fault in corrected["faults"]) == sorted(fault["id"] for fault in found["faults"])
    assert corrected["judgement"]["answer"] == "nothing_wrong"


@pytest.mark.usefixtures("as_before")
def test_only_what_a_change_touches_is_mapped_again_and_told(page: Page) -> None:
    session = page.get("/api/sessions")["sessions"][0]
    heard: list[tuple[str, Any]] = []
    listening = threading.Event()

    def listen() -> None:
        for name, content in page.events():
            heard.append((name, content))
            listening.set()
            if name == "job" and content["state"] == "done":
                return

    thread = threading.Thread(target=listen)
    thread.start()
    assert listening.wait(30)
    change = {"action": "add", "table": "exclude_span", "values": {**selector(session), "from_s": 10.0, "to_s": 20.0}}
    preview = page.post("/api/corrections/preview", {"changes": [change]})
    assert preview["touched"] == [session["id"]]
    page.save(preview["text"], preview["version"])
    assert [s["id"] for s in page.get("/api/sessions")["sessions"] if s["stale"]] == [session["id"]]
    job = page.do("process", [session["id"]])
    assert (job["total"], job["done"]) == (1, 1)
    thread.join(30)
    assert [content["sessions"] for name, content in heard if name == "labels"] == [[session["id"]]]
    assert "versions" in [name for name, _ in heard] or heard[0][0] == "hello"
    track = page.columns(f"/api/sessions/{session['id']}/track")
    inside = track.filter(track["t"].is_between(10.01, 19.99))
    assert set(inside["status"]) == {10}
    assert len(page.columns(f"/api/sessions/{session['id']}/track", output="before").filter(status=10)) == 0
    other = page.get("/api/sessions")["sessions"][1]["id"]
    page.do("process", [other])
    compared = page.get("/api/compare", a="before", b="labels")
    assert [s["apart_p95_m"] for s in compared["sessions"]] == [0.0] * len(compared["sessions"])
    assert compared["settings"] == []


@pytest.mark.usefixtures("as_before")
def test_a_walk_that_is_left_out_has_no_labels_but_stays_in_the_list(page: Page) -> None:
    session = page.get("/api/sessions")["sessions"][3]
    change = {"action": "add", "table": "exclude_session", "values": selector(session)}
    preview = page.post("/api/corrections/preview", {"changes": [change]})
    assert preview["touched"] == [session["id"]]
    page.save(preview["text"], preview["version"])
    assert page.do("process")["state"] == "done"
    now = page.get("/api/sessions")["sessions"]
    assert (now[3]["excluded"], now[3]["labelled"], now[3]["stale"]) == (True, False, False)
    assert [s["id"] for s in now] == [s["id"] for s in page.get("/api/sessions")["sessions"]]
    assert 3 not in page.columns("/api/tracks")["session"].unique()
    assert 3 in page.columns("/api/tracks", output="before")["session"].unique()


def selector(session: dict[str, Any]) -> dict[str, Any]:
    return dict(session["folder"])


@pytest.mark.usefixtures("as_before")
def test_a_text_of_another_version_is_not_saved(page: Page, faulty: Path) -> None:
    mine = '[[exclude_landmark]]\nid = "12"\n'
    assert page.save(mine, "").status_code == 200
    late = page.save('[[exclude_landmark]]\nid = "1"\n', "")
    assert late.status_code == 409
    assert late.json()["code"] == "stale"
    assert late.json()["corrections"]["text"] == mine
    assert late.json()["corrections"]["entries"][0]["values"] == {"id": "12"}
    (faulty / "survey" / "corrections.toml").write_text("# by hand\n" + mine)
    now = page.get("/api/corrections")
    assert now["text"].startswith("# by hand")
    change = {"action": "replace", "table": "exclude_landmark", "number": 1, "values": {"id": "12", "floor": 1}}
    preview = page.post("/api/corrections/preview", {"changes": [change]})
    assert preview["text"] == '# by hand\n[[exclude_landmark]]\nid = "12"\nfloor = 1\n'
    assert page.client.put("/api/corrections", json={"text": mine}).status_code == 428


def exclude(name: str) -> str:
    return f'[[exclude_landmark]]\nid = "{name}"\n'


@pytest.mark.usefixtures("as_before")
def test_undo_takes_one_change_back_and_leaves_what_others_wrote_meanwhile(page: Page, faulty: Path) -> None:
    file = faulty / "survey" / "corrections.toml"
    file.write_text("# theirs\n" + exclude("1"))
    change = {"action": "add", "table": "exclude_landmark", "values": {"id": "12"}}
    preview = page.post("/api/corrections/preview", {"changes": [change]})
    step = {"before": preview["before"], "after": page.save(preview["text"], preview["version"]).json()["text"]}
    assert step["before"] == "# theirs\n" + exclude("1")
    later = step["after"].replace("# theirs", "# theirs, too") + "\n" + exclude("3") + "# behind it\n"
    file.write_text(later)
    undone = page.post("/api/corrections/undo", step)
    assert undone["before"] == later
    left = "# theirs, too\n" + exclude("1") + "\n" + exclude("3") + "# behind it\n"
    assert file.read_text() == left == undone["corrections"]["text"]
    file.write_text(left + "\n" + exclude("5"))
    page.post("/api/corrections/undo", {"before": later, "after": left})  # done again
    assert file.read_text() == later + "\n" + exclude("5")


@pytest.mark.usefixtures("as_before")
def test_a_change_that_someone_else_changed_is_not_undone_and_both_values_are_said(page: Page, faulty: Path) -> None:
    file = faulty / "survey" / "corrections.toml"
    theirs = exclude("12") + "floor = 2\n"
    file.write_text(theirs)
    refused = page.client.post("/api/corrections/undo", json={"before": "", "after": exclude("12")})
    assert (refused.status_code, refused.json()["code"]) == (409, "conflict")
    conflict = {"table": "exclude_landmark", "expected": exclude("12"), "now": theirs}
    assert refused.json()["conflicts"] == [conflict]
    assert refused.json()["corrections"]["text"] == theirs == file.read_text()


@pytest.mark.usefixtures("as_before")
def test_what_cannot_be_used_after_an_undo_is_not_written(page: Page, faulty: Path) -> None:
    file = faulty / "survey" / "corrections.toml"
    file.write_text(exclude("12"))
    before = exclude("12") + "\n[[set_floor]]\nfloor = 1\nto = 9\n"
    refused = page.client.post("/api/corrections/undo", json={"before": before, "after": exclude("12")})
    assert refused.status_code == 422
    assert "floor 9, which does not exist" in refused.json()["message"]
    assert file.read_text() == exclude("12")


@pytest.mark.usefixtures("as_before")
def test_a_change_is_shown_of_the_entry_that_the_page_meant(page: Page, faulty: Path) -> None:
    """Its number in the file may be another now, and a typed text may be of an older file."""
    known = exclude("12")
    (faulty / "survey" / "corrections.toml").write_text(exclude("1") + "\n" + known)
    removal = {"action": "remove", "table": "exclude_landmark", "number": 1}
    assert page.post("/api/corrections/preview", {"base": known, "changes": [removal]})["text"] == exclude("1")
    typed = page.post("/api/corrections/preview", {"base": known, "text": "# mine\n" + known, "changes": []})
    assert typed["text"] == exclude("1") + "# mine\n\n" + known
    other = known.replace("12", "13")
    refused = page.client.post("/api/corrections/preview", json={"base": other, "text": "", "changes": []})
    assert refused.json()["conflicts"] == [{"table": "exclude_landmark", "expected": other, "now": None}]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"action": "add", "table": "exclude_span", "values": {"from_s": 9, "to_s": 2}}, "from_s must be less"),
        ({"action": "add", "table": "set_floor", "values": {"floor": 1, "to": 9}}, "floor 9, which does not exist"),
        ({"action": "remove", "table": "exclude_span", "number": 4}, "there is no [[exclude_span]] number 4"),
        ({"action": "explode"}, "changes.0"),
    ],
)
def test_what_cannot_be_is_refused_with_a_sentence(page: Page, change: dict[str, Any], said: str) -> None:
    answer = page.client.post("/api/corrections/preview", json={"changes": [change]})
    assert answer.status_code == 422
    assert said in answer.json()["message"]


def test_a_damaged_file_is_told_and_can_be_repaired(page: Page, faulty: Path) -> None:
    file = faulty / "survey" / "corrections.toml"
    file.write_text("[[exclude_span]\n")
    try:
        now = page.get("/api/corrections")
        assert "not a TOML file" in now["problem"]
        assert page.do("process")["state"] == "failed"
        assert len(page.get("/api/sessions")["sessions"]) == 12
        assert page.save("", now["version"]).status_code == 200
    finally:
        file.unlink(missing_ok=True)
    assert page.get("/api/corrections")["problem"] is None


def test_every_kind_of_correction_has_a_form(page: Page) -> None:
    tables = {table["name"]: table for table in page.get("/api/corrections/tables")["tables"]}
    assert "until" in tables["move_landmark"]["values"]["properties"]
    assert tables["swap_landmarks"]["summary"].startswith("Two sheets")
    assert len(tables) == 16


FAULT = Fault(kind=FaultKind.PLANNED, floor=0, summary="a landmark is only planned", evidence="its table")
SOUND = Judgement(answer=Answer.NOTHING_WRONG, looked_at="3 landmarks in 1 walk")


def workspace_of(root: Path, *, labelled: bool, faults: list[Fault]) -> Any:
    """A workspace whose survey has changed since the last search."""
    landmarks = SimpleNamespace(ids=(), floor=np.zeros(0, dtype=np.int64), position_bcs=np.zeros((0, 2)))
    survey = SimpleNamespace(sessions=[], site=SimpleNamespace(landmarks=landmarks))
    return SimpleNamespace(
        root=root,
        out=root / "labels",
        now=SimpleNamespace(survey=survey, corrections=read_corrections(root), id_of_key={}),
        diagnosis=(Diagnosis(faults=faults), "before"),
        outputs={LABELS: SimpleNamespace(stamp=lambda: "made" if labelled else "")},
        searched=lambda: "now",
        stale=frozenset,
    )


@pytest.mark.parametrize("labelled", [False, True])
def test_open_faults_are_something_wrong(labelled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fault_view, "kept_faults", lambda *_: ([], SOUND))
    view = fault_view.Diagnoses(workspace_of(tmp_path, labelled=labelled, faults=[FAULT])).view()
    assert [fault.kind for fault in view.faults] == ["planned"]
    assert view.judgement.answer is Answer.WRONG
    (tmp_path / "corrections.toml").write_text('[[ignore_fault]]\nkind = "planned"\nreason = "measured soon"\n')
    ignored = fault_view.Diagnoses(workspace_of(tmp_path, labelled=labelled, faults=[FAULT])).view()
    assert ignored.faults == view.faults
    assert ignored.judgement.answer is not Answer.WRONG
    none = fault_view.Diagnoses(workspace_of(tmp_path, labelled=labelled, faults=[])).view()
    assert none.judgement.answer is (Answer.NOTHING_WRONG if labelled else Answer.NOT_LOOKED_AT)

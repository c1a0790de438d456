"""Requests and answers, without a network: what clients rely on."""

from __future__ import annotations

import asyncio
import errno
import io
from collections.abc import AsyncIterator, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import httpx
import pytest
from PIL import Image

from tests.studio.receiving.zips import SESSION, digest, session_zip, signed, signed_path
from vislam2tag.common.serving import REPORTED_A_MINUTE
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.discover import read_site
from vislam2tag.studio.receiving.server import (
    ANSWER_MAC,
    BODY_SHA256,
    MOST_PER_REQUEST,
    PAGE,
    PLAN_SIDE_PX,
    Listener,
    Receiver,
    plan_jpeg,
    survey_facts,
)
from vislam2tag.studio.receiving.token import Guard, answer_mac
from vislam2tag.studio.receiving.uploads import FiledSession, Uploads

PLENTY = 1_000_000
TOKEN = "ABCDEFGHIJKLMNOP"
DATA = session_zip()
NAME = digest(DATA)
PLACE = f"floor_4/LG/{SESSION}"


class Phone:
    """Asks a receiver that lives in the same process."""

    def __init__(self, uploads: Uploads) -> None:
        self.uploads = uploads
        self.now_s = 0.0
        self.heard: list[str] = []
        listener = Listener(filed=self._filed, refused=lambda address, message: self.heard.append(message))
        self._app = Receiver(uploads, Guard(TOKEN), listener, lambda: self.now_s).app()

    def _filed(self, name: str, filed: FiledSession) -> None:
        self.heard.append(f"{'already' if filed.already else 'filed'} {filed.path}")

    def ask(self, method: str, path: str, **options: Any) -> httpx.Response:
        async def asked() -> httpx.Response:
            transport = httpx.ASGITransport(app=self._app)
            async with httpx.AsyncClient(transport=transport, base_url="http://computer") as client:
                return await client.request(method, path, **options)

        return asyncio.run(asked())

    def state(self, name: str = NAME) -> dict[str, Any]:
        answer = self.ask("GET", f"/v2/uploads/{name}", headers=signed(TOKEN, "GET", name))
        assert answer.status_code == 200
        content: dict[str, Any] = answer.json()
        return content

    def bring(
        self, data: bytes, offset: int = 0, length: int = len(DATA), name: str = NAME, headers: Mapping[str, str] = {}
    ) -> httpx.Response:
        wrong_offset, wrong_length = headers.get("Upload-Offset", offset), headers.get("Upload-Length", length)
        own = signed(TOKEN, "PATCH", name, data, wrong_offset, wrong_length)
        return self.ask("PATCH", f"/v2/uploads/{name}", content=data, headers={**own, **headers})


@pytest.fixture
def phone(tmp_path: Path) -> Iterator[Phone]:
    with Uploads(tmp_path, PLENTY, PLENTY) as uploads:
        yield Phone(uploads)


def test_a_session_in_two_requests(phone: Phone, tmp_path: Path) -> None:
    assert phone.state()["state"] == "none"
    first = phone.bring(DATA[:200])
    assert first.status_code == 200
    assert first.json() == {
        "state": "partial",
        "received": 200,
        "length": len(DATA),
        "session": None,
        "message": "partly received",
    }
    last = phone.bring(DATA[200:], 200)
    assert last.status_code == 200
    assert (last.json()["state"], last.json()["session"]) == ("filed", PLACE)
    assert (tmp_path / PLACE / "session.json").is_file()
    assert phone.heard == [f"filed {PLACE}"]


def test_a_filed_session_is_answered_so_whatever_comes(phone: Phone) -> None:
    phone.bring(DATA)
    assert phone.bring(DATA).json()["state"] == "filed"
    assert phone.bring(DATA[5:], 5).json()["state"] == "filed"
    assert phone.heard == [f"filed {PLACE}"]


def test_the_same_session_packed_otherwise_is_there_already(phone: Phone) -> None:
    phone.bring(DATA)
    other = session_zip() + b""
    repacked = other[:-2] + b"\x04\x00note"  # the same entries, with a comment
    answer = phone.bring(repacked, 0, len(repacked), digest(repacked))
    assert (answer.status_code, answer.json()["session"]) == (200, PLACE)
    assert phone.heard == [f"filed {PLACE}", f"already {PLACE}"]


@pytest.mark.parametrize("authorization", ["", f"Bearer {TOKEN}", f"Basic {TOKEN}", "wrong token"])
@pytest.mark.parametrize("method", ["GET", "PATCH"])
def test_nothing_without_a_proof_of_the_token(phone: Phone, method: str, authorization: str, tmp_path: Path) -> None:
    headers = signed("QQQQQQQQQQQQQQQQ" if authorization == "wrong token" else TOKEN, method, NAME, b"abc", 0, 3)
    headers |= {"Authorization": authorization} if authorization != "wrong token" else {}
    answer = phone.ask(method, f"/v2/uploads/{NAME}", headers=headers, content=b"abc")
    assert answer.status_code == 401
    assert "token" in answer.json()["message"]
    assert answer.headers["WWW-Authenticate"] == "Vislam2tag"
    assert ANSWER_MAC not in answer.headers
    assert list(tmp_path.rglob("*.part")) == []


@pytest.mark.parametrize("header", ["Upload-Offset", "Upload-Length", BODY_SHA256])
def test_a_proof_is_of_one_request_only(phone: Phone, header: str) -> None:
    headers = signed(TOKEN, "PATCH", NAME, DATA, 0, len(DATA)) | {header: "1" * 64}
    assert phone.ask("PATCH", f"/v2/uploads/{NAME}", headers=headers, content=DATA).status_code == 401
    other = signed(TOKEN, "PATCH", "f" * 64, DATA, 0, len(DATA))
    assert phone.ask("PATCH", f"/v2/uploads/{NAME}", headers=other, content=DATA).status_code == 401


def test_bytes_that_were_changed_on_the_way_are_not_kept(phone: Phone) -> None:
    phone.bring(DATA[:100])
    headers = signed(TOKEN, "PATCH", NAME, DATA[100:], 100, len(DATA))
    changed = DATA[100:-1] + bytes([DATA[-1] ^ 1])
    answer = phone.ask("PATCH", f"/v2/uploads/{NAME}", headers=headers, content=changed)
    assert (answer.status_code, answer.json()["received"]) == (409, 100)
    assert phone.bring(DATA[100:], 100).json()["state"] == "filed"


def test_answers_prove_who_answers(phone: Phone) -> None:
    for data, offset in ((DATA[:100], 0), (DATA, 7), (DATA[100:], 100)):
        headers = signed(TOKEN, "PATCH", NAME, data, offset, len(DATA))
        answer = phone.ask("PATCH", f"/v2/uploads/{NAME}", headers=headers, content=data)
        nonce = headers["Authorization"].split()[1]
        assert answer.headers[ANSWER_MAC] == answer_mac(TOKEN, nonce, answer.status_code, answer.content)


def test_who_knows_the_token_is_told_the_survey_s_floors_and_plans(phone: Phone, tmp_path: Path) -> None:
    assert phone.ask("GET", "/v2/survey").status_code == 401
    assert phone.ask("GET", "/v2/plans/-1").status_code == 401
    answer = phone.ask("GET", "/v2/survey", headers=signed_path(TOKEN, "GET", "/v2/survey"))
    assert answer.json() == {"name": tmp_path.name, "floors": []}
    (tmp_path / "floor_-1").mkdir()
    Image.new("L", (300, 200), 255).save(tmp_path / "floor_-1" / "floorplan.png")
    (tmp_path / "floor_dimensions.csv").write_text("level;name;x;y\n-1;basement;30.0;20.0\n", encoding="utf-8")
    told = phone.ask("GET", "/v2/survey", headers=signed_path(TOKEN, "GET", "/v2/survey")).json()
    assert [floor["number"] for floor in told["floors"]] == [-1]
    headers = signed_path(TOKEN, "GET", "/v2/plans/-1")
    plan = phone.ask("GET", "/v2/plans/-1", headers=headers)
    nonce = headers["Authorization"].split()[1]
    assert plan.headers[ANSWER_MAC] == answer_mac(TOKEN, nonce, 200, plan.content)
    for unknown in ("/v2/plans/7", "/v2/plans/cellar"):
        assert phone.ask("GET", unknown, headers=signed_path(TOKEN, "GET", unknown)).status_code == 404


def test_an_app_that_would_send_the_token_is_told_to_be_updated(phone: Phone) -> None:
    answer = phone.ask("GET", f"/v1/uploads/{NAME}", headers={"Authorization": f"Bearer {TOKEN}"})
    assert answer.status_code == 410
    assert "update the app" in answer.json()["message"]


def test_the_same_request_is_answered_once(phone: Phone) -> None:
    asking = signed(TOKEN, "GET", NAME)
    bringing = signed(TOKEN, "PATCH", NAME, DATA[:100], 0, len(DATA))
    for method, headers, body in (("GET", asking, b""), ("PATCH", bringing, DATA[:100])):
        first = phone.ask(method, f"/v2/uploads/{NAME}", headers=headers, content=body)
        again = phone.ask(method, f"/v2/uploads/{NAME}", headers=headers, content=body)
        assert (first.status_code, again.status_code) == (200, 401)
        assert "was sent before" in again.json()["message"]
        assert ANSWER_MAC not in again.headers
    assert phone.state()["received"] == 100


def test_a_proof_is_of_the_path_that_is_answered_whatever_host_is_named(phone: Phone) -> None:
    headers = signed(TOKEN, "GET", NAME) | {"Host": f"computer/v2/uploads/{NAME}?"}
    assert phone.ask("GET", f"/v2/uploads/{'f' * 64}", headers=headers).status_code == 401


@pytest.mark.parametrize("name", ["", "abc", NAME.upper(), "..%2f..%2fetc%2fpasswd", "../" + NAME, NAME + "0"])
def test_uploads_have_no_other_names(phone: Phone, name: str, tmp_path: Path) -> None:
    answer = phone.bring(b"abc", 0, 10, name)
    assert answer.status_code in (400, 404, 405)
    assert list(tmp_path.rglob("*.part")) == []


@pytest.mark.parametrize(
    ("header", "value"),
    [
        ("Upload-Offset", "-1"),
        ("Upload-Offset", "x"),
        ("Upload-Offset", "1" * 16),
        ("Upload-Length", ""),
        ("Upload-Length", "0"),
    ],
)
def test_wrong_headers_are_refused(phone: Phone, header: str, value: str) -> None:
    answer = phone.bring(DATA, headers={header: value})
    assert answer.status_code == 400
    assert header in answer.json()["message"]


def test_a_wrong_offset_is_told_where_to_go_on(phone: Phone) -> None:
    phone.bring(DATA[:100])
    for offset in (0, 99, 101):
        answer = phone.bring(DATA[offset : offset + 10], offset)
        assert answer.status_code == 409
        assert (answer.json()["state"], answer.json()["received"]) == ("partial", 100)
    assert phone.state()["received"] == 100


def test_so_many_uploads_wait_and_no_more(phone: Phone, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.studio.receiving.uploads.MOST_WAITING", 2)
    for name in ("a", "b", "c"):
        answer = phone.bring(b"x", 0, 10, name * 64)
    assert answer.status_code == 507
    assert "too many unfinished uploads" in answer.json()["message"]
    assert phone.bring(b"x", 1, 10, "a" * 64).status_code == 200


def test_another_length_is_refused(phone: Phone) -> None:
    phone.bring(DATA[:100])
    assert phone.bring(DATA[100:], 100, len(DATA) + 1).status_code == 400


def test_more_than_the_length_is_refused(phone: Phone) -> None:
    assert phone.bring(DATA + b"more").status_code == 400
    assert phone.state()["received"] <= len(DATA)


def test_what_is_too_large_is_refused_before_it_comes(phone: Phone) -> None:
    answer = phone.bring(b"x", 0, PLENTY + 1)
    assert answer.status_code == 413
    assert "--max-size-mb" in answer.json()["message"]
    assert phone.state()["state"] == "none"


def test_a_request_brings_so_much_and_no_more(tmp_path: Path) -> None:
    with Uploads(tmp_path, 10 * MOST_PER_REQUEST, PLENTY) as uploads:
        phone = Phone(uploads)
        assert phone.bring(bytes(MOST_PER_REQUEST + 1), 0, 2 * MOST_PER_REQUEST).status_code == 413

        async def unannounced() -> AsyncIterator[bytes]:
            for _ in range(MOST_PER_REQUEST // 2**20 + 1):
                yield bytes(2**20)

        headers = signed(TOKEN, "PATCH", NAME, b"", 0, 2 * MOST_PER_REQUEST)
        answer = phone.ask("PATCH", f"/v2/uploads/{NAME}", content=unannounced(), headers=headers)
        assert answer.status_code == 413
        assert phone.state()["received"] <= MOST_PER_REQUEST


def test_a_damaged_upload_is_refused_and_may_come_again(phone: Phone) -> None:
    wrong = bytes([DATA[0] ^ 1]) + DATA[1:]
    answer = phone.bring(wrong)
    assert answer.status_code == 422
    assert "SHA-256" in answer.json()["message"]
    assert phone.state()["state"] == "none"
    assert phone.bring(DATA).json()["state"] == "filed"


def test_an_answer_that_got_lost_is_asked_for_again(phone: Phone) -> None:
    with phone.uploads.writing(NAME, len(DATA), 0) as file:
        file.write(DATA)
    assert phone.state()["received"] == len(DATA)
    assert phone.bring(b"", len(DATA)).json()["state"] == "filed"


def test_a_phone_that_fell_silent_does_not_hold_its_upload(phone: Phone, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.studio.receiving.server.SILENT_S", 0.05)

    async def silent() -> AsyncIterator[bytes]:
        yield DATA[:100]
        await asyncio.sleep(60)

    headers = signed(TOKEN, "PATCH", NAME, DATA, 0, len(DATA))
    answer = phone.ask("PATCH", f"/v2/uploads/{NAME}", content=silent(), headers=headers)
    assert (answer.status_code, answer.json()["received"]) == (409, 100)
    assert phone.bring(DATA[100:], 100).json()["state"] == "filed"


def test_an_upload_that_somebody_else_writes_is_locked(phone: Phone) -> None:
    with phone.uploads.writing(NAME, len(DATA), 0):
        answer = phone.bring(DATA)
        assert (answer.status_code, answer.headers["Retry-After"]) == (423, "3")
    assert phone.bring(DATA).status_code == 200


@pytest.mark.parametrize(("number", "told"), [(errno.ENOSPC, "full"), (errno.EIO, "cannot write")])
def test_a_full_disk_is_told(phone: Phone, number: int, told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(name: str, length: int, offset: int) -> BinaryIO:
        raise OSError(number, "refused by the operating system")

    monkeypatch.setattr(phone.uploads, "writing", full)
    answer = phone.bring(DATA)
    assert answer.status_code == 507
    assert told in answer.json()["message"]


def test_of_strangers_the_log_tells_some_and_how_many_more(phone: Phone) -> None:
    for _ in range(50):
        phone.ask("GET", f"/v2/uploads/{NAME}")
    assert len(phone.heard) == REPORTED_A_MINUTE
    phone.now_s += 61
    phone.ask("GET", f"/v2/uploads/{NAME}")
    assert phone.heard[REPORTED_A_MINUTE] == f"{50 - REPORTED_A_MINUTE} more requests without the token within a minute"
    assert len(phone.heard) == REPORTED_A_MINUTE + 2


def test_the_page_needs_no_token_and_tells_none(phone: Phone) -> None:
    answer = phone.ask("GET", "/")
    assert answer.status_code == 200
    assert answer.text == PAGE
    assert TOKEN not in answer.text
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["Referrer-Policy"] == "no-referrer"


@pytest.mark.parametrize(("method", "path"), [("GET", "/etc/passwd"), ("POST", "/"), ("DELETE", f"/v2/uploads/{NAME}")])
def test_there_is_nothing_else(phone: Phone, method: str, path: str) -> None:
    answer = phone.ask(method, path, headers=signed(TOKEN, method, NAME))
    assert answer.status_code in (404, 405)
    assert answer.json()["message"]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("survey")
    simulate(regular_survey(5, "none", (0, 1), ("LG",), 1, 5.0), folder, WritingOptions())
    for plan in (folder / "floor_1").glob("floorplan.*"):
        plan.unlink()
    return folder


def test_floors_are_told_as_the_survey_has_them(survey: Path) -> None:
    facts = survey_facts(survey)
    assert facts["name"] == survey.name
    assert [(floor["number"], floor["plan"]) for floor in facts["floors"]] == [(0, True), (1, False)]
    extents = {floor.number: floor.extent_m for floor in read_site(survey)[0].floors}
    assert {floor["number"]: floor["extent_m"] for floor in facts["floors"]} == extents
    assert extents[0] is not None
    landmarks = read_site(survey)[0].landmarks
    for floor in facts["floors"]:
        own = landmarks.on_floor(floor["number"])
        assert floor["landmarks"].keys() == set(own.ids)
        assert floor["landmarks"][own.ids[0]] == pytest.approx(own.position_bcs[0])


def test_a_plan_is_a_picture_of_exactly_the_floor_s_extent(survey: Path) -> None:
    data = plan_jpeg(survey, 0)
    assert data is not None
    width, height = Image.open(io.BytesIO(data)).size
    extent = survey_facts(survey)["floors"][0]["extent_m"]
    assert extent is not None
    left, right, low, high = extent
    assert max(width, height) <= PLAN_SIDE_PX
    assert width / height == pytest.approx((right - left) / (high - low), rel=0.01)
    assert plan_jpeg(survey, 1) is None
    assert plan_jpeg(survey, 9) is None


def test_a_folder_without_floors_has_its_name_only(tmp_path: Path) -> None:
    assert survey_facts(tmp_path) == {"name": tmp_path.name, "floors": []}

from __future__ import annotations

import hashlib
import re
from dataclasses import replace

import pytest

from vislam2tag.studio.receiving.token import (
    WRONG_PROOF,
    Guard,
    SignedRequest,
    answer_mac,
    authorization_mac,
    grouped,
    new_token,
)

TOKEN, NONCE = "ABCDEFGHIJKLMNOP", "00112233445566778899aabbccddeeff"
BODY_SHA256 = hashlib.sha256(b"abc").hexdigest()
REQUEST = SignedRequest("PATCH", f"/v2/uploads/{BODY_SHA256}", "0", "3", BODY_SHA256, NONCE)


def test_both_sides_make_the_same_mac() -> None:
    """The app's tests have the same numbers (ProofTest.java)."""
    assert REQUEST.mac(TOKEN) == "f63dedcc47a3c9969ee1dc6abb7d25d7860c843bdda7f3997d05a65f0640d54f"
    assert answer_mac(TOKEN, NONCE, 200, b"abc") == "d5d51f2c835f59365ff82559512b2c578135ea7c8bbcb94022e18e67b43be3a3"


@pytest.mark.parametrize("part", ["method", "path", "offset", "length", "body_sha256", "nonce"])
def test_every_part_of_a_request_is_signed(part: str) -> None:
    assert replace(REQUEST, **{part: "0" * 32}).mac(TOKEN) != replace(REQUEST, **{part: "1" * 32}).mac(TOKEN)


def test_an_answer_is_signed_with_its_request_status_and_body() -> None:
    answers = {
        answer_mac(TOKEN, nonce, status, body) for nonce in "ab" for status in (200, 409) for body in (b"", b"x")
    }
    assert len(answers) == 8


@pytest.mark.parametrize("header", ["", "Bearer ABC", "Vislam2tag", f"Vislam2tag {NONCE}", f"Vislam2tag {NONCE} 12 34"])
def test_another_header_shows_no_mac(header: str) -> None:
    assert authorization_mac(header) is None


def test_the_header_holds_nonce_and_mac() -> None:
    mac = REQUEST.mac(TOKEN)
    assert authorization_mac(f"vislam2tag {NONCE.upper()} {mac}") == (NONCE, mac)


def test_tokens_differ_and_can_be_typed() -> None:
    drawn = {new_token() for _ in range(50)}
    assert len(drawn) == 50
    assert all(re.fullmatch("[A-Z2-7]{16}", token) for token in drawn)


def test_people_read_a_token_in_groups() -> None:
    assert grouped(TOKEN) == "ABCD-EFGH-IJKL-MNOP"


RIGHT, WRONG = REQUEST.mac(TOKEN), REQUEST.mac("QQQQQQQQQQQQQQQQ")


def test_right_proofs_are_admitted_wrong_ones_are_not() -> None:
    guard = Guard(TOKEN)
    assert guard.refusal(REQUEST, RIGHT) is None
    assert guard.refusal(REQUEST, WRONG) == WRONG_PROOF
    assert guard.refusal(REQUEST, TOKEN) == WRONG_PROOF


def test_wrong_proofs_never_refuse_a_right_one() -> None:
    guard = Guard(TOKEN)
    for _ in range(1000):
        assert guard.refusal(REQUEST, WRONG) == WRONG_PROOF
    assert guard.refusal(REQUEST, RIGHT) is None


def test_a_number_is_used_once() -> None:
    guard = Guard(TOKEN)
    other = replace(REQUEST, path="/v2/survey")
    assert guard.refusal(REQUEST, WRONG) == WRONG_PROOF, "uses nothing up"
    assert guard.refusal(REQUEST, RIGHT) is None
    for request in (REQUEST, other, replace(REQUEST, nonce=NONCE.upper())):
        assert "was sent before" in (guard.refusal(request, request.mac(TOKEN)) or "")
    new = replace(REQUEST, nonce="1" * 32)
    assert guard.refusal(new, new.mac(TOKEN)) is None


def test_numbers_are_never_forgotten_so_that_a_token_is_used_up() -> None:
    guard = Guard(TOKEN, max_requests=2)
    requests = [replace(REQUEST, nonce=f"{number:032x}") for number in range(3)]
    assert [guard.refusal(each, each.mac(TOKEN)) for each in requests[:2]] == [None, None]
    assert "stop receiving" in (guard.refusal(requests[2], requests[2].mac(TOKEN)) or "")
    assert "was sent before" in (guard.refusal(requests[0], requests[0].mac(TOKEN)) or "")

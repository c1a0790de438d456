from __future__ import annotations

import hashlib
from dataclasses import replace

import pytest

from vislam2tag.receiving.signature import SignedRequest, answer_mac, shown_mac

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
    assert shown_mac(header) is None


def test_the_header_holds_nonce_and_mac() -> None:
    mac = REQUEST.mac(TOKEN)
    assert shown_mac(f"vislam2tag {NONCE.upper()} {mac}") == (NONCE, mac)

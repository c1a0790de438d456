from __future__ import annotations

import re

from vislam2tag.receiving.signature import SignedRequest
from vislam2tag.receiving.token import (
    ADDRESSES,
    WAIT_S,
    WRONG_ALLOWED,
    Guard,
    grouped,
    new_token,
)

TOKEN = "ABCDEFGHIJKLMNOP"


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_tokens_differ_and_can_be_typed() -> None:
    drawn = {new_token() for _ in range(50)}
    assert len(drawn) == 50
    assert all(re.fullmatch("[A-Z2-7]{16}", token) for token in drawn)


def test_people_read_a_token_in_groups() -> None:
    assert grouped(TOKEN) == "ABCD-EFGH-IJKL-MNOP"


REQUEST = SignedRequest("GET", "/v2/uploads/x", "", "", "0" * 64, "0" * 32)
RIGHT, WRONG = REQUEST.mac(TOKEN), REQUEST.mac("QQQQQQQQQQQQQQQQ")


def test_right_tokens_are_admitted_wrong_ones_are_not() -> None:
    guard = Guard(TOKEN, Clock())
    assert guard.admits("phone", REQUEST, RIGHT)
    assert not guard.admits("phone", REQUEST, WRONG)
    assert not guard.admits("phone", REQUEST, TOKEN)


def test_an_address_waits_after_wrong_tokens_and_others_do_not() -> None:
    clock = Clock()
    guard = Guard(TOKEN, clock)
    for _ in range(WRONG_ALLOWED):
        assert guard.waiting_s("guesser") == 0
        assert not guard.admits("guesser", REQUEST, WRONG)
    assert guard.waiting_s("guesser") == WAIT_S
    assert guard.waiting_s("phone") == 0
    clock.now_s += WAIT_S - 0.5
    assert guard.waiting_s("guesser") == 1
    clock.now_s += 0.5
    assert guard.waiting_s("guesser") == 0


def test_a_right_token_clears_the_wrong_ones_before() -> None:
    guard = Guard(TOKEN, Clock())
    for _ in range(3):
        for _ in range(WRONG_ALLOWED - 1):
            guard.admits("phone", REQUEST, WRONG)
        assert guard.admits("phone", REQUEST, RIGHT)
    assert guard.waiting_s("phone") == 0


def test_memory_of_addresses_is_bounded() -> None:
    guard = Guard(TOKEN, Clock())
    for number in range(ADDRESSES + 10):
        guard.refuse(f"address {number}")
    assert len(guard._wrong) == ADDRESSES

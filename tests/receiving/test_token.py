from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.receiving.token import (
    ADDRESSES,
    ALPHABET,
    LENGTH,
    WAIT_S,
    WRONG_ALLOWED,
    Guard,
    grouped,
    new_token,
    normalised,
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


@given(st.text(ALPHABET, min_size=LENGTH, max_size=LENGTH))
def test_what_people_read_and_type_is_the_token(token: str) -> None:
    assert normalised(f" {grouped(token).lower()} ") == token


def test_right_tokens_are_admitted_wrong_ones_are_not() -> None:
    guard = Guard(TOKEN, Clock())
    assert guard.admits("phone", TOKEN)
    assert guard.admits("phone", "abcd-efgh-ijkl-mnop")
    assert not guard.admits("phone", "")
    assert not guard.admits("phone", TOKEN[:-1])
    assert not guard.admits("phone", TOKEN + "A")
    assert not guard.admits("phone", "ä" * LENGTH)


def test_an_address_waits_after_wrong_tokens_and_others_do_not() -> None:
    clock = Clock()
    guard = Guard(TOKEN, clock)
    for _ in range(WRONG_ALLOWED):
        assert guard.waiting_s("guesser") == 0
        assert not guard.admits("guesser", "WRONG")
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
            guard.admits("phone", "WRONG")
        assert guard.admits("phone", TOKEN)
    assert guard.waiting_s("phone") == 0


def test_memory_of_addresses_is_bounded() -> None:
    guard = Guard(TOKEN, Clock())
    for number in range(ADDRESSES + 10):
        guard.admits(f"address {number}", "WRONG")
    assert len(guard._wrong) == ADDRESSES

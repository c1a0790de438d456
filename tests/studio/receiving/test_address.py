from __future__ import annotations

import socket
from pathlib import Path

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.common.serving import code_of, listen, local_address, url_for


def test_the_token_stands_in_the_fragment() -> None:
    assert url_for("10.1.2.3", 8765, "ABCD") == "http://10.1.2.3:8765/#ABCD"
    assert url_for("fe80::1", 80, "ABCD") == "http://[fe80::1]:80/#ABCD"


def test_listening_everywhere_shows_an_address_that_phones_can_reach() -> None:
    assert url_for("0.0.0.0", 1, "A") == f"http://{local_address()}:1/#A"


def test_a_taken_port_is_told() -> None:
    with listen("127.0.0.1", 0) as taken, pytest.raises(UsageError, match="--port"):
        listen("127.0.0.1", taken.getsockname()[1])


def test_an_address_of_another_computer_is_told() -> None:
    with pytest.raises(UsageError, match=r"--host 192\.0\.2\.77"):
        listen("192.0.2.77", 0)


@pytest.mark.parametrize("host", ["../x", "a..b", "x" * 300, "\0"])
def test_what_is_no_host_is_told(host: str) -> None:
    with pytest.raises(UsageError, match="cannot be listened on"):
        listen(host, 0)


def test_a_computer_without_network_shows_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def unreachable(self: socket.socket, address: object) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(socket.socket, "connect", unreachable)
    assert local_address() == "127.0.0.1"


def test_the_code_is_square_enough_for_a_terminal() -> None:
    lines = code_of("http://192.168.178.100:8765/#ABCDEFGHIJKLMNOP").splitlines()
    assert 15 <= len(lines) <= 25


def test_the_app_s_tests_read_the_code_that_is_shown_now() -> None:
    kept = Path(__file__).parents[3] / "android/app/src/test/resources/receive-code.txt"
    assert kept.read_text(encoding="utf-8") == code_of("http://192.168.1.20:8765/#ABCDEFGHIJKL2345")

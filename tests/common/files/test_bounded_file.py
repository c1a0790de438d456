"""A file that gives no more at once than allowed, whatever is asked for."""

from __future__ import annotations

import io

import pytest

from vislam2tag.common.files.bounded_file import BoundedFile

CONTENT = bytes(range(10))


def bounded(most: int) -> BoundedFile:
    return BoundedFile(io.BytesIO(CONTENT), most, ValueError("too much"))


def test_reads_up_to_the_limit_are_those_of_the_file() -> None:
    file = bounded(10)
    assert (file.read(4), file.tell(), file.read()) == (CONTENT[:4], 4, CONTENT[4:])
    assert file.seekable()
    assert file.seek(-3, io.SEEK_END) == 7
    assert file.read(10) == CONTENT[7:]


@pytest.mark.parametrize("size", [7, -1])
def test_more_than_the_limit_is_refused_asked_for_or_not(size: int) -> None:
    with pytest.raises(ValueError, match="too much"):
        bounded(6).read(size)

"""Values that are written as TOML are read as they were."""

from __future__ import annotations

import datetime as dt
import tomllib

from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.files.toml_file import toml_value

plain = st.one_of(
    st.text(max_size=8), st.booleans(), st.integers(-(2**60), 2**60), st.floats(allow_nan=False, allow_infinity=False)
)
values = st.recursive(
    plain | st.dates(min_value=dt.date(1000, 1, 1)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=6,
)


@given(value=values)
def test_there_and_back(value: object) -> None:
    assert tomllib.loads(f"value = {toml_value(value)}")["value"] == value


def test_what_is_none_is_left_out() -> None:
    assert toml_value({"a": None, "b c": 1}) == '{ "b c" = 1 }'


def test_zero_is_written_without_a_sign() -> None:
    assert toml_value([-0.0, -2.5]) == "[0.0, -2.5]"

from __future__ import annotations

from vislam2tag.common.palette import STATUS_STYLES, style_of
from vislam2tag.core.status import STATUS_LABELS


def test_each_status_has_a_sentence_and_its_own_colour() -> None:
    assert set(STATUS_STYLES) == set(STATUS_LABELS)
    assert len({style.colour for style in STATUS_STYLES.values()}) == len(STATUS_LABELS)
    assert len({style.name for style in STATUS_STYLES.values()}) == len(STATUS_LABELS)
    assert all(style.meaning.endswith(".") for style in STATUS_STYLES.values())
    assert style_of("break").name == "break"

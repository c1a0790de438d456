"""A change of ``corrections.toml`` that was made from one version of the file, applied to a later one.

The file is a list of blocks: an entry, or a line of comment. Blocks that the change did not touch stay as the later
version has them. A block that both sides changed is a conflict.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from itertools import chain

from vislam2tag.common.errors import SurveyError
from vislam2tag.site.corrections.edits import corrections_of, entry_spans, text_lines
from vislam2tag.site.corrections.file import CORRECTIONS_FILE

_END = ""
"""Table and body of the last block, which stands for the end of the file."""


@dataclass(frozen=True)
class Conflict:
    """A block that the change starts from, and what is in its place now; None: it was removed."""

    table: str
    """Empty for a comment."""
    expected: str
    now: str | None


class ConflictError(SurveyError):
    """Someone else changed what the change is about."""

    def __init__(self, conflicts: Sequence[Conflict]) -> None:
        super().__init__(
            f"{CORRECTIONS_FILE} was changed in the same place by someone else, so this change was not applied; "
            "compare the values below"
        )
        self.conflicts = tuple(conflicts)


@dataclass(frozen=True)
class _Block:
    """Blank lines and then an entry, or a line of comment."""

    blank: str
    table: str
    body: str

    @property
    def key(self) -> str:
        """Equal for blocks that differ in blanks at the ends of lines only."""
        return "\n".join(line.rstrip() for line in self.body.splitlines())


def merged(base: str, changed: str, current: str) -> str:
    """Apply the change from ``base`` to ``changed`` to the text ``current``, which was made from ``base``, too.

    Raises ConflictError if ``current`` differs from ``base`` where the change does, and SurveyError if the result
    cannot be used.
    """
    if current == base:
        text = changed
    else:
        blocks = _merged(_blocks(base), _blocks(changed), _blocks(current))
        text = "".join(block.blank + block.body for block in blocks)
    corrections_of(text)
    return text


def _merged(base: list[_Block], changed: list[_Block], current: list[_Block]) -> list[_Block]:
    place = _places(base, current)
    known = set(place.values())
    theirs = {block.key for at, block in enumerate(current) if at not in known}
    removed: set[int] = set()
    added: dict[int, list[_Block]] = {}
    conflicts: list[Conflict] = []
    for tag, start, end, low, high in _differences(base, changed):
        if tag == "equal":
            for old, new in zip(range(start, end), range(low, high), strict=True):
                _adopt_blank(base[old], changed[new], current, place.get(old))
            continue
        conflicts += [_conflict(base[old], current, known) for old in range(start, end) if old not in place]
        removed |= {place[old] for old in range(start, end) if old in place}
        fresh = [block for block in changed[low:high] if block.key not in theirs]
        leads = bool(fresh) and not fresh[-1].table and bool(base[start].table)
        added.setdefault(_insertion(place, start, start < end or leads), []).extend(fresh)
    if conflicts:
        raise ConflictError(conflicts)
    kept = ([*added.get(at, []), *([] if at in removed else [block])] for at, block in enumerate(current))
    return _spaced(list(chain.from_iterable(kept)), changed[0], current[0])


def _spaced(blocks: list[_Block], *first: _Block) -> list[_Block]:
    """Blocks with blank lines for their new neighbours: ``first`` are those that began a file before."""
    if blocks[0] not in first:
        blocks[0] = replace(blocks[0], blank="")
    for at, block in enumerate(blocks[1:], start=1):
        if block in first and block.table and not block.blank:
            blocks[at] = replace(block, blank="\n")
    return blocks


def _adopt_blank(old: _Block, new: _Block, current: list[_Block], at: int | None) -> None:
    """Let a block that stays have the blank lines that the change gives it, unless the other side changed them."""
    if at is not None and current[at].blank == old.blank:
        current[at] = replace(current[at], blank=new.blank)


def _places(base: Sequence[_Block], current: Sequence[_Block]) -> dict[int, int]:
    """Where blocks of ``base`` are in ``current``, by number; blocks that moved count if there is one such block."""
    place: dict[int, int] = {}
    for tag, start, end, low, high in _differences(base, current):
        if tag == "equal":
            place |= zip(range(start, end), range(low, high), strict=True)
    taken = set(place.values())
    for old, block in enumerate(base):
        found = [at for at, other in enumerate(current) if other.key == block.key and at not in taken]
        if old not in place and len(found) == 1:
            place[old] = found[0]
            taken.add(found[0])
    return place


def _insertion(place: dict[int, int], start: int, leads: bool) -> int:
    """Before which current block something belongs that is before block ``start`` of the base.

    It goes with that block if it replaces it or is a comment that ``leads`` it, else with the block before.
    """
    if leads and start in place:
        return place[start]
    before = [place[old] for old in range(start) if old in place]
    return before[-1] + 1 if before else 0


def _conflict(block: _Block, current: Sequence[_Block], known: set[int]) -> Conflict:
    """A block that is not there any more, and what someone else made of it: the new block that shares most values."""
    lines = set(block.key.split("\n")[1:])
    rivals = [other for at, other in enumerate(current) if other.table == block.table and at not in known]
    shared = [len(lines & set(other.key.split("\n"))) for other in rivals]
    most = max(shared, default=0)
    return Conflict(
        block.table, block.body, rivals[shared.index(most)].body if most or (rivals and not block.table) else None
    )


def _differences(one: Sequence[_Block], other: Sequence[_Block]) -> Sequence[tuple[str, int, int, int, int]]:
    before, after = ([block.key for block in blocks] for blocks in (one, other))
    return SequenceMatcher(None, before, after, autojunk=False).get_opcodes()


def _blocks(text: str) -> list[_Block]:
    """A text cut into blocks; the last one is the file's end."""
    lines = text_lines(text)
    spans = {start: (table, end) for table, start, end in entry_spans(lines)}
    return list(_cut(lines, spans))


def _cut(lines: Sequence[str], spans: dict[int, tuple[str, int]]) -> Iterator[_Block]:
    blank, at = "", 0
    while at < len(lines):
        table, end = spans.get(at, ("", at + 1))
        body = "".join(lines[at:end])
        if body.strip():
            yield _Block(blank, table, body if body.endswith("\n") else body + "\n")
            blank = ""
        else:
            blank += body
        at = end
    yield _Block(blank, _END, _END)

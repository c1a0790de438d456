"""Two sets of ids that should name the same things: which agree, and how one set is written in the other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from os.path import commonprefix

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray

_SIMILAR = 0.5
"""Least similarity (difflib's ratio) of a name that is proposed for one that does not exist."""


def closest_id(name: str, known: Iterable[str]) -> str | None:
    """The known name that is most similar to one that does not exist; None if none is similar."""
    by_form = {each.casefold(): each for each in sorted(known)}
    found = get_close_matches(name.casefold(), by_form, 1, _SIMILAR)
    return by_form[found[0]] if found else None


MIN_UNKNOWN = 2
"""One unknown id is a new landmark or a slip; from two on, ids may follow another pattern."""
MIN_SHARE = 0.8
"""A pattern maps at least this share of the unknown ids."""
_SHOWN = 5
_NUMBERED = re.compile(r"(.*?)(\d+)(\D*)", re.DOTALL)
_PADDED = re.compile(r"(?<!\d)0+(?=\d)")
_SEPARATOR = re.compile(r"[\s_.-]+")
_MAX_AFFIX = 40
"""Longest prefix or suffix, letters."""


@dataclass(frozen=True)
class IdPattern:
    """How ids of one set are written in the other."""

    kind: str
    """What differs: ``prefix or suffix``."""
    mapping: Mapping[str, str]
    """From each id that the pattern explains to the one in the other set."""

    @property
    def text(self) -> str:
        """The pattern in words, with an example: ``other prefix or suffix: tag_1 there is 1 here``."""
        theirs, ours = next(iter(self.mapping.items()))
        return f"{self.kind}: {theirs} there is {ours} here"


@dataclass(frozen=True)
class IdComparison:
    """What two sets of ids have in common. ``ours`` is usually a table of the survey."""

    names: tuple[str, str]
    """Names of the two sets in messages, such as ``the landmark table of floor 1``."""
    ours: tuple[str, ...]
    theirs: tuple[str, ...]
    agree: tuple[str, ...]
    unknown: tuple[str, ...]
    """Ids in ``theirs`` that are not in ``ours``."""
    pattern: IdPattern | None
    """How the unknown ids are written in ``ours``; None if no pattern explains them."""

    @property
    def differ(self) -> bool:
        """Whether the sets are of different kinds: a pattern explains the unknown ids, or nothing agrees at all.

        Some unknown ids are usual: landmarks that are not surveyed yet.
        """
        return len(self.unknown) >= MIN_UNKNOWN and (not self.agree or self.pattern is not None)

    @property
    def text(self) -> str:
        """Both sets with their first few ids, how many ids agree, and the pattern."""
        sets = [
            f"{name} has {len(ids)} ids ({', '.join(ids[:_SHOWN])}{', ...' if len(ids) > _SHOWN else ''})"
            for name, ids in zip(self.names, (self.ours, self.theirs), strict=True)
        ]
        agree = f"{len(self.agree)} of them agree" if self.agree else "none of them agree"
        pattern = "no simple pattern maps one set to the other"
        if self.pattern is not None:
            pattern = f"the pattern is: {self.pattern.text}"
        return f"{', '.join(sets)}; {agree}; {pattern}"


def compare_ids(
    ours: Sequence[str], theirs: Sequence[str], names: tuple[str, str] = ("the table", "the log")
) -> IdComparison:
    """Compare two sets of ids and look for the pattern that maps the unknown ones of theirs to ours."""
    known, there = set(ours), set(theirs)
    agree, unknown = (tuple(name for name in theirs if (name in known) is same) for same in (True, False))
    free = tuple(name for name in ours if name not in there)
    pattern = None
    if len(unknown) >= MIN_UNKNOWN and free:
        pattern = max(_patterns(unknown, free, every=not agree), key=lambda one: len(one.mapping), default=None)
    return IdComparison(names, tuple(ours), tuple(theirs), agree, unknown, pattern)


def _patterns(theirs: Sequence[str], ours: Sequence[str], *, every: bool) -> Iterator[IdPattern]:
    """Patterns that explain most of theirs, the simplest first.

    Without ``every`` only patterns that are unlikely by chance when some ids of both sets already agree.
    """
    for kind, form in _PLAIN.items():
        yield from _explained(kind, theirs, ours, form, form)
    own, other = _affixes(theirs), _affixes(ours)
    pairs = [*((affix, _NO_AFFIX) for affix in own), *((_NO_AFFIX, affix) for affix in other)]
    for one, another in pairs + [(one, another) for one in own for another in other if every]:
        yield from _explained("other prefix or suffix", theirs, ours, _without_affix(one), _without_affix(another))
    if every:
        yield from _shifted(theirs, ours)


def _without_case(name: str) -> str:
    return _SEPARATOR.sub("", name).casefold()


def _without_padding(name: str) -> str:
    return _PADDED.sub("", name)


_PLAIN: Mapping[str, Callable[[str], str]] = {
    "upper and lower case or separators": _without_case,
    "zero padding": _without_padding,
    "upper and lower case, separators or zero padding": lambda name: _without_case(_without_padding(name)),
}
"""What may differ, and the form without this difference."""
_NO_AFFIX = ("", "")


def _without_affix(affix: tuple[str, str]) -> Callable[[str], str]:
    """Return a function that removes a prefix and a suffix; it returns an empty text for other names."""

    def core(name: str) -> str:
        inner = name[len(affix[0]) : len(name) - len(affix[1])]
        return _without_padding(inner) if name.startswith(affix[0]) and name.endswith(affix[1]) else ""

    return core


def _affixes(names: Sequence[str]) -> list[tuple[str, str]]:
    """Prefixes and suffixes common to all names, the longest first; digits belong to the id."""
    ahead = commonprefix(names)[:_MAX_AFFIX]  # noqa: RUF071 - ids are no paths
    behind = commonprefix([name[::-1] for name in names])[:_MAX_AFFIX][::-1]  # noqa: RUF071
    heads = [ahead[:length] for length in range(len(ahead), -1, -1) if not ahead[:length][-1:].isdigit()]
    tails = [behind[start:] for start in range(len(behind) + 1) if not behind[start:][:1].isdigit()]
    pairs = [(heads[0], tails[0]), *((head, "") for head in heads), *(("", tail) for tail in tails)]
    return [pair for pair in dict.fromkeys(pairs) if pair != _NO_AFFIX]


def _explained(
    kind: str,
    theirs: Sequence[str],
    ours: Sequence[str],
    their_form: Callable[[str], str],
    our_form: Callable[[str], str],
) -> Iterator[IdPattern]:
    """The pattern, if most of theirs are ours once both are brought to one form, one to one."""
    there: dict[str, list[str]] = {}
    for name in ours:
        there.setdefault(our_form(name), []).append(name)
    mapping = {name: there[form][0] for name in theirs if (form := their_form(name)) and len(there.get(form, ())) == 1}
    if _is_enough(mapping, theirs):
        yield IdPattern(kind, mapping)


def _is_enough(mapping: Mapping[str, str], theirs: Collection[str]) -> bool:
    needed = max(MIN_UNKNOWN, MIN_SHARE * len(theirs))
    return len(mapping) >= needed and len(set(mapping.values())) == len(mapping)


def _shifted(theirs: Sequence[str], ours: Sequence[str]) -> Iterator[IdPattern]:
    """Ids that are numbers with the same letters around them and differ by a constant.

    A few numbers fit a long sequence in many ways, so only a shift by one is likely then.
    """
    own, other = _numbers(theirs), _numbers(ours)
    if own is None or other is None:
        return
    by_number = {number: name for name, number in other.items()}
    differences = Counter(there - here for here in own.values() for there in by_number)
    whole = {
        shift: mapping
        for shift in differences
        if shift
        and _is_enough(
            mapping := {name: by_number[n + shift] for name, n in own.items() if n + shift in by_number}, own
        )
    }
    most = max(map(len, whole.values()), default=0)
    likely = [shift for shift, mapping in whole.items() if len(mapping) == most]
    if len(likely) > 1:
        likely = [shift for shift in likely if abs(shift) == 1]
    if len(likely) == 1:
        yield IdPattern(f"all shifted by {likely[0]:+d}", whole[likely[0]])


def _numbers(names: Sequence[str]) -> dict[str, int] | None:
    """The number in each id; None unless all have one, with the same letters around it."""
    matches = {name: _NUMBERED.fullmatch(name) for name in names}
    found = {name: int(match[2]) for name, match in matches.items() if match is not None and len(match[2]) < 10}
    around = {(match[1], match[3]) for match in matches.values() if match is not None}
    return found if len(found) == len(names) and len(around) == 1 else None


MAX_SHIFT = 5
MIN_LANDMARKS = 3
FITS_M, FITS_SHARE = 0.6, 0.04
"""Tolerance of a distance, and the additional share of the path between both ends: the drift of a tracker."""
MAX_AS_LOGGED = 0.5
"""Ids are suspected only if at most this share of the distances fits the table without a shift ..."""
MIN_SHIFTED = 0.85
"""... and accepted as shifted if at least this share fits with it."""
MIN_DISTANCES, SURE_DISTANCES = 3, 6
MAX_AS_LOGGED_IF_FEW = 1 / 3
"""With fewer distances, only a shift by one is accepted, if all fit with it and at most this share without it."""
MAX_SEEN = 60
"""Landmarks used, from the start of a walk; they suffice."""


@dataclass(frozen=True)
class IdShift:
    """The number to add to logged ids to get those of the table, and how many distances between landmarks fit."""

    shift: int
    as_logged: int
    shifted: int
    known_as_logged: int
    """Distances between landmarks that are both in the table; ``as_logged`` of them fit."""
    known_shifted: int

    @property
    def text(self) -> str:
        """The evidence, in words."""
        how = f"{'adding' if self.shift > 0 else 'subtracting'} {abs(self.shift)}"
        return (
            f"{self.as_logged} of {self.known_as_logged} distances between landmarks fit the table under the logged "
            f"ids, and {self.shifted} of {self.known_shifted} after {how}"
        )


def shift_by_geometry(
    ids: Sequence[str], place: ComplexArray, way_m: FloatArray, table: Mapping[str, complex]
) -> IdShift | None:
    """Find the constant by which all ids of a walk are shifted; None if they are not, or if it cannot be determined.

    ``ids`` (p,) of landmarks as logged; ``place`` (p,) their positions by the tracker, complex metres, in its own
    frame; ``way_m`` (p,) distance walked until then. ``table``: positions of the table's landmarks, complex metres.
    """
    rows = [i for i, name in enumerate(ids) if _number(name) is not None][:MAX_SEEN]
    if len({ids[i] for i in rows}) < MIN_LANDMARKS or len(rows) < MIN_SHIFTED * min(len(ids), MAX_SEEN):
        return None
    first, second = np.triu_indices(len(rows), 1)
    names, at, way = [ids[i] for i in rows], place[rows], way_m[rows]
    logged = np.abs(at[first] - at[second])
    within = FITS_M + FITS_SHARE * np.abs(way[first] - way[second])
    different = np.array([names[i] != names[j] for i, j in zip(first.tolist(), second.tolist(), strict=True)])

    def fit(shift: int) -> tuple[int, int]:
        """Number of distances that fit, and number of known distances, with this shift."""
        wanted = np.array([table.get(_plus(name, shift), np.nan) for name in names], dtype=np.complex128)
        true = np.abs(wanted[first] - wanted[second])
        known = np.isfinite(true) & different
        return int(np.count_nonzero(known & (np.abs(true - logged) < within))), int(np.count_nonzero(known))

    as_logged, known = fit(0)
    if not known or as_logged > MAX_AS_LOGGED * known:
        return None
    found = []
    for shift in sorted(range(-MAX_SHIFT, MAX_SHIFT + 1), key=abs)[1:]:
        fits, there = fit(shift)
        if there < max(MIN_DISTANCES, known // 2):
            continue
        sure = there >= SURE_DISTANCES and fits >= MIN_SHIFTED * there
        if sure or (abs(shift) == 1 and fits == there and as_logged <= MAX_AS_LOGGED_IF_FEW * known):
            found.append(IdShift(shift, as_logged, fits, known, there))
    return max(found, key=lambda one: (one.shifted, -abs(one.shift)), default=None)


def _number(name: str) -> int | None:
    return int(name) if name.isdecimal() and len(name) < 10 else None


def _plus(name: str, shift: int) -> str:
    return str(int(name) + shift) if shift else name

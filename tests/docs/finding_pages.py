"""docs/reference/findings.md, from the program's own list of kinds."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from itertools import groupby

KINDS = files("vislam2tag.common") / "finding_kinds.toml"
FINDINGS_HEAD = """\
# Findings

For whoever met a finding: cause and cure of each kind.

Made by `make docs-pages` of `src/vislam2tag/common/finding_kinds.toml`.

Problems of the data are findings: counted, reported with file and first lines, never silent. Only what makes a session
impossible to map is an `error`; `info` needs no action. One kind may come up in several places.
"""
FINDINGS_FOOT = """
## Which command reports them

`landmark_never_passed`, `too_few_landmarks`, `contradicting_landmark`, `not_converged`, `unreadable_truth`, `pose_lag`,
`survey_fault` and `excluded_session` come from `process`; those of presses that are not scored and of the total station
from `evaluate`. Of a survey's site and files `inspect` and `process` report all others.
"""


def finding_texts() -> list[tuple[str, dict[str, str]]]:
    """Every kind with where it comes up, ``severity``, ``meaning`` and ``cure``; in order."""
    listed = tomllib.loads(KINDS.read_text(encoding="utf-8"))
    texts = [(kind, entry) for kind, entries in listed.items() for entry in entries]
    wheres = list(dict.fromkeys(entry["where"] for _, entry in texts))
    return sorted(texts, key=lambda text: wheres.index(text[1]["where"]))


def findings_page() -> str:
    """docs/reference/findings.md: a section for each place, a heading for each kind so that a search finds it."""
    parts = [FINDINGS_HEAD]
    for where, texts in groupby(finding_texts(), key=lambda text: text[1]["where"]):
        parts.append(f"\n## {where[0].upper()}{where[1:]}\n")
        parts += [
            f"\n### `{kind}`\n\n*{entry['severity']}*: {entry['meaning']}.\n\n**What to do**: {entry['cure']}.\n"
            for kind, entry in texts
        ]
    return "".join(parts) + FINDINGS_FOOT

"""Make docs/reference/findings.md from the list of kinds in the program."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from itertools import groupby

KINDS = files("vislam2tag.common") / "finding_kinds.toml"
FINDINGS_HEAD = """\
# Findings

A finding is a problem in your data, reported with its file and first lines. This page explains every kind.

An `error` prevents a session from being mapped, or makes its labels wrong. A `warning` may affect the labels. An `info`
usually needs no action. `inspect` and `process` report most findings, `evaluate` those about control points and the
total station.
"""


def finding_texts() -> list[tuple[str, dict[str, str]]]:
    """Every kind with ``where`` it comes up, ``severity``, ``meaning`` and ``cure``, sorted by place."""
    listed = tomllib.loads(KINDS.read_text(encoding="utf-8"))
    texts = [(kind, entry) for kind, entries in listed.items() for entry in entries]
    wheres = list(dict.fromkeys(entry["where"] for _, entry in texts))
    return sorted(texts, key=lambda text: wheres.index(text[1]["where"]))


def findings_page() -> str:
    """The page: a section for each place, a heading for each kind so that a search finds it."""
    parts = [FINDINGS_HEAD]
    for where, texts in groupby(finding_texts(), key=lambda text: text[1]["where"]):
        parts.append(f"\n## {where[0].upper()}{where[1:]}\n")
        parts += [
            f"\n### `{kind}`\n\n*{entry['severity']}*: {entry['meaning']}\n\n**What to do**: {entry['cure']}\n"
            for kind, entry in texts
        ]
    return "".join(parts)

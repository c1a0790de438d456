"""Cutting signature texts where brackets and quotes allow it."""

from __future__ import annotations

import re

_ANNOTATION = re.compile(r"@[\w.$]+")


def after_literal(text: str, start: int) -> int:
    """The place after the string literal that begins at `start`."""
    at = start + 1
    while text[at] != '"':
        at += 2 if text[at] == "\\" else 1
    return at + 1


def after_bracket(text: str, start: int, opening: str, closing: str) -> int:
    """The place after the bracket that closes the one at `start`; quoted ones do not count."""
    depth = 0
    at = start
    while at < len(text):
        if text[at] == '"':
            at = after_literal(text, at)
            continue
        depth += (text[at] == opening) - (text[at] == closing)
        at += 1
        if depth == 0:
            return at
    raise ValueError(f"unbalanced {opening}{closing}: {text}")


def without_annotations(text: str) -> str:
    """The text without `@Name` and `@Name(...)`; the keyword `@interface` stays."""
    kept = []
    at = 0
    while at < len(text):
        if text[at] == '"':
            end = after_literal(text, at)
            kept.append(text[at:end])
            at = end
        elif text[at] == "@" and not text.startswith("@interface", at):
            at = _after_annotation(text, at)
        else:
            kept.append(text[at])
            at += 1
    return "".join(kept)


def _after_annotation(text: str, start: int) -> int:
    name = _ANNOTATION.match(text, start)
    if name is None:
        raise ValueError(f"no annotation at {start}: {text}")
    at = name.end()
    if text.startswith("(", at):
        at = after_bracket(text, at, "(", ")")
    while text.startswith(" ", at):
        at += 1
    return at


def split(text: str, separator: str) -> list[str]:
    """The parts between separators that stand in no bracket, without blanks around them."""
    parts = [""]
    depth = 0
    for character in text:
        depth += (character in "<(") - (character in ">)")
        if depth == 0 and character == separator:
            parts.append("")
        else:
            parts[-1] += character
    stripped = [part.strip() for part in parts]
    return stripped if stripped[-1] else stripped[:-1]

"""How we write, as far as a program can judge it: words that we do not use, long sentences, headings that ask.

``python -m tests.docs.style [PATH ...]`` prints every fault of these files or folders, by default of all; with
``--doubtful`` words, too, that are only sometimes wrong.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
MAX_WORDS = 35
WORDS = re.compile(
    r"\b(?:told|tells?|telling|whoever|anew|nobody|lacks?|lacked|lacking|but for)\b",
    re.IGNORECASE,
)
DOUBTFUL = re.compile(
    r"\b(?:holds?|stands?|lies|is no|are no|nearer|farther|loud\w*|what of|of the same|aside|as is)\b|\b\w+ of which\b",
    re.IGNORECASE,
)
"""Words that are often wrong, and sometimes right: ``--doubtful`` lists them, no test does."""
SENTENCE_END = re.compile(r"(?<=[.!?])[)\"'”]*\s+(?=[\"'“(]?[A-Z0-9{X])")
CODE = re.compile(r"``[^`]*``|`[^`]*`|:\w+:`[^`]*`")
ASKING = re.compile(r"(?:What|Where)\b")


class Passage(NamedTuple):
    """A paragraph, a message or a comment, with the line that it begins in."""

    line: int
    text: str


class Fault(NamedTuple):
    """What is wrong with a passage."""

    file: str
    line: int
    message: str


def faults_of(path: Path, doubtful: bool = False) -> list[Fault]:
    """All faults of a file: Markdown, Python, TOML, TypeScript, Svelte, HTML or JavaScript."""
    text = path.read_text(encoding="utf-8")
    name = path.relative_to(ROOT).as_posix()
    passages = {".md": _of_markdown, ".py": _of_python, ".toml": _of_toml}.get(path.suffix, _of_quoted)
    found = [Fault(name, line, message) for line, said in passages(text) for message in _faults_in(said, doubtful)]
    if path.suffix == ".md":
        found += [Fault(name, line, message) for line, message in _headings(text, how_to="how-to/" in name)]
    return found


def _faults_in(text: str, doubtful: bool) -> Iterator[str]:
    plain = " ".join(CODE.sub("X", text).split())
    for word in (*WORDS.finditer(plain), *(DOUBTFUL.finditer(plain) if doubtful else ())):
        yield f"uses '{word[0]}': …{plain[max(0, word.start() - 40) : word.end() + 40]}…"
    for sentence in re.split(r", (?=\d+ )", plain) if plain.startswith("Exit code") else SENTENCE_END.split(plain):
        count = len([word for word in sentence.split() if re.search(r"\w", word) and word.strip(",.") != "X"])
        if count > MAX_WORDS:
            yield f"has a sentence of {count} words: {sentence[:90]}…"


def _headings(text: str, how_to: bool) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), 1):
        if how_to and (heading := re.match(r"#+ (.*)", line)) and ASKING.match(heading[1]):
            yield number, f"heading begins with What or Where: {heading[1]}"


def _of_markdown(text: str) -> Iterator[Passage]:
    """Paragraphs, list items and cells of tables; no code and no addresses of links."""
    text = re.sub(r"^( *)```.*?^ *```", lambda code: "\n" * code[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"<!--.*?-->|\$\$.*?\$\$", lambda hidden: "\n" * hidden[0].count("\n"), text, flags=re.DOTALL)
    text = re.sub(r"\$[^$\n]+\$|\\\(.+?\\\)", "X", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)\s]*\)", r"\1", text)
    start, block = 1, list[str]()
    for number, line in enumerate([*text.splitlines(), ""], 1):
        if not line.strip() or re.match(r"\s*(?:[-*>] |\d+\. |#|\|)", line):
            if block:
                yield Passage(start, " ".join(block))
            start, block = number, []
        if line.startswith("|"):
            yield from (Passage(number, cell) for cell in line.strip("|").split("|"))
        elif line.strip() and not line.startswith("    "):
            block.append(line.strip().lstrip("#>-* "))


def _of_python(text: str) -> Iterator[Passage]:
    """Docstrings by paragraph, texts of three words or more, and comments."""
    tree = ast.parse(text)
    inside = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield from _prose(node.lineno, _as_text(node))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in inside:
            yield from _prose(node.lineno, node.value)
    said = list[str]()
    first, last = 0, -1
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            line = token.start[0]
            if line != last + 1:
                yield Passage(first, " ".join(said))
                first, said = line, []
            said.append(token.string.lstrip("# "))
            last = line
    yield Passage(first, " ".join(said))


def _as_text(node: ast.JoinedStr) -> str:
    """An f-string with X for each value."""
    return "".join(
        str(part.value) if isinstance(part, ast.Constant) else " ".join(_literals(part)) or "X" for part in node.values
    )


def _literals(node: ast.AST) -> Iterator[str]:
    """Texts that a value of an f-string may be, such as both ends of a condition."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value


def _prose(line: int, text: str) -> Iterator[Passage]:
    """Paragraphs and list items of a text that is not code."""
    at = line
    text = re.sub(r"^ {4,}(?:python|vislam2tag) .*$|<[^>]*>", "", text, flags=re.MULTILINE)  # commands and tags
    for paragraph in re.split(r"(\n\s*\n|\n\s*(?=[*-] |[\w`]+: ))", text):
        if paragraph.lstrip().startswith("\b"):  # Click keeps the lines of such a paragraph
            yield from (Passage(at + below, part) for below, part in enumerate(paragraph.splitlines()))
        elif len(re.findall(r"[A-Za-z]{2,}", paragraph)) >= 2 and " " in paragraph.strip():
            yield Passage(at, paragraph)
        at += paragraph.count("\n")


def _of_toml(text: str) -> Iterator[Passage]:
    for number, line in enumerate(text.splitlines(), 1):
        if (value := re.match(r"\w+ = (['\"])(.*)\1$", line)) or (value := re.match(r"(#) (.*)", line)):
            yield Passage(number, value[2])


def _of_quoted(text: str) -> Iterator[Passage]:
    """Texts in quotes and between tags."""
    for number, line in enumerate(text.splitlines(), 1):
        for said in re.findall(r"'([^']*)'|\"([^\"]*)\"|>([^<>{}]+)<|(?:^|\s)(?://|\*) (.*)", line):
            yield from (Passage(number, part) for part in said if " " in part.strip())


def sources() -> list[Path]:
    """Every file that the rules are for."""
    patterns = (
        "*.md",
        "docs/**/*.md",
        "src/**/*.py",
        "src/**/*.toml",
        "src/vislam2tag/views/templates/*",
        "src/vislam2tag/pipeline/positioning/page/*.html",
        "src/vislam2tag/studio/receiving/*.html",
        "src/vislam2tag/pipeline/positioning/page/*.js",
        "studio/src/words/en.ts",
        "studio/src/**/*.svelte",
        "android/**/strings.xml",
        "benchmarks/*.md",
        "benchmarks/*.py",
        "examples/**/*.py",
    )
    return sorted({path for pattern in patterns for path in ROOT.glob(pattern) if path.suffix != ".css"})


def main(words: list[str]) -> int:
    doubtful = "--doubtful" in words
    names = [word for word in words if word != "--doubtful"]
    given = [Path(name).resolve() for name in names] or [ROOT]
    paths = [path for path in sources() if any(path == one or one in path.parents for one in given)]
    count = 0
    for path in paths:
        for fault in faults_of(path, doubtful):
            count += 1
            print(f"{fault.file}:{fault.line}: {fault.message}")
    print(f"{count} faults in {len(paths)} files")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Reads AOSP's text of signatures (`api/current.txt`, "Signature format: 2.0") into classes."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from apistubs.text import after_bracket, split, without_annotations

_MODIFIERS = {"public", "private", "protected", "static", "final", "abstract", "default", "synchronized", "native"}
_MODIFIERS |= {"transient", "volatile", "strictfp", "deprecated", "sealed", "non-sealed"}
_FIELD = re.compile(r"(?P<type>.*?)(?P<name>[\w$]+)(?: = (?P<value>.*?))?;(?: //.*)?$")
_CLAUSE = re.compile(r"(extends|implements) (.*?)(?= (?:extends|implements) |$)")
_HIDDEN_BLANK = "\x01"


@dataclass(frozen=True)
class Field:
    """A field or the constant of an enum; `value` is its literal where it is a constant."""

    modifiers: frozenset[str]
    type: str
    name: str
    value: str | None
    is_enum_constant: bool


@dataclass(frozen=True)
class Method:
    """A method; a constructor is called `<init>` and returns `void`."""

    modifiers: frozenset[str]
    type_parameters: str
    returns: str
    name: str
    parameters: list[str]
    throws: list[str]


@dataclass
class ApiClass:
    """A class, interface, enum or annotation; the name of a nested one is dotted."""

    package: str
    name: str
    modifiers: frozenset[str]
    kind: str
    type_parameters: str = ""
    extends: str | None = None
    implements: list[str] = field(default_factory=list)
    constructors: list[Method] = field(default_factory=list)
    methods: list[Method] = field(default_factory=list)
    fields: list[Field] = field(default_factory=list)

    @property
    def dotted(self) -> str:
        """As the source names it: `java.util.Map.Entry`."""
        return f"{self.package}.{self.name}"

    @property
    def binary(self) -> str:
        """As class files name it: `java/util/Map$Entry`."""
        return self.package.replace(".", "/") + "/" + self.name.replace(".", "$")

    @property
    def is_interface(self) -> bool:
        """An annotation is one too."""
        return self.kind in ("interface", "@interface")

    @property
    def enclosing(self) -> str | None:
        """Dotted name of the class that this one stands in; None at the top."""
        return self.dotted.rpartition(".")[0] if "." in self.name else None

    @property
    def is_inner(self) -> bool:
        """Nested and not static, so that its objects know one of the enclosing class."""
        return "." in self.name and "static" not in self.modifiers and self.kind == "class"


def read(path: Path, classes: dict[str, ApiClass]) -> None:
    """Adds the file's classes by dotted name; a class that is there already gets further members.

    Raises ValueError with file and line where the text is not understood.
    """
    package = ""
    current: ApiClass | None = None
    for number, raw in enumerate(path.read_text("utf-8").splitlines(), 1):
        line = raw.strip()
        try:
            if not line or line.startswith("//"):
                continue
            if current is None and (opened := re.match(r"(?:@.*\s)?package ([\w.]+) \{$", line)):
                package = opened[1]
            elif line == "}":
                current = None
            elif line.endswith("{"):
                declared = _class(package, without_annotations(line)[:-1].strip())
                current = classes.setdefault(declared.dotted, declared)
            elif current is not None:
                _member(current, without_annotations(line))
        except (ValueError, IndexError) as error:
            raise ValueError(f"{path}:{number}: {error}: {line}") from error


def _class(package: str, text: str) -> ApiClass:
    modifiers, text = _modifiers(text)
    kind, text = text.split(None, 1)
    name = re.match(r"[\w.$]+", text)
    if name is None:
        raise ValueError("no name of a class")
    type_parameters, clauses = _type_parameters(text[name.end() :].lstrip())
    made = ApiClass(package, name[0], modifiers, kind, type_parameters)
    for word, types in _CLAUSE.findall(_hidden(clauses)):
        named = split(types.replace(_HIDDEN_BLANK, " "), " ")
        if word == "extends" and kind == "class":
            made.extends = named[0]
        else:
            made.implements += named
    return made


def _hidden(text: str) -> str:
    """With other blanks inside of <...>: `extends` there begins no clause."""
    hidden = []
    depth = 0
    for character in text:
        depth += character == "<"
        hidden.append(_HIDDEN_BLANK if character == " " and depth else character)
        depth -= character == ">"
    return "".join(hidden)


def _member(owner: ApiClass, text: str) -> None:
    kind, text = text.split(None, 1)
    modifiers, text = _modifiers(text)
    if kind in ("field", "enum_constant"):
        owner.fields.append(_field(modifiers, text, kind == "enum_constant"))
    elif kind == "ctor":
        owner.constructors.append(_method(modifiers, text, is_constructor=True))
    elif kind == "method":
        owner.methods.append(_method(modifiers, text, is_constructor=False))
    else:
        raise ValueError(f'unknown member "{kind}"')


def _field(modifiers: frozenset[str], text: str, is_enum_constant: bool) -> Field:
    match = _FIELD.match(text)
    if match is None:
        raise ValueError("no field")
    return Field(modifiers, match["type"].strip(), match["name"], match["value"] or None, is_enum_constant)


def _method(modifiers: frozenset[str], text: str, *, is_constructor: bool) -> Method:
    type_parameters, text = _type_parameters(text.rstrip(";"))
    opening = text.index("(")
    end = after_bracket(text, opening, "(", ")")
    parameters = split(text[opening + 1 : end - 1], ",")
    tail = text[end:].strip()
    throws = split(tail.removeprefix("throws").split(" default ")[0], ",") if tail.startswith("throws") else []
    if is_constructor:
        return Method(modifiers, type_parameters, "void", "<init>", parameters, throws)
    returns, name = text[:opening].rsplit(None, 1)
    return Method(modifiers, type_parameters, returns, name, parameters, throws)


def _modifiers(text: str) -> tuple[frozenset[str], str]:
    found = set()
    while (word := re.match(r"([\w-]+)\s+", text)) and word[1] in _MODIFIERS:
        found.add(word[1])
        text = text[word.end() :]
    return frozenset(found), text


def _type_parameters(text: str) -> tuple[str, str]:
    if not text.startswith("<"):
        return "", text
    end = after_bracket(text, 0, "<", ">")
    return text[1 : end - 1], text[end:].lstrip()

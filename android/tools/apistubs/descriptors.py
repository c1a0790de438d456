"""Types of the text as class files write them: erased descriptors and generic signatures (JVMS 4.3, 4.7.9)."""

from __future__ import annotations

import re

from apistubs.signatures import ApiClass
from apistubs.text import after_bracket, split

PRIMITIVES = {
    "void": "V",
    "boolean": "Z",
    "byte": "B",
    "char": "C",
    "short": "S",
    "int": "I",
    "long": "J",
    "float": "F",
    "double": "D",
}
Scope = dict[str, list[str]]
"""Type parameters that a member sees, each with its bounds."""


def scope(type_parameters: str, outer: Scope) -> Scope:
    """The outer parameters and those of this text, as `K, V extends Comparable<V>`."""
    seen = dict(outer)
    for parameter in split(type_parameters, ","):
        name, _, bounds = parameter.partition(" extends ")
        seen[name.strip()] = split(bounds, "&") if bounds else ["java.lang.Object"]
    return seen


def is_generic(text: str, seen: Scope) -> bool:
    """Does the type name a type parameter, or have arguments?"""
    return "<" in text or re.sub(r"(\[\]|\.\.\.)", "", text).strip() in seen


def _element(text: str) -> tuple[int, str]:
    """Dimensions of an array type, and its element type."""
    text = text.strip()
    dimensions = 0
    while text.endswith(("...", "[]")):
        text = text.removesuffix("...") if text.endswith("...") else text.removesuffix("[]")
        text = text.strip()
        dimensions += 1
    return dimensions, text


class Descriptors:
    """Writes types, given all classes that the text knows."""

    def __init__(self, classes: dict[str, ApiClass]) -> None:
        self._classes = classes

    def known(self, name: str) -> ApiClass | None:
        """The class of this dotted name, which may leave `java.lang` out."""
        return self._classes.get(name) or self._classes.get("java.lang." + name)

    def binary(self, name: str) -> str:
        """The binary name of a class, of one that the text does not know by the case of its letters."""
        if known := self.known(name):
            return known.binary
        parts = name.split(".")
        first = next((i for i, part in enumerate(parts) if part[:1].isupper()), len(parts) - 1)
        return "/".join([*(parts[:first] or ["java", "lang"]), "$".join(parts[first:])])

    def erased(self, text: str, seen: Scope) -> str:
        """The descriptor of a type without generics."""
        dimensions, element = _element(text)
        if element in PRIMITIVES:
            return "[" * dimensions + PRIMITIVES[element]
        base = re.sub(r"<.*>", "", element)
        if base in seen:
            bound = self.erased(seen[base][0], {name: bounds for name, bounds in seen.items() if name != base})
            return "[" * dimensions + bound
        return "[" * dimensions + f"L{self.binary(base)};"

    def erased_class(self, text: str, seen: Scope) -> str:
        """The binary name of a class type without generics."""
        return self.erased(text, seen)[1:-1]

    def signature(self, text: str, seen: Scope) -> str:
        """The generic signature of a type."""
        dimensions, element = _element(text)
        return "[" * dimensions + self._element_signature(element, seen)

    def _element_signature(self, text: str, seen: Scope) -> str:
        if text in PRIMITIVES:
            return PRIMITIVES[text]
        if text in seen:
            return f"T{text};"
        if "<" not in text:
            return f"L{self.binary(text)};"
        opening = text.index("<")
        end = after_bracket(text, opening, "<", ">")
        signature = f"L{self.binary(text[:opening])}{self._arguments(text[opening + 1 : end - 1], seen)}"
        inner = text[end:].removeprefix(".")
        if inner:  # Outer<A>.Inner<B>
            name, _, arguments = inner.partition("<")
            signature += "." + name.replace(".", "$")
            signature += self._arguments(arguments[:-1], seen) if arguments else ""
        return signature + ";"

    def _arguments(self, text: str, seen: Scope) -> str:
        return "<" + "".join(self._argument(argument, seen) for argument in split(text, ",")) + ">"

    def _argument(self, text: str, seen: Scope) -> str:
        for word, sign in (("? extends ", "+"), ("? super ", "-")):
            if text.startswith(word):
                return sign + self.signature(text.removeprefix(word), seen)
        return "*" if text == "?" else self.signature(text, seen)

    def type_parameters(self, text: str, seen: Scope) -> str:
        """The signature of declared type parameters; empty where there are none."""
        declared = [self._type_parameter(parameter, seen) for parameter in split(text, ",")]
        return "<" + "".join(declared) + ">" if declared else ""

    def _type_parameter(self, text: str, seen: Scope) -> str:
        name = text.partition(" extends ")[0].strip()
        signature = name
        for place, bound in enumerate(seen[name]):
            base = re.sub(r"<.*>", "", bound)
            known = self.known(base)
            is_interface = base not in seen and known is not None and known.is_interface
            # The first bound is a class; where it is an interface the class is left out.
            signature += ("::" if place == 0 and is_interface else ":") + self.signature(bound, seen)
        return signature

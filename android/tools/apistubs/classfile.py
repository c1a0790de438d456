"""Writes a class of the text as a class file (JVMS 4): real signatures, constants and generics, stubs for bodies."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable

from apistubs.code import answering, attribute, constructing, throwing
from apistubs.descriptors import PRIMITIVES, Descriptors, Scope, is_generic, scope
from apistubs.pool import STRINGS, Pool
from apistubs.signatures import ApiClass, Field, Method

_JAVA_8 = 52
_FINAL, _SUPER, _VARARGS, _INTERFACE, _ABSTRACT, _ANNOTATION, _ENUM = 0x10, 0x20, 0x80, 0x200, 0x400, 0x2000, 0x4000
_PUBLIC, _STATIC = 0x1, 0x8
_ACCESS = {"public": _PUBLIC, "private": 2, "protected": 4, "static": _STATIC, "final": _FINAL, "abstract": _ABSTRACT}
_VISIBLE = 7


def _access(modifiers: Iterable[str]) -> int:
    return sum(_ACCESS.get(modifier, 0) for modifier in modifiers)


class World:
    """All classes of a jar, which a class file must know some of; `mockable` as in :func:`class_file`."""

    def __init__(self, classes: dict[str, ApiClass], *, mockable: bool) -> None:
        self.classes = classes
        self.mockable = mockable
        self.by_binary = {made.binary: made for made in classes.values()}
        self.descriptors = Descriptors(classes)
        self.members: dict[str, list[ApiClass]] = {}
        for made in classes.values():
            if made.enclosing:
                self.members.setdefault(made.enclosing, []).append(made)

    def enclosing(self, made: ApiClass) -> ApiClass | None:
        """The class that this one stands in."""
        return self.classes.get(made.enclosing) if made.enclosing else None


def class_file(made: ApiClass, world: World) -> bytes:
    """The bytes of one class file.

    Of a mockable class nothing is final and bodies answer 0, false or null; else bodies throw, as in the SDK's own jar.
    """
    return _ClassWriter(made, world).packed()


class _ClassWriter:
    def __init__(self, made: ApiClass, world: World) -> None:
        self._made = made
        self._world = world
        self._types = world.descriptors
        self._pool = Pool()
        self._outer = world.enclosing(made)
        self._is_inner = made.is_inner and self._outer is not None and self._outer.kind == "class"
        self._seen = self._scope()
        self._is_enum = made.kind == "enum"
        self._super = made.extends if made.extends or made.binary == "java/lang/Object" else "java.lang.Object"
        annotation = ["java.lang.annotation.Annotation"]
        self._interfaces = annotation if made.kind == "@interface" else made.implements

    def packed(self) -> bytes:
        signature = self._class_signature()
        super_ = (
            "java/lang/Enum" if self._is_enum else self._types.erased_class(self._super, {}) if self._super else None
        )
        fields = [self._field(member) for member in _first_of_each_name(self._made.fields)]
        methods = self._methods()
        names = [self._pool.class_(self._made.binary), self._pool.class_(super_) if super_ else 0]
        interfaces = [self._pool.class_(self._types.erased_class(name, {})) for name in self._interfaces]
        attributes = [self._signature_attribute(signature)] if signature else []
        nested = self._inner_classes()
        if nested:
            attributes.append(attribute(self._pool, "InnerClasses", struct.pack(">H", len(nested)) + b"".join(nested)))
        body = struct.pack(">HHH", self._flags(), *names)
        body += struct.pack(f">H{len(interfaces)}H", len(interfaces), *interfaces)
        for part in (fields, methods, attributes):
            body += struct.pack(">H", len(part)) + b"".join(part)
        return b"\xca\xfe\xba\xbe" + struct.pack(">HH", 0, _JAVA_8) + self._pool.packed() + body

    def _scope(self) -> Scope:
        """Type parameters of the class, and of those that an inner one stands in."""
        chain = [self._made]
        while self._is_inner and (above := self._world.enclosing(chain[0])):
            chain.insert(0, above)
        seen: Scope = {}
        for made in chain:
            seen = scope(made.type_parameters, seen)
        return seen

    def _class_signature(self) -> str:
        interfaces = "".join(self._types.signature(name, self._seen) for name in self._interfaces)
        if self._is_enum:
            return f"Ljava/lang/Enum<L{self._made.binary};>;" + interfaces
        generic = (
            self._made.type_parameters or "<" in (self._super or "") or any("<" in name for name in self._interfaces)
        )
        if not generic or not self._super:
            return ""
        own = self._types.type_parameters(self._made.type_parameters, self._seen)
        return own + self._types.signature(self._super, self._seen) + interfaces

    def _flags(self) -> int:
        made = self._made
        flags = _access(made.modifiers) & (_PUBLIC | _FINAL | _ABSTRACT)
        flags |= _INTERFACE | _ABSTRACT if made.is_interface else _SUPER
        if "protected" in made.modifiers:
            flags |= _PUBLIC
        if made.kind == "@interface":
            flags |= _ANNOTATION
        if self._is_enum:
            return flags | _ENUM | (_ABSTRACT if any("abstract" in m.modifiers for m in made.methods) else _FINAL)
        return flags & ~_FINAL if self._world.mockable else flags

    def _member(self, access: int, name: str, descriptor: str, attributes: list[bytes]) -> bytes:
        head = struct.pack(">HHHH", access, self._pool.utf8(name), self._pool.utf8(descriptor), len(attributes))
        return head + b"".join(attributes)

    def _signature_attribute(self, signature: str) -> bytes:
        return attribute(self._pool, "Signature", struct.pack(">H", self._pool.utf8(signature)))

    def _note(self, descriptor: str) -> None:
        """Nested classes that a descriptor names have a row in InnerClasses."""
        self._pool.nested.update(name for name in re.findall(r"L([^;<>]+)[;<]", descriptor) if "$" in name)

    def _field(self, member: Field) -> bytes:
        descriptor = self._types.erased(member.type, self._seen)
        self._note(descriptor)
        access = _access(member.modifiers) | (_ENUM if member.is_enum_constant else 0)
        if self._made.is_interface:
            access = _PUBLIC | _STATIC | _FINAL
        attributes = []
        is_constant = member.type in STRINGS or member.type in PRIMITIVES
        if member.value is not None and is_constant and access & _STATIC:
            constant = self._pool.constant(member.type, member.value)
            attributes.append(attribute(self._pool, "ConstantValue", struct.pack(">H", constant)))
        if is_generic(member.type, self._seen):
            attributes.append(self._signature_attribute(self._types.signature(member.type, self._seen)))
        return self._member(access, member.name, descriptor, attributes)

    def _methods(self) -> list[bytes]:
        """Those of the text, each name and descriptor once, and what every enum has."""
        members = [*self._made.constructors, *self._made.methods]
        if self._is_enum:
            static = frozenset(("public", "static"))
            members.append(Method(static, "", self._made.dotted + "[]", "values", [], []))
            members.append(Method(static, "", self._made.dotted, "valueOf", ["java.lang.String"], []))
        written: dict[tuple[str, str], bytes] = {}
        for member in members:
            key, content = self._method(member)
            written.setdefault(key, content)
        return list(written.values())

    def _method(self, member: Method) -> tuple[tuple[str, str], bytes]:
        seen = scope(member.type_parameters, self._seen)
        parameters = [self._types.erased(parameter, seen) for parameter in member.parameters]
        if member.name == "<init>" and self._is_inner and self._outer:
            parameters.insert(0, f"L{self._outer.binary};")
        descriptor = "(" + "".join(parameters) + ")" + self._types.erased(member.returns, seen)
        access = self._method_access(member)
        attributes = []
        if not access & _ABSTRACT:
            slots = sum(2 if parameter in "JD" else 1 for parameter in parameters) + (0 if access & _STATIC else 1)
            attributes.append(self._body(member, descriptor, slots))
        if member.throws:
            classes = [self._pool.class_(self._types.erased_class(name, seen)) for name in member.throws]
            packed = struct.pack(f">H{len(classes)}H", len(classes), *classes)
            attributes.append(attribute(self._pool, "Exceptions", packed))
        if member.type_parameters or any(
            is_generic(t, seen) for t in [*member.parameters, member.returns, *member.throws]
        ):
            attributes.append(self._signature_attribute(self._method_signature(member, seen)))
        self._note(descriptor)
        return (member.name, descriptor), self._member(access, member.name, descriptor, attributes)

    def _method_access(self, member: Method) -> int:
        access = _access(member.modifiers)
        if member.parameters and member.parameters[-1].endswith("..."):
            access |= _VARARGS
        is_interface = self._made.is_interface
        if is_interface and not member.modifiers & {"default", "static"}:
            access |= _ABSTRACT
        if is_interface and not access & _VISIBLE:
            access |= _PUBLIC
        return access & ~_FINAL if is_interface or self._world.mockable else access

    def _method_signature(self, member: Method, seen: Scope) -> str:
        signature = self._types.type_parameters(member.type_parameters, seen)
        signature += "(" + "".join(self._types.signature(name, seen) for name in member.parameters) + ")"
        signature += self._types.signature(member.returns, seen)
        if any(name in seen for name in member.throws):
            signature += "".join("^" + self._types.signature(name, seen) for name in member.throws)
        return signature

    def _body(self, member: Method, descriptor: str, slots: int) -> bytes:
        if not self._world.mockable:
            return throwing(self._pool, slots)
        if member.name != "<init>":
            return answering(self._pool, descriptor, slots)
        above = self._types.known(str(self._super))
        if above is None or not above.constructors or ("." in above.name and "static" not in above.modifiers):
            return throwing(self._pool, slots)  # no constructor above that can be called
        shortest = min(above.constructors, key=lambda constructor: len(constructor.parameters))
        seen = scope(shortest.type_parameters, scope(above.type_parameters, {}))
        parameters = [self._types.erased(parameter, seen) for parameter in shortest.parameters]
        return constructing(self._pool, above.binary, parameters, slots)

    def _inner_classes(self) -> list[bytes]:
        """A row for this class, its members and every nested class named, and for those that they stand in."""
        named = self._pool.nested | {member.binary for member in self._world.members.get(self._made.dotted, ())}
        rows: dict[str, ApiClass] = {}
        for binary in named:
            known = self._world.by_binary.get(binary)
            while known is not None and "." in known.name:
                rows[known.binary] = known
                known = self._world.enclosing(known)
        return [self._inner_class(rows[binary]) for binary in sorted(rows, key=lambda name: (name.count("$"), name))]

    def _inner_class(self, nested: ApiClass) -> bytes:
        access = _access(nested.modifiers)
        if self._world.mockable:
            access &= ~_FINAL
        if nested.is_interface:
            access |= _INTERFACE | _ABSTRACT | _STATIC
        if nested.kind == "@interface":
            access |= _ANNOTATION
        if nested.kind == "enum":
            access |= _ENUM | _STATIC
        outer, _, name = nested.binary.rpartition("$")
        own = self._pool.class_(nested.binary)
        enclosing = self._pool.class_(outer) if outer in self._world.by_binary else 0
        return struct.pack(">HHHH", own, enclosing, self._pool.utf8(name), access)


def _first_of_each_name(fields: list[Field]) -> list[Field]:
    named: dict[str, Field] = {}
    for member in fields:
        named.setdefault(member.name, member)
    return list(named.values())

"""Android's interfaces between processes (AIDL) as Java that compiles: what is asked stays in this process."""

from __future__ import annotations

import re
from collections.abc import Callable

COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
ANNOTATION = re.compile(r"@\w+(\s*\([^()]*\))?")
INTERFACE = re.compile(r"\binterface\s+(\w+)\s*\{(.*)\}", re.DOTALL)
DIRECTION = re.compile(r"\b(in|out|inout|oneway)\s+")
TYPE = re.compile(r"(?<![\w.])(?:[a-z]\w*\.)*[A-Z]\w*")
BUILT_IN = {"String", "List", "Map", "CharSequence", "IBinder"}
NUMBER = re.compile(r"\s*=\s*\d+\s*$")

JAVA = """{head}
import android.os.IBinder;
import java.util.*;
public interface {name} extends android.os.IInterface {{
{body}
  abstract class Stub extends android.os.Binder implements {name} {{
    public Stub() {{ attachInterface(this, "{name}"); }}
    public static {name} asInterface(IBinder link) {{ return link instanceof {name} ? ({name}) link : null; }}
    @Override public IBinder asBinder() {{ return this; }}
  }}
}}
"""


def interface(aidl: str) -> re.Match[str] | None:
    """Name and body of the interface; None where the text declares only what can be handed over."""
    return INTERFACE.search(ANNOTATION.sub("", COMMENT.sub("", aidl)))


def java_of(aidl: str, is_known: Callable[[str], bool]) -> str:
    """The interface in Java, without the methods that need a class that is not known (by its dotted name)."""
    found = interface(aidl)
    if not found:
        raise ValueError("no interface in: " + aidl)
    head = [line.strip() for line in re.findall(r"(?:package|import)\s[^;]+;", found.string[: found.start()])]
    package, *names = [line.split()[1].strip(" ;") for line in head]
    imported = {name.rpartition(".")[2]: name for name in names}

    def is_complete(statement: str) -> bool:
        types = {name for name in TYPE.findall(statement) if name not in BUILT_IN}
        return all(is_known(imported.get(name, name if "." in name else f"{package}.{name}")) for name in types)

    parts = [DIRECTION.sub("", NUMBER.sub("", part) if "(" in part else part).strip() for part in found[2].split(";")]
    lines = [f"  {part.removeprefix('const ')};" for part in parts if part and "(" not in part]
    lines += [f"  {part} throws android.os.RemoteException;" for part in parts if "(" in part and is_complete(part)]
    return JAVA.format(head="\n".join(head), name=found[1], body="\n".join(lines))

"""Writes what the build of Android makes from its resources, and no archive has: R, R of its own classes, Manifest.

The numbers are those of the framework-res.apk that the app is linked with; which attributes a view looks at stands in
the sources' attrs.xml. Reads `aapt2 dump resources` on standard input: resource_ids.py INTO RES-FOLDER
"""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

PART = 500  # fields of a class
NAME = "{http://schemas.android.com/apk/res/android}name"
RESOURCE = re.compile(r"^    resource (0x[0-9a-f]{8}) \^?([a-z]+)(?:-private)?/(?!default$|default )([\w.]+)( |$)")


def resource_ids(dump: list[str]) -> dict[str, dict[str, str]]:
    """Number (as Java text) of each resource by type and Java name."""
    found: dict[str, dict[str, str]] = {}
    for line in dump:
        if match := RESOURCE.match(line):
            number, kind, name, _ = match.groups()
            found.setdefault(kind, {})[name.replace(".", "_")] = number
    return found


def styleables(attrs_xml: list[Path], attr_ids: dict[str, str]) -> list[str]:
    """The fields of R.styleable: an array a view, in the order of the numbers, and each attribute's place in it."""
    fields: list[str] = []
    for path in attrs_xml:
        attrs = ElementTree.parse(path).getroot()  # noqa: S314  of sources that are pinned by their hash
        for declared in attrs.iter("declare-styleable"):
            view = declared.get("name", "").replace(".", "_")
            names = {attr.get("name", "").replace(".", "_").replace("android:", "") for attr in declared.iter("attr")}
            known = sorted((int(attr_ids[name], 16), name) for name in names if name in attr_ids)
            fields.append(f"public static final int[] {view} = {{{', '.join(hex(number) for number, _ in known)}}};")
            fields += [f"public static final int {view}_{name} = {place};" for place, (_, name) in enumerate(known)]
    return fields


def java(package: str, ids: dict[str, dict[str, str]], styleable: list[str]) -> str:
    """The text of a package's class R."""
    lines = [f"package {package};", "public final class R {"]
    for kind, numbers in sorted(ids.items()):
        lines += [f"  public static final class {kind} {{"]
        lines += [f"    public static final int {name} = {number};" for name, number in sorted(numbers.items())]
        lines += ["  }"]
    parent = ""
    for start in range(0, len(styleable), PART):  # the JVM takes an initializer of 64 kB at most
        lines += [f"  public static class styleable{start}{parent} {{", *styleable[start : start + PART], "  }"]
        parent = f" extends styleable{start}"
    return "\n".join([*lines, f"  public static final class styleable{parent} {{}}", "}", ""])


def manifest(android_manifest: Path) -> str:
    """The text of android.Manifest."""
    lines = ["package android;", "public final class Manifest {"]
    root = ElementTree.parse(android_manifest).getroot()  # noqa: S314  see above
    for kind, tag in (("permission", "permission"), ("permission_group", "permission-group")):
        names = {node.get(NAME, "") for node in root.iter(tag)}
        lines += [f"  public static final class {kind} {{"]
        lines += [f'    public static final String {name.rpartition(".")[2]} = "{name}";' for name in sorted(names)]
        lines += ["  }"]
    return "\n".join([*lines, "}", ""])


def main(into: Path, res: Path) -> None:
    """Writes the three classes."""
    ids = resource_ids(sys.stdin.read().splitlines())
    styleable = styleables([res / "res/values/attrs.xml", res / "res/values/attrs_manifest.xml"], ids["attr"])
    (into / "com/android/internal").mkdir(parents=True, exist_ok=True)
    (into / "android").mkdir(exist_ok=True)
    (into / "com/android/internal/R.java").write_text(java("com.android.internal", ids, styleable))
    (into / "android/R.java").write_text(java("android", ids, styleable))
    (into / "android/Manifest.java").write_text(manifest(res / "AndroidManifest.xml"))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

"""Readies Android's own Java sources for a JVM: sources.py INTO PACKAGES.txt FAKES STUBS.jar ROOT...

Writes those of the packages and classes named in PACKAGES.txt.

Natives get a body: the method of the same name in fakes/PACKAGE/CLASSNatives.java where there is one (an object's own
natives hand themselves over first), else one that does nothing and returns zero or null, as Android's stubs for tests
do. Natives of the classes named in KEPT stay, for the library of resources.cpp has them. Imports of what is in none of
them, FAKES and STUBS.jar go, so that only the methods that need it fail.
"""

from __future__ import annotations

import re
import sys
import zipfile
from pathlib import Path

import aidl

# What a phone has elsewhere, or its runtime does and a JVM does not.
INSTEAD = {
    "StorageManager.hasIsolatedStorage()": "true",
    "sm.translateAppToSystem(before,\n"
    "                    android.os.Process.myPid(), android.os.Process.myUid())": "before",
    "/system/framework/framework-res.apk": "/usr/share/android-framework-res/framework-res.apk",
    "AppOpsManager.OP_NONE": "-1",
    "Locale.adjustLanguageCode(language)": "language",
    "                    outIndicesAddress);": "outIndicesAddress);"
    " dalvik.system.VMRuntime.fetch(outValuesAddress, outIndicesAddress);",
}
LOGGED_NUMBER = re.compile(r"\b(\w*ProtoEnums|MetricsEvent)\.[A-Z][A-Z_0-9]*\b")  # their classes are generated
UNKNOWN_NAME = re.compile(r"(?<==)\s+SubscriptionManager\.(\w+);")  # of a setting that nobody asks for
KEPT = {"AssetManager", "ApkAssets", "XmlBlock", "StringBlock"}
NATIVE = re.compile(
    r"^(?P<before>[ \t]*(?:@[\w.]+(?:\([^)]*\))?\s+)*(?:(?:public|private|protected|static|final|synchronized)\s+)*)"
    r"native\s+(?P<type>[\w.<>\[\]?, ]+?)\s+(?P<name>\w+)\s*\((?P<parameters>(?:[^()]|\([^()]*\))*)\)\s*"
    r"(?P<throws>throws [\w., \n]+?)?;",
    re.MULTILINE,
)
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*|@\w+(\([^()]*\))?", re.DOTALL)
ASIDE = re.compile(r"/\* ?[A-Z][\w -]* ?\*/|@Nullable")
IMPORT = re.compile(r"^import (static )?([\w.]+?)(\.\*)?;", re.MULTILINE)
METHOD = re.compile(r"^  static [\w.<>\[\]?, ]+ (\w+)\(", re.MULTILINE)
RUNTIME_ANNOTATION = re.compile(r"^\s*@(CriticalNative|FastNative)\b[ \t]*", re.MULTILINE)


def names_of(parameters: str) -> list[str]:
    """The names of a method's parameters, without comments and annotations."""
    return [part.split()[-1].rstrip("[]") for part in COMMENT.sub("", parameters).split(",") if part.strip()]


def body(java_class: str, fakes: set[str], match: re.Match[str]) -> str:
    """A native's declaration with a body."""
    kind = match["type"].split()[-1]
    if match["name"] in fakes:
        is_static = re.search(r"\bstatic\b", match["before"] + match["type"])
        handed = ([] if is_static else ["this"]) + names_of(match["parameters"])
        does = f"{'' if kind == 'void' else 'return '}{java_class}Natives.{match['name']}({', '.join(handed)});"
    else:
        nothing = "return 0;" if kind.islower() and "[" not in kind else "return null;"
        does = {"void": "", "boolean": "return false;"}.get(kind, nothing)
    head = f"{match['before']}{match['type']} {match['name']}({match['parameters']}) {match['throws'] or ''}"
    return f"{head} {{ {does} }}"


class Known:
    """All classes that there are, by dotted name."""

    def __init__(self, sources: set[Path], stubs: Path) -> None:
        self.names = {".".join(source.with_suffix("").parts) for source in sources}
        with zipfile.ZipFile(stubs) as archive:
            classes = [name.removesuffix(".class") for name in archive.namelist() if name.endswith(".class")]
        self.names |= {name.replace("/", ".").replace("$", ".") for name in classes}
        self.packages = {name.rpartition(".")[0] for name in self.names}

    def has(self, name: str) -> bool:
        """Is it a class, a package, or something in a class that is there?"""
        while "." in name:
            if name in self.names or name in self.packages:
                return True
            name = name.rpartition(".")[0]
            if name in self.packages and name not in self.names:
                return False
        return False


def ready(text: str, java_class: str, fakes: set[str], known: Known) -> str:
    """A source that compiles for a JVM."""
    text = RUNTIME_ANNOTATION.sub("", text)
    for phone, jvm in INSTEAD.items():
        text = text.replace(phone, jvm)
    text = LOGGED_NUMBER.sub("0", text)
    text = UNKNOWN_NAME.sub(r' "\1";', text)
    text = IMPORT.sub(lambda match: match[0] if known.has(match[2]) else "", text)
    return text if java_class in KEPT else NATIVE.sub(lambda match: body(java_class, fakes, match), ASIDE.sub("", text))


def chosen(packages: Path, roots: list[Path]) -> dict[Path, Path]:
    """The files of the packages and classes that a file names, Java before AIDL, by the place of their class."""
    found: dict[Path, Path] = {}
    for name in packages.read_text().split():
        if name.startswith("-"):
            del found[Path(name[1:])]
            continue
        pattern = name.removesuffix(".java") if name.endswith(".java") else f"{name}/*"
        for kind in (".aidl", ".java"):
            paths = [(root, path) for root in roots for path in root.glob(pattern + kind) if has_class(path)]
            found |= {path.relative_to(root).with_suffix(".java"): path for root, path in paths}
    return found


def has_class(path: Path) -> bool:
    """Is there more in the file than a comment or names of what can be handed over?"""
    if path.suffix == ".java":
        return path.stem != "package-info"
    return aidl.interface(path.read_text()) is not None


def main(into: Path, packages: Path, fakes: Path, stubs: Path, roots: list[Path]) -> None:
    """Writes the sources, but those that a fake stands for."""
    faked = {path.relative_to(fakes) for path in fakes.rglob("*.java")}
    sources = {place: path for place, path in chosen(packages, roots).items() if place not in faked}
    known = Known(faked | set(sources), stubs)
    for place, path in sources.items():
        natives = fakes / place.with_name(f"{place.stem}Natives.java")
        methods = set(METHOD.findall(natives.read_text())) if natives.exists() else set()
        text = path.read_text() if path.suffix == ".java" else aidl.java_of(path.read_text(), known.has)
        (into / place).parent.mkdir(parents=True, exist_ok=True)
        (into / place).write_text(ready(text, place.stem, methods, known))


if __name__ == "__main__":
    folder, package_list, fake_sources, stubs_jar, *source_roots = [Path(argument) for argument in sys.argv[1:]]
    main(folder, package_list, fake_sources, stubs_jar, source_roots)

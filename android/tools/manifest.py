"""Makes the manifest that the script build packages: the app's own, its ids and versions, and what ARCore's asks for.

The Android Gradle plugin does the same for the Gradle build (namespace, defaultConfig, manifest merger).
usage: manifest.py APP_MANIFEST LIBRARY_MANIFEST GRADLE_PROPERTIES OUTPUT
"""

import sys
from pathlib import Path
from xml.etree import ElementTree

ANDROID = "http://schemas.android.com/apk/res/android"


def properties(path: Path) -> dict[str, str]:
    """The keys and values of a Java properties file without continued lines."""
    lines = (line.strip() for line in path.read_text("utf-8").splitlines())
    return dict(line.split("=", 1) for line in lines if line and not line.startswith("#"))


def merged(app: Path, library: Path, versions: dict[str, str]) -> ElementTree.Element:
    """The app's manifest with package, versions and levels, and with the library's queries and application parts."""
    root = ElementTree.parse(app).getroot()  # noqa: S314  our own file and one that is pinned by its hash
    root.set("package", versions["appId"])
    root.set(f"{{{ANDROID}}}versionCode", versions["appVersionCode"])
    root.set(f"{{{ANDROID}}}versionName", versions["appVersionName"])
    levels = {"minSdkVersion": versions["appMinSdk"], "targetSdkVersion": versions["appTargetSdk"]}
    root.insert(0, ElementTree.Element("uses-sdk", {f"{{{ANDROID}}}{name}": level for name, level in levels.items()}))
    theirs = ElementTree.parse(library).getroot()  # noqa: S314  see above
    root.extend(theirs.findall("queries"))
    application = root.find("application")
    parts = theirs.find("application")
    if application is None or parts is None:
        raise SystemExit(f"{app} and {library} must both have an <application>")
    application.extend(parts)
    return root


def main() -> None:
    """Reads and writes the files named on the command line."""
    app, library, gradle, output = (Path(name) for name in sys.argv[1:])
    ElementTree.register_namespace("android", ANDROID)
    manifest = ElementTree.tostring(merged(app, library, properties(gradle)), encoding="utf-8", xml_declaration=True)
    output.write_bytes(manifest)


if __name__ == "__main__":
    main()

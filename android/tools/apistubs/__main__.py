"""Makes a jar to compile the app against from AOSP's text of signatures; the same text gives the same bytes.

usage: python -m apistubs [--mockable] -o STUBS.jar SIGNATURES.txt [FURTHER.txt ...]
"""

from __future__ import annotations

import argparse
import zipfile
from pathlib import Path

from apistubs.classfile import World, class_file
from apistubs.signatures import ApiClass, read

_TIME = (1980, 1, 1, 0, 0, 0)


def main() -> None:
    """Reads the texts named on the command line and writes the jar."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--mockable", action="store_true", help="for tests: nothing is final, bodies answer 0 or null")
    parser.add_argument("signatures", type=Path, nargs="+")
    arguments = parser.parse_args()
    classes: dict[str, ApiClass] = {}
    for path in arguments.signatures:
        read(path, classes)
    world = World(classes, mockable=arguments.mockable)
    with zipfile.ZipFile(arguments.output, "w") as jar:
        for _, made in sorted(classes.items()):
            entry = zipfile.ZipInfo(made.binary + ".class", _TIME)
            jar.writestr(entry, class_file(made, world), zipfile.ZIP_DEFLATED)
    print(f"{arguments.output.name}: {len(classes)} classes")


if __name__ == "__main__":
    main()

"""Drawings that attack their readers: deep, huge, endless, with numbers and shapes that no drawing has."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Iterator

from reportlab.pdfgen.canvas import Canvas

SVG = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}'>{2}</svg>"
SQUARE = [[0, 0], [30, 0], [30, 20], [0, 20], [0, 0]]


def drawings() -> Iterator[tuple[str, str, bytes]]:
    """What is attacked, the file's name, and its content."""
    yield from _svg()
    yield from _dxf()
    yield from _geojson()
    yield from _osm()
    yield from _archives()
    yield "a model cut off", "plan.ifc", b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('"
    yield (
        "no page",
        "plan.pdf",
        b"%PDF-1.4\n1 0 obj<</Type/Catalog/Pages 2 0 R>>endobj 2 0 obj<</Type/Pages/Kids[]/Count 0>>endobj",
    )
    yield "page of no size", "plan.pdf", _pdf(1e-30, 1e-30)
    yield "page of a huge size", "plan.pdf", _pdf(1e30, 1e30)
    yield "many pixels", "plan.png", _png(13_000, 13_000)
    yield "more pixels than there can be", "plan.png", _png(2**31 - 1, 2**31 - 1)


def _svg() -> Iterator[tuple[str, str, bytes]]:
    deep = "<g>" * 20_000 + "<path d='M0 0L9 9'/>" + "</g>" * 20_000
    blur = "<filter id='f'><feGaussianBlur stdDeviation='1e6'/></filter><rect width='9' height='9' filter='url(#f)'/>"
    dilate = (
        "<filter id='f' x='-9' y='-9' width='99' height='99'><feMorphology operator='dilate' radius='900'/></filter>"
        "<rect width='9' height='9' filter='url(#f)'/>"
    )
    copies = "<g id='a0'><rect width='9' height='9'/></g>"
    for n in range(9):
        copies += f"<g id='a{n + 1}'>" + f"<use href='#a{n}'/>" * 10 + "</g>"
    for what, width, height, inside in (
        ("nested groups", 9, 9, deep),
        ("wide blur", 9, 9, blur),
        ("wide morphology", 9, 9, dilate),
        ("copies of copies", 9, 9, copies),
        ("no size", 1e-300, 1e-300, ""),
        ("size beyond floats", "1e400", "1e400", ""),
        ("one side beyond the other", 1e-200, 1e200, "<path d='M0 0L9 9'/>"),
    ):
        yield what, "plan.svg", SVG.format(width, height, inside).encode()


def _dxf() -> Iterator[tuple[str, str, bytes]]:
    def pairs(*values: object) -> str:
        return "\n".join(map(str, values)) + "\n"

    def insert(name: str, *more: object) -> str:
        return pairs(0, "INSERT", 8, "0", 2, name, 10, 0, 20, 0, *more)

    line = pairs(0, "LINE", 8, "WALL", 10, 0, 20, 0, 11, 5, 21, 5)
    blocks = pairs(0, "SECTION", 2, "BLOCKS")
    for n in range(12):
        inside = line if n == 0 else insert(f"B{n - 1}") * 10
        blocks += pairs(0, "BLOCK", 8, "0", 2, f"B{n}", 70, 0, 10, 0, 20, 0) + inside + pairs(0, "ENDBLK")
    blocks += pairs(0, "ENDSEC")
    entities = {
        "blocks within blocks": insert("B11"),
        "a block in many rows": insert("B0", 70, 30_000, 71, 30_000, 44, 1, 45, 1),
        "tiny arc steps": pairs(0, "CIRCLE", 8, "WALL", 10, 0, 20, 0, 40, 1e15),
        "numbers beyond floats": pairs(0, "LINE", 8, "WALL", 10, "1e400", 20, 0, 11, 5, 21, 5),
        "a spline of high degree": pairs(0, "SPLINE", 8, "WALL", 70, 0, 71, 30_000, 72, 0, 73, 0),
    }
    for what, drawn in entities.items():
        end = pairs(0, "SECTION", 2, "ENTITIES") + drawn + pairs(0, "ENDSEC", 0, "EOF")
        yield what, "plan.dxf", (blocks + end).encode()


def _geojson() -> Iterator[tuple[str, str, bytes]]:
    def collection(coordinates: str, **more: object) -> bytes:
        rest = "".join(f', "{name}": {json.dumps(value)}' for name, value in more.items())
        geometry = f'{{"type": "Polygon", "coordinates": [{coordinates}]}}'
        feature = f'{{"type": "Feature", "properties": {{}}, "geometry": {geometry}}}'
        return f'{{"type": "FeatureCollection", "features": [{feature}]{rest}}}'.encode()

    square = json.dumps(SQUARE)
    yield "nested arrays", "plan.geojson", b"[" * 100_000
    yield "nested coordinates", "plan.geojson", collection("[" * 5000 + "]" * 5000)
    yield "nested collections", "plan.geojson", _nested_collections(900)
    yield "numbers beyond floats", "plan.geojson", collection(square.replace("30", "1e400"))
    yield "integers beyond floats", "plan.geojson", collection(square.replace("30", "3" * 400))
    yield "integers of many digits", "plan.geojson", collection(square.replace("30", "3" * 100_000))
    yield "huge numbers", "plan.geojson", collection(square.replace("30", "1e308"))
    others: tuple[object, ...] = (5, [], {"properties": 7}, {"properties": {"name": 8}}, None)
    for crs in others:
        yield f"a crs {crs}", "plan.geojson", collection(square, crs=crs)


def _osm() -> Iterator[tuple[str, str, bytes]]:
    entities = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(9))
    yield "entities of entities", "plan.osm", f'<!DOCTYPE osm [<!ENTITY a0 "x">{entities}]><osm>&a9;</osm>'.encode()
    yield "nested elements", "plan.osm", b"<osm>" + b"<way id='1'>" * 100_000
    nodes = "<nd ref='1'/>" * 4
    node, tags = "<node id='1' lon='1e400' lat='1'/>", "<tag k='indoor' v='room'/><tag k='level' v='0-1e9'/>"
    yield "places beyond floats", "plan.osm", f"<osm>{node}<way id='1'>{nodes}{tags}</way></osm>".encode()


def _nested_collections(depth: int) -> bytes:
    geometry = '{"type": "GeometryCollection", "geometries": [' * depth
    geometry += '{"type": "Polygon", "coordinates": []}' + "]}" * depth
    return f'{{"type": "FeatureCollection", "features": [{{"type": "Feature", "geometry": {geometry}}}]}}'.encode()


def _archives() -> Iterator[tuple[str, str, bytes]]:
    level = {"type": "FeatureCollection", "features": [{"id": "1", "geometry": {"type": "Polygon", "coordinates": []}}]}
    whole = bytearray(_zipped(json.dumps(level).encode() + b" " * 500))
    whole[45] ^= 0xFF
    yield "damaged deflate", "plan.zip", bytes(whole)
    yield "a bomb", "plan.zip", _zipped(bytes(60_000_000))
    yield "another compression", "plan.zip", _patched(_zipped(b"{}"), b"PK\x01\x02", 10, 99)
    yield "encrypted", "plan.zip", _patched(_zipped(b"{}"), b"PK\x01\x02", 8, 1)


def _zipped(data: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("level.geojson", data)
    return buffer.getvalue()


def _patched(data: bytes, mark: bytes, at: int, value: int) -> bytes:
    start = data.index(mark) + at
    return data[:start] + struct.pack("<H", value) + data[start + 2 :]


def _pdf(width: float, height: float) -> bytes:
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(200, 100))
    canvas.line(0, 0, 200, 100)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue().replace(b"[ 0 0 200 100 ]", b"[ 0 0 %g %g ]" % (width, height))


def _png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">L", len(data)) + kind + data + struct.pack(">L", zlib.crc32(kind + data))

    rows = _zeros((min(width, 20_000) * 3 + 1) * min(height, 20_000))
    head = struct.pack(">LLBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def _zeros(count: int) -> bytes:
    """So many zero bytes in zlib's format, put together of one compressed block: there may be a gigabyte of them."""
    size = 2**20
    one = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
    block = one.compress(bytes(size)) + one.flush(zlib.Z_FULL_FLUSH)
    end = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
    last = end.compress(bytes(count % size)) + end.flush()
    return b"\x78\xda" + block * (count // size) + last + struct.pack(">HH", count % 65521, 1)

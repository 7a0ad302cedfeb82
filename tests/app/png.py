"""Reads 8-bit RGB PNG with the standard library alone."""

import struct
import zlib


def read_png(path):
    """Width, height and rows of bytes of an 8-bit RGB image."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = [], 8
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        (checksum,) = struct.unpack(">I", data[at + 8 + size : at + 12 + size])
        assert checksum == zlib.crc32(kind + body)
        chunks.append((kind, body))
        at += 12 + size
    assert chunks[-1][0] == b"IEND"
    width, height, *form = struct.unpack(">IIBBBBB", chunks[0][1])
    assert form == [8, 2, 0, 0, 0], form
    packed = zlib.decompress(b"".join(body for kind, body in chunks if kind == b"IDAT"))
    rows, before = [], bytes(3 * width)
    for start in range(0, len(packed), 3 * width + 1):
        row = bytearray(packed[start + 1 : start + 1 + 3 * width])
        for i, value in enumerate(row):
            left = row[i - 3] if i >= 3 else 0
            corner = before[i - 3] if i >= 3 else 0
            row[i] = (value + predict(packed[start], left, before[i], corner)) % 256
        rows.append(bytes(row))
        before = row
    assert len(rows) == height
    return width, height, rows


def predict(method, left, up, corner):
    if method < 4:
        return (0, left, up, (left + up) // 2)[method]
    guess = left + up - corner
    return min((left, up, corner), key=lambda x: abs(guess - x))


def pixel(rows, x, y):
    return tuple(rows[y][3 * x : 3 * x + 3])

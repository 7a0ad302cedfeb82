"""Reads OpenEXR as the program writes it, with the standard library alone: 32-bit float scan lines,
ZIP compression."""

import struct
import zlib


def read_exr(path):
    """Width, height and a dictionary from channel to its numbers, rows from the top."""
    data = path.read_bytes()
    assert data[:4] == b"\x76\x2f\x31\x01"
    header, at = {}, 8
    while data[at]:
        name, kind, rest = data[at:at + 2000].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack_from("<i", data, at)
        header[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    assert header["compression"] == b"\3", "16 lines a block, zlib"
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    names, place = [], 0
    while header["channels"][place]:
        name = header["channels"][place:].split(b"\0", 1)[0]
        place += len(name) + 1
        kind, *_ = struct.unpack_from("<i4B2i", header["channels"], place)
        assert kind == 2, "32-bit float"
        names.append(name.decode())
        place += 16
    channels = {name: [] for name in names}
    for block in range((height + 15) // 16):
        (offset,) = struct.unpack_from("<Q", data, at + 8 * block)
        line, size = struct.unpack_from("<2i", data, offset)
        lines = min(16, height - (line - top))
        expected = 4 * width * len(names) * lines
        raw = data[offset + 8:offset + 8 + size]
        if size < expected:
            raw = unpack(zlib.decompress(raw))
        numbers = struct.unpack(f"<{expected // 4}f", raw)
        for i in range(lines):
            for c, name in enumerate(names):
                first = (i * len(names) + c) * width
                channels[name].extend(numbers[first:first + width])
    return width, height, channels


def unpack(data):
    """Differences to bytes, then the two halves of the bytes back to even and odd places."""
    values, value = bytearray(len(data)), 0
    for i, difference in enumerate(data):
        value = difference if i == 0 else (value + difference - 128) % 256
        values[i] = value
    result, half = bytearray(len(data)), (len(data) + 1) // 2
    result[0::2], result[1::2] = values[:half], values[half:]
    return bytes(result)

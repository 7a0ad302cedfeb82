"""RGL .bsdf files in plain Python, from docs/file-formats.md and the paper (Dupuy and Jakob 2018) alone: slow, and nothing of the C++."""

import array
import math
import struct

FLOAT32 = 10


def file_bytes(fields):
    """A file of these fields: name -> (shape, numbers), or (shape, bytes, type)."""
    header = b"tensor_file\0\1\0" + struct.pack("<I", len(fields))
    end = len(header) + sum(13 + len(name) + 8 * len(field[0]) for name, field in fields.items())
    data = b""
    for name, (shape, content, *kind) in fields.items():
        data += bytes(-(end + len(data)) % 8)
        header += struct.pack(f"<H{len(name)}sHBQ{len(shape)}Q", len(name), name.encode(), len(shape),
                              *(kind or [FLOAT32]), end + len(data), *shape)
        data += content if kind else array.array("f", content).tobytes()
    return header + data


def nodes(height, width, value):
    """value(x, y) at nodes that span [0, 1]², x along rows."""
    return [value(x / (width - 1), y / (height - 1)) for y in range(height) for x in range(width)]


def made_up(seed, angles_phi=(-1.25, 0.75), angles_theta=(0, 0.4, 1.1), rows=(5, 7), columns=(9, 6)):
    """A material with two phi_i, three theta_i and odd sizes; it is smooth, and not symmetric."""
    slices = len(angles_phi) * len(angles_theta)

    def density(number):
        a, b = math.cos(seed + number), math.sin(3 * seed + 2 * number)
        return lambda x, y: (1.2 + a * math.cos(3 * x) + b * x * math.sin(5 * y)) ** 2 * 1e-4 * (number + 1)

    def colour(number):
        return lambda x, y: 0.3 + math.sin(seed + number + 4 * x) * math.cos(number - 3 * y)

    def concatenate(parts):
        return [number for part in parts for number in part]

    return {
        "phi_i": ((len(angles_phi),), angles_phi),
        "theta_i": ((len(angles_theta),), angles_theta),
        "sigma": ((3, columns[1]), nodes(3, columns[1], lambda x, y: 1 - 0.6 * x * x + 0.1 * y)),
        "ndf": ((rows[1], columns[0]), nodes(rows[1], columns[0], lambda x, y: math.exp(-3 * x * x) * (2 + y))),
        "vndf": ((len(angles_phi), len(angles_theta), rows[0], columns[0]),
                 concatenate(nodes(rows[0], columns[0], density(i)) for i in range(slices))),
        "luminance": ((1, 1, 2, 2), [1, 1, 1, 1]),
        "rgb": ((len(angles_phi), len(angles_theta), 3, rows[1], columns[1]),
                concatenate(nodes(rows[1], columns[1], colour(i)) for i in range(3 * slices))),
        "description": ((7,), b"made up", 1),
        "jacobian": ((1,), b"\1", 1),
        "unheard-of": ((2, 3), bytes(48), 11),
    }


class Material:
    """A file, read and evaluated."""

    def __init__(self, content):
        assert content[:14] == b"tensor_file\0\1\0"
        (count,) = struct.unpack_from("<I", content, 14)
        at = 18
        self.fields = {}
        for _ in range(count):
            (size,) = struct.unpack_from("<H", content, at)
            name = content[at + 2 : at + 2 + size].decode()
            at += 2 + size
            dimensions, kind, offset = struct.unpack_from("<HBQ", content, at)
            shape = struct.unpack_from(f"<{dimensions}Q", content, at + 11)
            at += 11 + 8 * dimensions
            if kind == FLOAT32:
                self.fields[name] = shape, struct.unpack_from(f"<{math.prod(shape)}f", content, offset)

    def map(self, name, number=0):
        """One of the two-dimensional arrays of a field, as rows."""
        shape, numbers = self.fields[name]
        height, width = shape[-2:]
        first = number * height * width
        return [numbers[first + y * width : first + (y + 1) * width] for y in range(height)]

    def slices(self, theta, phi):
        """(number, weight) of the slices around the parameters."""
        angles = self.fields["theta_i"][1]
        return [(p * len(angles) + t, weight_p * weight_t)
                for p, weight_p in around(self.fields["phi_i"][1], phi)
                for t, weight_t in around(angles, theta)]

    def projected(self, theta_i, phi_i, theta_m):
        """f cos theta_o for a half vector with phi_m = 0."""
        x = math.sqrt(2 * theta_m / math.pi)
        y = (-phi_i / (2 * math.pi) + 0.5) % 1.0
        slices = self.slices(theta_i, phi_i)
        # The density between slices, as an array of its own.
        density = None
        for number, weight in slices:
            rows = self.map("vndf", number)
            columns = [sum(row) - (row[0] + row[-1]) / 2 for row in rows]
            mass = sum(columns) - (columns[0] + columns[-1]) / 2
            part = [[weight / mass * d for d in row] for row in rows]
            density = part if density is None else [
                [a + b for a, b in zip(*both)] for both in zip(density, part)]
        totals = [area(row, len(row) - 1) for row in density]
        s_y = area(totals, y * (len(totals) - 1)) / area(totals, len(totals) - 1)
        row = [between(column, y * (len(density) - 1)) for column in zip(*density)]
        whole = area(row, len(row) - 1)
        s_x = area(row, x * (len(row) - 1)) / whole if whole else 0
        sigma = at_point(self.map("sigma"), math.sqrt(2 * theta_i / math.pi), phi_i / (2 * math.pi) + 0.5)
        ndf = at_point(self.map("ndf"), x, y)
        colour = [sum(weight * at_point(self.map("rgb", 3 * number + channel), s_x, s_y)
                      for number, weight in slices) for channel in range(3)]
        return [max(0, value) * ndf / (4 * sigma) for value in colour]

    def reflectance(self, theta_h, theta_d, phi_d):
        """The reciprocal f that fits both ways best, in 1/sr; zero below the horizon."""
        half = (math.sin(theta_h), 0.0, math.cos(theta_h))
        side = (math.cos(theta_h), 0.0, -math.sin(theta_h))  # with y, the frame around half
        x, y, z = (math.sin(theta_d) * math.cos(phi_d), math.sin(theta_d) * math.sin(phi_d), math.cos(theta_d))
        i = [x * side[0] + z * half[0], y, x * side[2] + z * half[2]]
        o = [2 * z * h - a for h, a in zip(half, i)]
        if i[2] <= 0 or o[2] <= 0:
            return [0, 0, 0]
        ways = [self.projected(math.acos(min(1, d[2])), math.atan2(d[1], d[0]), theta_h) for d in (i, o)]
        return [(a * o[2] + b * i[2]) / (o[2] ** 2 + i[2] ** 2) for a, b in zip(*ways)]


def around(angles, angle):
    """(place, weight) of the one or two angles that an angle is between."""
    if angle <= angles[0] or len(angles) == 1:
        return [(0, 1.0)]
    for place, (low, high) in enumerate(zip(angles, angles[1:])):
        if angle < high:
            share = (angle - low) / (high - low)
            return [(place, 1 - share), (place + 1, share)]
    return [(len(angles) - 1, 1.0)]


def between(numbers, place):
    """Linear between numbers at 0, 1, 2 ..."""
    low = min(int(place), len(numbers) - 2)
    return numbers[low] + (place - low) * (numbers[low + 1] - numbers[low])


def area(numbers, end):
    """The integral of that from 0 to an end."""
    whole = int(end)
    sums = sum((a + b) / 2 for a, b in zip(numbers[:whole], numbers[1 : whole + 1]))
    return sums + ((end - whole) * (numbers[whole] + between(numbers, end)) / 2 if end > whole else 0)


def at_point(rows, x, y):
    """Bilinear in [0, 1]²."""
    height, width = len(rows), len(rows[0])
    return between([between(row, x * (width - 1)) for row in rows], y * (height - 1))

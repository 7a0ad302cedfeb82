"""The science of a scan in plain Python, from Ryman 2018 and the definitions in docs/ alone: slow, float64, and nothing of the C++."""

import decimal
import math

SCALE = (1 / 1500, 1.15 / 1500, 1.66 / 1500)


def domain(grid):
    """(cos theta_i, cos theta_o, s_MERL) of every voxel in file order (Ryman 2018, 4.5, 4.6, 4.14)."""
    theta_h_count, theta_d_count, phi_d_count = grid
    result = []
    for t in range(theta_h_count):
        m_t = (t + 0.5) / theta_h_count
        theta_h = math.pi / 2 * m_t**2
        for s in range(theta_d_count):
            theta_d = math.pi / 2 * (s + 0.5) / theta_d_count
            both = math.cos(theta_h) * math.cos(theta_d)
            halfdiff = 4 * math.sin(theta_h) * math.sin(theta_d) * math.cos(theta_d)
            s_merl = math.pi**3 / 2 * m_t * halfdiff
            for r in range(phi_d_count):
                phi_d = math.pi * (r + 0.5) / phi_d_count
                across = math.cos(phi_d) * math.sin(theta_h) * math.sin(theta_d)
                result.append((both - across, both + across, s_merl))
    return result


def above_horizon(grid):
    return [index for index, (i, o, _) in enumerate(domain(grid)) if i > 0 and o > 0]


def lab(rgb):
    """CIELAB of linear RGB (Ryman 2018, 4.28), read literally: not scaled by 100. The offset 16/116 of f
    cancels, and is left out so that dark colours keep their digits."""
    r, g, b = rgb
    x = 0.412453 * r + 0.357580 * g + 0.180423 * b
    y = 0.212671 * r + 0.715160 * g + 0.072169 * b
    z = 0.019334 * r + 0.119193 * g + 0.950227 * b

    def f(t):
        return t ** (1 / 3) - 16 / 116 if t > (24 / 116) ** 3 else 841 / 108 * t

    fx, fy, fz = f(x / 95.047), f(y / 100), f(z / 108.883)
    return 116 * fy, 500 * (fx - fy), 200 * (fy - fz)


def same(rgb):
    return rgb


def squares(one, other):
    return sum((a - b) ** 2 for a, b in zip(one, other))


def cube_roots_of_squares(one, other):
    return sum(((a - b) ** 2) ** (1 / 3) for a, b in zip(one, other))


# transform, weight of (cos theta_i, cos theta_o, s_MERL), difference
METRICS = {
    "rmse": (same, lambda i, o, s: 1, squares),
    "cosine-rmse": (same, lambda i, o, s: i * i, squares),
    "cwcbrt": (same, lambda i, o, s: (i * i) ** (1 / 3), cube_roots_of_squares),
    "pawcielab": (lab, lambda i, o, s: i * o * s, squares),
}


def distances(metric, materials, grid):
    """E of all pairs in pair order (Ryman 2018, 4.20) of materials given as stored numbers."""
    transform, weight, difference = METRICS[metric]
    count = grid[0] * grid[1] * grid[2]
    visited = above_horizon(grid)
    geometry = domain(grid)
    weights = [weight(*geometry[k]) for k in visited]

    def transformed(numbers):
        planes = [[max(0, x) * scale for x in numbers[c * count : (c + 1) * count]]
                  for c, scale in enumerate(SCALE)]
        return [transform((planes[0][k], planes[1][k], planes[2][k])) for k in visited]

    grids = [transformed(numbers) for numbers in materials]
    return [
        math.sqrt(math.fsum(w * difference(f, g) for w, f, g in zip(weights, one, other)) / count)
        for first, one in enumerate(grids)
        for other in grids[first + 1 :]
    ]


def exact_distances(metric, materials, grid):
    """The same in 50 digits and without a range, from the samples and the weights as float64 has
    them; for numbers that are all zero or more, and far below white where it is PAWCIELAB."""
    context = decimal.Context(prec=50, Emin=-999999, Emax=999999)
    with decimal.localcontext(context):
        exact = decimal.Decimal
        third = exact(1) / 3
        count = grid[0] * grid[1] * grid[2]
        visited = above_horizon(grid)
        geometry = domain(grid)
        weight = METRICS[metric][1]
        weights = [exact(weight(*geometry[k])) for k in visited]

        def root(x):
            return x**third if x else x

        def exact_lab(rgb):
            matrix = (("0.412453", "0.357580", "0.180423"), ("0.212671", "0.715160", "0.072169"),
                      ("0.019334", "0.119193", "0.950227"))
            xyz = [sum(exact(m) * c for m, c in zip(row, rgb)) for row in matrix]
            scaled = [x / exact(white) for x, white in zip(xyz, ("95.047", "100", "108.883"))]
            knee = (exact(24) / 116) ** 3
            f = [root(t) - exact(16) / 116 if t > knee else exact(841) / 108 * t for t in scaled]
            return 116 * f[1], 500 * (f[0] - f[1]), 200 * (f[1] - f[2])

        def transformed(numbers):
            planes = [[exact(x * scale) for x in numbers[c * count : (c + 1) * count]]
                      for c, scale in enumerate(SCALE)]
            rgbs = [(planes[0][k], planes[1][k], planes[2][k]) for k in visited]
            return [exact_lab(rgb) for rgb in rgbs] if metric == "pawcielab" else rgbs

        def difference(f, g):
            if metric == "cwcbrt":
                return sum(root(abs(a - b)) ** 2 for a, b in zip(f, g))
            return sum((a - b) ** 2 for a, b in zip(f, g))

        grids = [transformed(numbers) for numbers in materials]
        return [
            (sum(w * difference(f, g) for w, f, g in zip(weights, one, other)) / count).sqrt()
            for first, one in enumerate(grids)
            for other in grids[first + 1 :]
        ]


def sign(x):
    return (x > 0) - (x < 0)


def agreement(one, other):
    """Of two pairs on which the metrics disagree (docs/numerics.md). Two products of 0 are a tie at 0 in one metric."""
    products = one[2] * other[3], other[2] * one[3]
    if max(products) == 0:
        products = (one[3], other[3]) if one[2] == other[2] else (one[2], other[2])
    return min(products) / max(products)


def disagreements(pairs):
    """All disagreements (docs/numerics.md) of pairs given as (name, name, d1, d2), strongest first: tuples of
    the left pair, the right pair and the agreement."""
    found = []
    for a, one in enumerate(pairs):
        for b in range(a + 1, len(pairs)):
            other = pairs[b]
            if sign(one[2] - other[2]) == sign(one[3] - other[3]):
                continue
            one_is_left = one[2] < other[2] or (one[2] == other[2] and one[3] > other[3])
            sides = (one, other) if one_is_left else (other, one)
            found.append((agreement(one, other), a, b, *sides))
    found.sort(key=lambda x: x[:3])
    return [(left, right, agreement) for agreement, _, _, left, right in found]


def selection(ranked, select, per_material):
    """The greedy choice (docs/numerics.md) from disagreements, strongest first."""
    parts = {}
    chosen = []
    for left, right, agreement in ranked:
        if len(chosen) == select:
            break
        materials = {*left[:2], *right[:2]}
        if all(parts.get(m, 0) < per_material for m in materials):
            chosen.append((left, right, agreement))
            for m in materials:
                parts[m] = parts.get(m, 0) + 1
    return chosen

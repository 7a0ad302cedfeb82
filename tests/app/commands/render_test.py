"""merl-scan render."""

import csv
import math
import pathlib
import signal
import time

import support
from browser import Browser
from exr import read_exr
from png import pixel, read_png
from support import GRID, INPUT, OUTPUT, USAGE, Case, merl_bytes, samples, tree, voxels
from support import write_database

SCALE = (1 / 1500, 1.15 / 1500, 1.66 / 1500)


def rotated(v, axis, angle):
    """A vector turned about z or y, as in the half-difference frame of Rusinkiewicz."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = v
    return (c * x - s * y, s * x + c * y, z) if axis == "z" else (c * x + s * z, y, c * z - s * x)


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def look_up(numbers, grid, m_r, m_s, m_t):
    """Trilinear over the stored numbers of one channel, repeating along M_r."""
    n_t, n_s, n_r = grid
    total = 0
    places = []
    for m, n, repeats in (m_t, n_t, False), (m_s, n_s, False), (m_r, n_r, True):
        at = m * n - 0.5
        if not repeats:
            at = min(max(at, 0), n - 1)
        low = math.floor(at)
        high = (low + 1) % n if repeats else min(low + 1, n - 1)
        places.append(((low % n, 1 - (at - low)), (high, at - low)))
    for t, weight_t in places[0]:
        for s, weight_s in places[1]:
            for r, weight_r in places[2]:
                total += weight_t * weight_s * weight_r * max(0, numbers[r + n_r * (s + n_s * t)])
    return total


def expected_radiance(planes, grid, light, wo, n):
    """f cos theta_i for three channels: the directions are turned into the frame of the normal, then
    of the half vector, one angle after the other."""
    if dot(n, light) <= 0 or dot(n, wo) <= 0:
        return (0, 0, 0)
    # Any frame around the normal: the BRDF is isotropic.
    side = unit((n[1], -n[0], 0)) if abs(n[2]) < 0.9 else unit((0, n[2], -n[1]))
    up = (n[1] * side[2] - n[2] * side[1], n[2] * side[0] - n[0] * side[2],
          n[0] * side[1] - n[1] * side[0])
    i, o = (tuple(dot(v, axis) for axis in (side, up, n)) for v in (light, wo))
    h = unit(tuple(a + b for a, b in zip(i, o)))
    theta_h, phi_h = math.acos(min(1, h[2])), math.atan2(h[1], h[0])
    d = rotated(rotated(i, "z", -phi_h), "y", -theta_h)
    theta_d, phi_d = math.acos(min(1, d[2])), math.atan2(d[1], d[0]) % math.pi
    m = phi_d / math.pi, theta_d / (math.pi / 2), math.sqrt(theta_h / (math.pi / 2))
    return tuple(scale * look_up(plane, grid, *m) * dot(n, light)
                 for scale, plane in zip(SCALE, planes))


def expected_pixel(planes, grid, light, x, y, size, fov=60, rays=2):
    """The average of the rays of a pixel that the sphere covers, where
    the camera is where the silhouette is seen at nine tenths of the image."""
    half = math.tan(math.radians(fov / 2))
    camera = math.sqrt(1 + 1 / (0.9 * half) ** 2)
    total = [0, 0, 0]
    for k in range(rays * rays):
        u = (2 * (x + (k % rays + 0.5) / rays) / size - 1) * half
        v = (1 - 2 * (y + (k // rays + 0.5) / rays) / size) * half
        ray = unit((u, v, -1))
        b = camera * ray[2]
        root = b * b - camera * camera + 1
        if root < 0:
            return None
        t = -b - math.sqrt(root)
        n = (t * ray[0], t * ray[1], camera + t * ray[2])
        value = expected_radiance(planes, grid, light, tuple(-c for c in ray), n)
        total = [a + c / rays ** 2 for a, c in zip(total, value)]
    return total


class AbcSamples:
    """Samples of the built-in database as stored numbers, from the published fit and the formula."""

    def __init__(self, name, channel, grid):
        path = pathlib.Path(__file__).parents[3] / "shaders" / "models" / "abc.csv"
        with path.open(encoding="utf-8") as file:
            fit = next(row for row in csv.reader(file) if row[0] == name)
        numbers = [float(x) for x in fit[1:]]
        self.kd, self.a = numbers[channel], numbers[3 + channel]
        self.b, self.c, self.ior = numbers[6:]
        self.scale, self.grid = SCALE[channel], grid

    def __getitem__(self, index):
        n_t, n_s, n_r = self.grid
        phi_d = math.pi * (index % n_r + 0.5) / n_r
        theta_d = math.pi / 2 * (index // n_r % n_s + 0.5) / n_s
        theta_h = math.pi / 2 * ((index // n_r // n_s + 0.5) / n_t) ** 2
        straight = math.cos(theta_h) * math.cos(theta_d)
        across = math.cos(phi_d) * math.sin(theta_h) * math.sin(theta_d)
        i, o = straight - across, straight + across
        if i <= 0 or o <= 0:
            return 0
        c = math.cos(theta_d)
        g = math.sqrt(self.ior ** 2 + c * c - 1)
        fresnel = ((g - c) / (g + c)) ** 2 / 2 * (
            1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)
        masking = min(1, 2 * math.cos(theta_h) * i / c, 2 * math.cos(theta_h) * o / c)
        lobe = self.a / (1 + self.b * (1 - math.cos(theta_h))) ** self.c
        return (self.kd / math.pi + fresnel * masking * lobe / (math.pi * i * o)) / self.scale


class Render(Case):
    def test_one_material(self):
        output = self.assert_success("render", "--material", "gold-paint", "--out", "gold.exr",
                                     "--size", "64")
        self.assertIn("1 sphere", output)
        self.assertIn("stand-in", output)
        self.assertEqual(sorted(p.name for p in self.work.iterdir()), ["gold.exr", "gold.png"])
        for file in self.work.iterdir():
            self.assertIn(b"gold-paint of ABC fits of MERL (stand-in", file.read_bytes())
        width, height, rows = read_png(self.work / "gold.png")
        self.assertEqual((width, height), (64, 64))
        self.assertEqual(pixel(rows, 0, 0), (128, 128, 128))

    def test_against_an_independent_program(self):
        # Everything that may differ does: three planes, neighbours far apart, an odd grid.
        grid, size = (7, 6, 9), 48
        numbers = [max(x, 1) for x in samples(5, grid)]
        write_database(self.work / "db", {"a": numbers, "b": samples(6, grid)}, grid)
        count = voxels(grid)
        planes = [numbers[c * count:(c + 1) * count] for c in range(3)]
        for number, direction in enumerate(((1, 1, 1), (-2, 0.3, -0.5), (0.1, -1, 3))):
            out = f"out{number}"
            self.assert_success("render", "--database", "db", "--material", "a", "--out", out, "--size",
                                size, "--background", "0", "--light", ",".join(map(str, direction)))
            width, height, channels = read_exr(self.work / out / "a.exr")
            self.assertEqual((width, height), (size, size))
            compared = 0
            for y in range(0, size, 3):
                for x in range(0, size, 2):
                    corners = [expected_pixel(planes, grid, unit(direction), x + i, y + j, size,
                                              rays=1) for i in (-1, 1) for j in (-1, 1)]
                    if None in corners:
                        continue  # near the silhouette there are more rays
                    expected = expected_pixel(planes, grid, unit(direction), x, y, size)
                    for name, value in zip("RGB", expected):
                        found = channels[name][y * size + x]
                        self.assertAlmostEqual(found, value, delta=2e-4 * value + 2e-5,
                                               msg=f"{direction} {x} {y} {name}")
                    compared += any(expected)
            self.assertGreater(compared, 50)

    def test_built_in_material_against_an_independent_program(self):
        grid = (90, 90, 180)
        planes = [AbcSamples("gold-paint", channel, grid) for channel in range(3)]
        self.assert_success("render", "--material", "gold-paint", "--out", "g.exr", "--size", "96",
                            "--background", "0")
        channels = read_exr(self.work / "g.exr")[2]
        light = unit((1, 1, 1))
        for x, y in (62, 33), (63, 32), (48, 48), (30, 70), (80, 40), (40, 15), (20, 48), (64, 64):
            expected = expected_pixel(planes, grid, light, x, y, 96)
            for name, value in zip("RGB", expected):
                self.assertAlmostEqual(channels[name][y * 96 + x], value, delta=5e-4 * value + 1e-5)

    def test_several_lights_and_the_contact_sheet(self):
        write_database(self.work / "db", 5)
        output = self.assert_success("render", "--database", "db", "--out", "out", "--size", "200",
                                     "--light", "1,1,1", "--light", "-1,0,0.5")
        self.assertIn("10 spheres", output)
        names = [f"m{i:02}-light-{k}" for i in range(5) for k in (1, 2)]
        self.assertEqual(sorted(p.name for p in (self.work / "out").iterdir()), sorted(
            ["contact-sheet.html", "contact-sheet.png", *(n + ".exr" for n in names),
             *(n + ".png" for n in names)]))
        width, height, rows = read_png(self.work / "out" / "contact-sheet.png")
        self.assertEqual((width, height), (400, 300))  # 4 x 3, at half the size
        self.assertEqual(pixel(rows, 399, 299), (0, 0, 0))  # two places are left over
        # The left of the first sphere is dark under the first light; of the sixth, lit.
        self.assertLess(sum(pixel(rows, 10, 60)), sum(pixel(rows, 110, 150)))

    def test_the_contact_sheet_names_every_sphere(self):
        names = ["a", "b#c?d%20&amp;", "<script>alert(1)</script>".replace("/", "\u2215"), "å \"q\""]
        write_database(self.work / "db", {name: samples(i) for i, name in enumerate(names)})
        self.assert_success("render", "--database", "db", "--out", "out", "--size", "16")
        page = self.work / "out" / "contact-sheet.html"
        with Browser() as browser:
            for width in 1200, 360:
                browser.open(page, width=width)
                self.assertEqual(browser.complaints(), [])
                shown = browser.run("Promise.all([...document.images].map(i => i.decode())).then(() =>"
                                    "[...document.querySelectorAll('figcaption')].map(c => c.textContent))")
                self.assertEqual(shown, sorted(names, key=str.encode))
                self.assertLessEqual(browser.run("document.documentElement.scrollWidth"), width)
            self.assertEqual(browser.run("[...document.images].map(i => decodeURIComponent(i.src.split('/').pop()))"),
                             [name + ".png" for name in shown])

    def test_exposure_background_and_encoding(self):
        write_database(self.work / "db", {"a": [300.0] * voxels(GRID) * 3, "b": samples(0)})
        images = {}
        for name, *options in (
            ("plain", "--background", "0.25"), ("brighter", "--background", "0.25", "--exposure", "1"),
            ("srgb", "--background", "0.25", "--encoding", "srgb"),
        ):
            self.assert_success("render", "--database", "db", "--out", f"{name}.exr", "--material",
                                "a", "--size", "40", *options)
            images[name] = (read_exr(self.work / f"{name}.exr")[2],
                            read_png(self.work / f"{name}.png")[2])
            self.assertEqual(pixel(images[name][1], 0, 0), (64, 64, 64))
        linear = images["plain"][0]["R"]
        middle = 20 * 40 + 20
        self.assertAlmostEqual(linear[0], 0.25 ** 2.2, places=6)
        self.assertAlmostEqual(images["brighter"][0]["R"][middle], 2 * linear[middle], places=6)
        self.assertEqual(images["brighter"][0]["R"][0], linear[0])
        value = linear[middle]
        self.assertEqual(pixel(images["plain"][1], 20, 20)[0], round(255 * value ** (1 / 2.2)))
        self.assertEqual(images["srgb"][0]["R"][middle], value)
        self.assertEqual(pixel(images["srgb"][1], 20, 20)[0],
                         round(255 * (1.055 * value ** (1 / 2.4) - 0.055)))

    def test_force_replaces_its_images_only(self):
        write_database(self.work / "db", 2)
        arguments = ("render", "--database", "db", "--material", "m00", "--size", "16", "--out")
        (self.work / "there").mkdir()
        (self.work / "there" / "mine.txt").write_text("mine")
        self.assert_success(*arguments, "there/a.exr")
        self.assert_refused(OUTPUT, ["there/a.exr", "--force"], *arguments, "there/a.exr")
        self.assert_refused(OUTPUT, ["there", "exists", "--force"], *arguments, "there")
        (self.work / "there" / "a.png").write_text("old")
        self.assert_success(*arguments, "there/a.exr", "--force")
        self.assertEqual(sorted(p.name for p in (self.work / "there").iterdir()),
                         ["a.exr", "a.png", "mine.txt"])
        self.assertNotEqual((self.work / "there" / "a.png").read_bytes(), b"old")

    def test_a_file_of_either_kind(self):
        write_database(self.work / "db", 2)
        arguments = ("render", "--database", "db", "--material", "m00", "--size", "16", "--out")
        for number, (out, other) in enumerate((("a.exr", "a.png"), ("a.png", "a.exr"),
                                               ("a.EXR", "a.png"), ("a.Png", "a.exr"))):
            (self.work / str(number)).mkdir()
            output = self.assert_success(*arguments, f"{number}/{out}")
            self.assertIn("PNG" if other == "a.png" else "OpenEXR", output)
            files = tree(self.work / str(number))
            self.assertEqual({str(name) for name in files}, {out, other})
            for name, data in files.items():
                png = name.suffix.lower() == ".png"
                self.assertTrue(data.startswith(b"\x89PNG" if png else b"v/1\x01"), name)
        self.assert_success(*arguments, "a.PNG", "--light", "1,1,1", "--light", "0,0,1")
        self.assertEqual({p.name for p in self.work.glob("a*")},
                         {f"a-light-{i}.{kind}" for i in (1, 2) for kind in ("exr", "PNG")})
        self.assert_refused(USAGE, ["x.png", "one material"], "render", "--database", "db", "--out",
                            "x.png")

    def test_names_too_long(self):
        long = "m" * 248  # .binary makes 255
        write_database(self.work / "db", {long: samples(0), "b": samples(1)})
        render = ("render", "--database", "db", "--size", "16", "--out")
        two_lights = ("--light", "1,1,1", "--light", "0,0,1")
        for out in "out", "db":
            self.assert_refused(OUTPUT, [f"{long}-light-1.exr", "too long"], *render, out,
                                *two_lights, "--force")
            self.assert_refused(OUTPUT, [f"material-{long}.exr", "too long"], "slices",
                                "--database", "db", "--materials", long, "--out", out, "--force")
        self.assert_refused(OUTPUT, ["x" * 300, "too long"], *render, "x" * 300 + ".exr",
                            "--material", "b")
        self.assert_success(*render, "out")

    def test_bad_options(self):
        write_database(self.work / "db", 3)
        for words, *options in (
            (["--light", '"0,0,0"'], "--light", "0,0,0"),
            (["--light", '"1,1"'], "--light", "1,1"),
            (["--light", '"1,1,1,1"'], "--light", "1,1,1,1"),
            (["--light", '"1,nan,1"'], "--light", "1,nan,1"),
            (["--light", '"1,inf,1"'], "--light", "1,inf,1"),
            (["--size", '"5000"'], "--size", "5000"),
            (["--fov", '"180"'], "--fov", "180"),
            (["--fov", '"nan"'], "--fov", "nan"),
            (["--background", '"1.5"'], "--background", "1.5"),
            (["--exposure", '"x"'], "--exposure", "x"),
            (["--encoding", "srgb"], "--encoding", "linear"),
            (['"nope"', "3 materials"], "--material", "nope"),
            (["one material", "found 3"], "--out", "a.exr"),
        ):
            self.assert_refused(USAGE, words, "render", "--database", "db", *options)

    def test_names_that_would_collide(self):
        write_database(self.work / "db", {"contact-sheet": samples(0), "b": samples(1)})
        self.assert_refused(USAGE, ['"contact-sheet.png"'], "render", "--database", "db")

    def test_bad_sample(self):
        numbers = samples(0)
        numbers[-1] = math.inf
        write_database(self.work / "db", 2)
        (self.work / "db" / "bad.binary").write_bytes(merl_bytes(numbers))
        self.assert_refused(INPUT, ["bad.binary", "inf"], "render", "--database", "db", "--out", "out")

    def test_ctrl_c(self):
        with support.Running(self, "render", "--out", "out", "--size", "1024") as running:
            running.wait_for_partial()
            time.sleep(0.5)
            running.stop(signal.SIGINT, seconds=20)
        self.assertEqual(tree(self.work), {})


if __name__ == "__main__":
    support.main()

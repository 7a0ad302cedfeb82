"""merl-scan slices."""

import signal

import support
from png import pixel, read_png
from support import GRID, INPUT, OUTPUT, USAGE, Case, merl_bytes, samples, tree, voxels
from support import write_database

FIGURE = [
    f"figure-4.4-{column}-mr{m_r}"
    for column in ("0.05-s_merl", "0.4-projected-area-s_merl", "projected-area")
    for m_r in ("0", "0.5")
]


class Slices(Case):
    def assert_images(self, directory, names, sheets=("figure-4.4",)):
        expected = [f"{n}.png" for n in [*names, *sheets]] + [f"{n}.exr" for n in names]
        self.assertEqual(sorted(p.name for p in directory.iterdir()), sorted(expected))
        for file in directory.glob("*.exr"):
            self.assertEqual(file.read_bytes()[:4], b"\x76\x2f\x31\x01")

    def test_figure(self):
        output = self.assert_success("slices", "--out", "out")
        self.assertIn("13 images", output)
        self.assert_images(self.work / "out", FIGURE)
        for name in FIGURE:
            width, height, rows = read_png(self.work / "out" / f"{name}.png")
            self.assertEqual((width, height), (360, 360))
            self.assertGreater(len(set(b"".join(rows))), 50, name)

    def test_where_figure_is_dark_and_bright(self):
        # M_s to the right, M_t upwards: projected area is 1 at both angles 0, that is lower left.
        self.assert_success("slices", "--out", "out")
        area = read_png(self.work / "out" / "figure-4.4-projected-area-mr0.5.png")[2]
        self.assertGreater(pixel(area, 0, 359)[0], 250)
        self.assertLess(pixel(area, 359, 359)[0], 10)
        self.assertLess(pixel(area, 0, 0)[0], 10)
        # s_MERL is zero at both ends of theta_d and where theta_h is 0; it has no other dark place.
        scale = read_png(self.work / "out" / "figure-4.4-0.05-s_merl-mr0.png")[2]
        for x, y in (0, 0), (359, 0), (0, 359), (359, 359), (180, 359):
            self.assertLess(pixel(scale, x, y)[0], 20)
        self.assertGreater(pixel(scale, 180, 0)[0], 200)

    def test_materials(self):
        output = self.assert_success("slices", "--out", "out", "--materials", "chrome,blue-fabric")
        self.assertIn("17 images", output)
        self.assert_images(self.work / "out", [*FIGURE, "material-chrome", "material-blue-fabric"])
        blue = read_png(self.work / "out" / "material-blue-fabric.png")[2]
        red, _, blue_value = pixel(blue, 180, 180)
        self.assertGreater(blue_value, red)

    def test_material_of_a_directory(self):
        count = voxels(GRID)
        # Red grows with theta_h, which is to the right; green with theta_d, upwards; no blue.
        theta_d = [k // GRID[2] % GRID[1] for k in range(count)]
        theta_h = [k // GRID[2] // GRID[1] for k in range(count)]
        numbers = [80 * t for t in theta_h] + [80 * s for s in theta_d] + [-1] * count
        write_database(self.work / "db", {"ramp": numbers, "b": samples(0)})
        self.assert_success("slices", "--database", "db", "--out", "out", "--materials", "ramp")
        rows = read_png(self.work / "out" / "material-ramp.png")[2]
        left, right = pixel(rows, 5, 180), pixel(rows, 354, 180)
        low, high = pixel(rows, 180, 354), pixel(rows, 180, 5)
        self.assertLess(left[0], right[0])
        self.assertEqual(left[1], right[1])
        self.assertLess(low[1], high[1])
        self.assertEqual(low[0], high[0])
        self.assertEqual({row[i] for row in rows for i in range(2, 1080, 3)}, {0})

    def test_unknown_material(self):
        for name in "nope", "", "../chrome", "/etc/passwd", "Chrome":
            self.assert_refused(USAGE, [f'"{name}"', "material"], "slices", "--out", "out",
                                "--materials", name)

    def test_materials_called_like_the_figure(self):
        materials = {"figure-4.4": samples(0), FIGURE[0]: samples(1)}
        write_database(self.work / "db", materials)
        output = self.assert_success("slices", "--database", "db", "--out", "out", "--materials",
                                     ",".join(materials))
        self.assertIn("17 images", output)
        self.assert_images(self.work / "out", [*FIGURE, *(f"material-{m}" for m in materials)])

    def test_several_ways_to_name_materials(self):
        write_database(self.work / "db", {name: samples(0) for name in ("a", "b", "a,b", "c")})
        for number, (options, drawn) in enumerate((
            (["a,b"], ["a,b"]), (["a", "--materials", "b"], ["a", "b"]), (["a", "b"], ["a", "b"]),
            (["b,a,b"], ["a", "b"]), (["c,a", "--materials", "a,b"], ["a", "a,b", "c"]),
        )):
            out = f"out{number}"
            self.assert_success("slices", "--database", "db", "--out", out, "--materials", *options)
            self.assert_images(self.work / out, [*FIGURE, *(f"material-{m}" for m in drawn)])

    def test_images_of_the_built_in_database_say_that_it_is_a_stand_in(self):
        output = self.assert_success("slices", "--out", "out", "--materials", "chrome")
        self.assertIn("stand-in", output)
        for file in (self.work / "out").glob("*"):
            self.assertEqual(b"stand-in" in file.read_bytes(), "material-" in file.name, file)

    def test_bad_database(self):
        write_database(self.work / "db", 2)
        numbers = samples(0)
        numbers[0] = float("nan")
        (self.work / "db" / "bad.binary").write_bytes(merl_bytes(numbers))
        self.assert_refused(INPUT, ["bad.binary", "nan"], "slices", "--database", "db",
                            "--out", "out", "--materials", "bad")


class Output(Case):
    def test_existing(self):
        (self.work / "there").mkdir()
        (self.work / "file").touch()
        self.assert_refused(OUTPUT, ["there", "exists", "--force"], "slices", "--out", "there")
        self.assert_refused(OUTPUT, ["file/x", "Not a directory"], "slices", "--out", "file/x")

    def test_force_replaces_its_images_only(self):
        self.assert_success("slices", "--out", "out", "--materials", "chrome")
        expected = tree(self.work / "out")
        (self.work / "out" / "figure-4.4.png").write_text("old")
        (self.work / "out" / "material-chrome.png").write_text("mine")
        self.assert_success("slices", "--out", "out", "--force")
        after = tree(self.work / "out")
        changed = [str(path) for path in expected if expected[path] != after[path]]
        self.assertEqual(changed, ["material-chrome.png"])

    def test_full_disk(self):
        disk = support.mount(self, "1m")
        line = self.assert_refused(OUTPUT, ["full/out/figure-4.4", "No space left"],
                                   "slices", "--out", disk / "out")
        self.assertEqual((line.count("figure-4.4"), line.count("partial-")), (1, 0), line)

    def test_ctrl_c(self):
        names = self.assert_success("database", "info").split("\n\n")[1].splitlines()[1:]
        materials = ",".join(line.split()[0] for line in names)
        with support.Running(self, "slices", "--out", "out", "--materials", materials) as running:
            running.wait_for_partial()
            running.stop(signal.SIGINT, seconds=3)
        self.assertEqual(list(self.work.iterdir()), [])


if __name__ == "__main__":
    support.main()

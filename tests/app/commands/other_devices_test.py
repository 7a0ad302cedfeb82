"""Devices that nobody has at hand: lavapipe below a layer that makes it look like them
(tests/vulkan_layer)."""

import os

import support
from support import DEVICE, INPUT, Case, read_csv, read_json, tree, write_database

LAYERS = os.pathsep.join([os.environ["OTHER_DEVICE_LAYERS"], "/usr/share/vulkan/explicit_layer.d"])
GRID = (18, 12, 24)
CARD = "kind=discrete heap=4096 bar=256"  # MiB, without resizable BAR


class OtherDevices(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 12, GRID)

    def on(self, device):
        """The environment in which there is such a device."""
        return {"VK_LAYER_PATH": LAYERS, "VK_INSTANCE_LAYERS": "VK_LAYER_MERL_SCAN_other_device",
                "MERL_SCAN_OTHER_DEVICE": device}

    def results(self, device, *options, out="out", **changes):
        database = () if "--database" in options else ("--database", "db")
        self.assert_success("scan", *database, "--out", out, *options, **self.on(device), **changes)
        return (self.work / out / "selection.csv").read_bytes(), read_json(self.work / out / "summary.json")

    def refused(self, device, words, *options):
        return self.assert_refused(DEVICE, words, "scan", "--database", "db", *options, **self.on(device))

    def test_every_device_selects_the_same(self):
        expected, summary = self.results("", "--device", "host", out="host")
        for i, device in enumerate((CARD, "kind=discrete heap=4096 bar=4096", "kind=integrated heap=64 bar=64",
                                    "kind=discrete heap=4096", "kind=virtual groups=100",
                                    "kind=discrete storage-buffer=1", "kind=discrete heap=3 bar=1",
                                    "kind=discrete timestamp-bits=8", "kind=discrete timestamp-bits=0")):
            with self.subTest(device=device):
                selection, found = self.results(device, out=f"out-{i}")
                (engine,) = found["engines"]
                self.assertEqual(engine["engine"], "vulkan")
                self.assertEqual(engine["kind"], device.split()[0].removeprefix("kind=") + " GPU")
                self.assertEqual(selection, expected)
                self.assertEqual(found["disagreements"], summary["disagreements"])

    def test_subgroups_of_every_width(self):
        expected, _ = self.results("", "--device", "host", out="host")
        for bits in 128, 256, 512:
            selection, _ = self.results(CARD, out=f"out-{bits}", LP_NATIVE_VECTOR_WIDTH=str(bits))
            self.assertEqual(selection, expected)

    def test_copies_count_to_the_memory(self):
        """Of a card's memory the host reaches little, so what travels is there twice."""
        write_database(self.work / "larger", 12, (30, 30, 60))
        slabs = {}
        for device in "kind=discrete heap=4096 bar=4096", CARD:
            _, found = self.results(device, "--memory", "8M", "--database", "larger", "--force")
            self.assertLessEqual(found["engines"][0]["peak_bytes"], 8 << 20)
            slabs[device] = found["slabs"]
        self.assertLess(*slabs.values())

    def test_too_little_memory_of_its_own(self):
        self.refused("kind=discrete heap=1 bar=1", ["12 materials", "memory", "free"])

    def test_no_memory_that_the_host_reaches(self):
        self.refused("kind=discrete heap=64 no-usable-memory", ["no memory", "host can reach"])

    def test_allocations_that_fail(self):
        for nth in 1, 2, 7, 14:
            with self.subTest(nth=nth):
                self.refused(f"kind=discrete fail-allocation={nth}", ["cannot allocate", "MiB", "--memory"])

    def test_a_lost_device(self):
        self.results(CARD, out="merl-scan-results")
        before = tree(self.work)
        for nth in 1, 2, 3:
            for device in "kind=discrete", CARD:
                with self.subTest(nth=nth, device=device):
                    self.refused(f"{device} lose-at={nth}", ["lost", "--device host"], "--force",
                                 "--memory", "4M")
                    self.assertEqual(tree(self.work), before)  # what was finished stays

    def test_no_float64(self):
        expected, summary = self.results("", "--device", "host", out="host")
        for i, device in enumerate(("kind=discrete heap=4096 bar=4096 no-float64", f"{CARD} no-float64",
                                    f"{CARD} no-float64 no-rounding-modes")):
            with self.subTest(device=device):
                selection, found = self.results(device, out=f"out-{i}")
                (engine,) = found["engines"]
                self.assertEqual((engine["engine"], engine["grids"]), ("vulkan", "host"))
                self.assertEqual(selection, expected)
                self.assertEqual(found["disagreements"], summary["disagreements"])
        _, found = self.results("kind=discrete", out="with")
        self.assertEqual(found["engines"][0]["grids"], "device")
        listed = self.assert_success("devices", **self.on("kind=discrete no-float64"))
        self.assertIn("without float64 in shaders: not for your own metrics", listed)
        self.assertNotIn("cannot be used", listed)

    def test_grids_of_the_host_count_to_the_memory(self):
        write_database(self.work / "larger", 12, (30, 30, 60))
        slabs = set()
        for device in "kind=discrete heap=4096 bar=4096 no-float64", f"{CARD} no-float64":
            _, found = self.results(device, "--memory", "8M", "--database", "larger", "--force")
            self.assertLessEqual(found["engines"][0]["peak_bytes"], 8 << 20)
            slabs.add(found["slabs"])
        self.assertEqual(len(slabs), 2)  # copies count

    def test_every_metric_without_float64(self):
        tables = []
        for device in "kind=discrete", f"{CARD} no-float64":
            self.assert_success("compare", "--database", "db", "--metrics", "all", "--out", "out", "--force",
                                **self.on(device))
            tables.append(read_csv(self.work / "out" / "distances.csv"))
        (header, expected), (same, found) = tables
        self.assertEqual(len(header), 14)
        self.assertEqual(same, header)
        for row, other in zip(expected, found, strict=True):
            for name, value, distance in zip(header[2:], row[2:], other[2:], strict=True):
                self.assertAlmostEqual(float(distance) / float(value), 1, delta=4e-6, msg=name)

    def test_a_metric_of_a_users_own_needs_float64(self):
        (self.work / "mine.glsl").write_text(
            "vec3 transform(vec3 f, Voxel v) { return f; }\nfloat weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { return distance(a, b); }\n")
        self.refused("kind=discrete no-float64", ["mine.glsl", "float64", "other discrete GPU"],
                     "--metrics", "rmse,mine.glsl")

    def test_devices_that_round_either_way(self):
        selections = []
        bounds = []
        for device in "kind=discrete", "kind=discrete no-rounding-modes":
            selections.append(self.results(device, "--force")[0])
            self.results(device, "--fast", "--force", out="fast")
            _, rows = read_csv(self.work / "fast" / "pairs.csv")
            bounds.append([float(bound) for row in rows for bound in row[4:6]])
        self.assertEqual(*selections)
        for narrow, wide in zip(*bounds, strict=True):
            self.assertGreater(wide, 1.5 * narrow)

    def test_nan_is_found_where_compilers_may_lose_it(self):
        (self.work / "mine.glsl").write_text(
            "vec3 transform(vec3 f, Voxel v) { return f; }\nfloat weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { return sqrt(-1.0 - a.x * b.x); }\n")
        self.assert_refused(INPUT, ["mine.glsl", "nan"], "scan", "--database", "db", "--metrics",
                            "rmse,mine.glsl", **self.on("kind=discrete no-rounding-modes"))

    def test_spheres_are_the_same(self):
        images = {}
        for device in CARD, "kind=discrete heap=4096 bar=4096", "kind=discrete no-float64":
            self.assert_success("render", "--database", "db", "--material", "m01", "--size", "40",
                                "--out", "m01.exr", "--force", **self.on(device))
            images[device] = (self.work / "m01.png").read_bytes()
        self.assertEqual(len(set(images.values())), 1)


if __name__ == "__main__":
    support.main()

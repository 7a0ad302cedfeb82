"""Devices that nobody has at hand: lavapipe below a layer that makes it look like them
(tests/vulkan_layer)."""

import ctypes
import json
import os
import pathlib
import random
import signal
import tempfile

import support
from support import DEVICE, INPUT, Case, read_csv, read_json, tree, write_database

LAYERS = os.pathsep.join([os.environ["OTHER_DEVICE_LAYERS"], "/usr/share/vulkan/explicit_layer.d"])
GRID = (18, 12, 24)
MINE = """// title: Mine
// degree: 2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return v.cos_theta_i; }

float difference(float d) { return d * d; }
"""
CARD = "kind=discrete heap=4096 bar=256"  # MiB, without resizable BAR


class Hash128(ctypes.Structure):
    _fields_ = [("low", ctypes.c_uint64), ("high", ctypes.c_uint64)]


def xxh3_128(data):
    """In hexadecimal digits, by the library that the program links too."""
    function = ctypes.CDLL("libxxhash.so.0").XXH3_128bits
    function.restype = Hash128
    function.argtypes = ctypes.c_char_p, ctypes.c_size_t
    found = function(data, len(data))
    return f"{found.high:016x}{found.low:016x}"


class OtherDevices(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 12, GRID)
        self.kept = self.known  # what came of trying devices in other tests

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.known = cls.new_cache()

    @classmethod
    def new_cache(cls):
        """A directory in which nothing is known of any device."""
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        return pathlib.Path(directory.name) / "cache"

    def cache(self):
        """The environment of the cache; what Mesa has compiled is kept elsewhere, for all of them."""
        shared = os.environ.get("XDG_CACHE_HOME", os.path.expanduser("~/.cache"))
        return {"XDG_CACHE_HOME": str(self.kept), "MESA_SHADER_CACHE_DIR": shared}

    def on(self, device):
        """The environment in which there is such a device."""
        return self.cache() | {"VK_LAYER_PATH": LAYERS, "VK_INSTANCE_LAYERS": "VK_LAYER_MERL_SCAN_other_device",
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
                                    "kind=discrete heap=4096 bar=4096 non-coherent", CARD + " non-coherent",
                                    CARD + " transfer-queue", CARD + " transfer-queue non-coherent timestamp-bits=0",
                                    "kind=discrete timestamp-bits=8", "kind=discrete timestamp-bits=0")):
            with self.subTest(device=device):
                selection, found = self.results(device, "--device", "other", out=f"out-{i}")
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

    def test_little_memory_of_its_own(self):
        """What does not fit at once it computes square by square."""
        expected, summary = self.results("", "--device", "host", out="host")
        selection, found = self.results("kind=discrete heap=1 bar=1")
        self.assertEqual(found["engines"][0]["engine"], "vulkan")
        self.assertEqual(selection, expected)
        self.assertEqual(found["disagreements"], summary["disagreements"])

    def test_no_memory_that_the_host_reaches(self):
        self.refused("kind=discrete heap=64 no-usable-memory", ["no memory", "host can reach"])

    def test_allocations_that_fail(self):
        self.results(CARD)  # from here on the device is known to work
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

    def test_work_is_handed_over_in_pieces(self):
        """Too much at once is what watchdogs end, and no digit depends on how work is cut. Without
        timestamps the program stays with what it takes for safe at first."""
        self.kept = self.new_cache()  # so that no tiles were measured
        grid = (24, 18, 48)
        some = support.samples(1, grid)
        numbers = random.Random(1)
        write_database(self.work / "larger", {
            f"m{i:02}": [x * numbers.uniform(0.5, 1.5) for x in some] for i in range(80)}, grid)
        (self.work / "mine.glsl").write_text(MINE)
        limit = "timestamp-bits=0 groups-at-once={}"
        for metrics in "cwcbrt,paw-ciede2000", "rmse,mine.glsl", "gloss-contrast,mine.glsl":
            options = ("--database", "larger", "--metrics", metrics, "--device", "0", "--fast", "--force",
                       "--disagreements", "0")
            tables = []
            for device in "kind=discrete", "kind=integrated " + limit.format(2500):
                self.results(device, *options)
                tables.append([(self.work / "out" / name).read_bytes() for name in ("pairs.csv", "selection.csv")])
            self.assertEqual(*tables)
            # A processor has no watchdog, and nothing is cut for it.
            self.assert_refused(DEVICE, ["lost"], "scan", *options, **self.on(limit.format(4000)))

    def test_a_device_that_hangs(self):
        """Ctrl-C ends the program, which waits for work that never ends."""
        before = tree(self.work)
        with support.Running(self, "scan", "--database", "db", "--out", "out",
                             **self.on("kind=discrete hang-at=1")) as running:
            running.wait_for_partial()
            running.wait_for(lambda: running.seconds() > 1.5)  # so that it waits by then
            errors = running.stop(signal.SIGINT)
        self.assertIn("nothing was written", self.only_line(errors))
        self.assertEqual(tree(self.work), before)

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
        self.assertEqual(len(header), 16)  # on this grid windows of gloss-contrast are empty
        self.assertEqual(same, header)
        for row, other in zip(expected, found, strict=True):
            for name, value, distance in zip(header[2:], row[2:], other[2:], strict=True):
                self.assertAlmostEqual(float(distance) / float(value), 1, delta=4e-6, msg=name)

    def test_a_summary(self):
        """It is float64: the host computes it for a device that has none."""
        write_database(self.work / "layers", 6, (24, 12, 24))
        options = ("--database", "layers", "--metrics", "rmse,gloss-contrast", "--force")
        self.results("", "--device", "host", *options, out="host")
        expected = read_csv(self.work / "host" / "pairs.csv")[1]
        for device in (CARD, "kind=discrete heap=4096", CARD + " transfer-queue non-coherent", "kind=integrated heap=64 bar=64",
                       "kind=discrete timestamp-bits=0", "kind=discrete no-rounding-modes", CARD + " no-float64"):
            with self.subTest(device=device):
                _, found = self.results(device, "--device", "other", *options)
                self.assertTrue(found["exact"])
                engines = [(engine["engine"], engine["grids"], engine["metrics"]) for engine in found["engines"]]
                if "no-float64" in device:
                    self.assertEqual(engines, [("vulkan", "host", ["rmse"]), ("host", "host", ["gloss-contrast"])])
                else:
                    self.assertEqual(engines, [("vulkan", "device", ["rmse", "gloss-contrast"])])
                for row, other in zip(expected, read_csv(self.work / "out" / "pairs.csv")[1], strict=True):
                    self.assertAlmostEqual(float(other[3]) / float(row[3]), 1, delta=1e-13)
        (self.work / "mine.glsl").write_text(
            "// window: all of it\n// features: 1\nfloat window(int w, Voxel v) { return 1.0; }\n"
            "float feature(int i, Means m) { return m.rgb[all].y; }\n")
        self.refused("kind=discrete no-float64", ["mine.glsl", "float64", "other discrete GPU"],
                     "--metrics", "rmse,mine.glsl")

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
            self.results(device, "--fast", "--select", "1", "--force", out="fast")
            _, rows = read_csv(self.work / "fast" / "pairs.csv")
            bounds.append([float(bound) for row in rows for bound in row[4:6]])
        self.assertEqual(*selections)
        both = [pair for pair in zip(*bounds, strict=True) if 0 not in pair]  # not refined
        self.assertGreater(len(both), len(bounds[0]) / 2)
        for narrow, wide in both:
            self.assertGreater(wide, 1.5 * narrow)

    def test_nan_is_found_where_compilers_may_lose_it(self):
        (self.work / "mine.glsl").write_text(
            "vec3 transform(vec3 f, Voxel v) { return f; }\nfloat weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { return sqrt(-1.0 - a.x * b.x); }\n")
        self.assert_refused(INPUT, ["mine.glsl", "nan"], "scan", "--database", "db", "--metrics",
                            "rmse,mine.glsl", **self.on("kind=discrete no-rounding-modes"))

    def test_what_a_driver_says_of_itself(self):
        """It is not believed that it is fast when it computes on the processor, nor used for what the
        processor does as well when nobody has tested it, or when it is slower."""
        self.kept = self.new_cache()
        for words, said in ("kind=discrete", ""), ("kind=virtual software", ""), \
                           ("kind=discrete untested", "not conformant"), ("kind=integrated", "slower than the host"):
            with self.subTest(words=words):
                _, found = self.results(words, "--force")
                self.assertEqual(found["engines"][0]["engine"], "vulkan" if words == "kind=discrete" else "host")
                self.assertIn(said, self.assert_success("devices", **self.on(words)))
                _, found = self.results(words, "--device", "other", "--force")
                self.assertEqual(found["engines"][0]["engine"], "vulkan")

    def test_a_device_behind_a_portability_layer(self):
        _, found = self.results("kind=discrete portability")
        self.assertEqual(found["engines"][0]["engine"], "vulkan")

    def test_a_workgroup_that_is_no_subgroup(self):
        self.kept = self.new_cache()
        self.warns = True
        lie = "kind=discrete subgroup=64"
        for _ in "tried", "known":
            _, found = self.results(lie, "--force")
            self.assertEqual(found["engines"][0]["engine"], "host")
        self.assertIn("a subgroup has 64 lanes", self.assert_success("devices", **self.on(lie)))
        self.refused(lie, ["a subgroup has 64 lanes", "lanes added up"], "--device", "other", "--out", "other")

    def test_a_device_that_computes_wrongly(self):
        """The trial has 24 materials: 4 tiles along the diagonal, 6 above it; and blocks whose weights are
        made by 16 workgroups. What a workgroup does not write is what the memory had before, so the
        metric that is found wrong first is any of those tried."""
        self.warns = True
        for groups in 4, 6, 16:
            with self.subTest(groups=groups):
                self.kept = self.new_cache()
                wrong = f"kind=discrete timestamp-bits=0 wrong={groups}"
                _, found = self.results(wrong, "--force")
                self.assertEqual(found["engines"][0]["engine"], "host")
                self.assertIn("computes wrongly", "".join(found["warnings"]))
                listed = self.assert_success("devices", **self.on(wrong))
                self.assertIn("computes wrongly", listed)
                self.assertRegex(listed, "computes wrongly: .*(cwcbrt|pawcielab|paw-ciede2000)")
                self.refused(wrong, ["computes wrongly", "devices.json"], "--device", "0", "--force")

    def test_tiles_are_measured_where_time_is(self):
        for device, measured in ("kind=discrete timestamp-bits=0", False), ("kind=discrete", True):
            self.kept = self.new_cache()
            self.results(device, "--force")
            kept = (self.kept / "merl-scan" / "devices.json").read_text(encoding="utf-8")
            (trial,) = json.loads(kept.split("\n", 2)[2])["trials"]
            self.assertEqual("tiles" in trial, measured)

    def test_what_another_program_kept(self):
        """The bytes are whole, and what they say is of no use."""
        self.kept = self.new_cache()
        self.results("kind=discrete timestamp-bits=0")
        file = self.kept / "merl-scan" / "devices.json"
        known = json.loads(file.read_text(encoding="utf-8").split("\n", 2)[2])
        trial = known["trials"][0]
        for change in ({"program": "another"}, {"trials": {}}, {"trials": [{}]}, {"trials": [trial | {"refusal": 1}]},
                       {"trials": [trial | {"tiles": {"power": 0, "square": 4294967295}}]}, {"drivers": [1]},
                       {"drivers": {key: 1 for key in known["drivers"]}}):
            with self.subTest(change=change):
                text = json.dumps(known | change)
                file.write_text(f"merl-scan cache 1\n{xxh3_128(text.encode())}\n{text}", encoding="utf-8")
                self.results("kind=discrete timestamp-bits=0", "--force")
                self.assertEqual(json.loads(file.read_text(encoding="utf-8").split("\n", 2)[2]), known)

    def test_a_driver_that_crashes(self):
        """RADV does, without hardware and for a family that it does not know."""
        self.kept = self.new_cache()
        (radeon,) = pathlib.Path("/usr/share/vulkan/icd.d").glob("radeon_icd.*.json")
        crash = self.cache() | {"RADV_FORCE_FAMILY": "none"}
        both, alone = (crash | {name: drivers for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")}
                       for drivers in (f"{radeon}:{os.environ['VK_DRIVER_FILES']}", str(radeon)))
        scan = "scan", "--database", "db", "--out", "out", "--force"
        for drivers, device, engine in (both, (), "host"), (both, ("--device", "llvmpipe"), "vulkan"), (alone, (), "host"):
            for _ in "tried", "known":
                run = self.run_program(*scan, *device, **drivers)
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertIn(f"{radeon} crashes", run.stderr)
                self.assertEqual(read_json(self.work / "out" / "summary.json")["engines"][0]["engine"], engine)
        self.assert_refused(DEVICE, [str(radeon), "crashes", "no other"], *scan, "--device", "0", **alone)

    def test_what_is_kept_may_be_damaged(self):
        self.kept = self.new_cache()
        expected, _ = self.results("kind=discrete")
        kept = self.kept / "merl-scan"
        files = {path: path.read_bytes() for path in kept.iterdir()}
        self.assertEqual({path.name.split("-")[0] for path in files}, {"devices.json", "pipelines"})
        for damage in (lambda whole: b"", lambda whole: whole[:-1], lambda whole: whole[:-1] + b"?",
                       lambda whole: b"merl-scan cache 2" + whole[17:], lambda whole: b"\0" * (65 << 20)):
            for path, whole in files.items():
                path.write_bytes(damage(whole))
            damaged = {path: path.read_bytes() for path in kept.iterdir()}
            selection, _ = self.results("kind=discrete", "--force")
            self.assertEqual(selection, expected)
            mended = {path: path.read_bytes() for path in kept.iterdir()}
            self.assertEqual(mended.keys(), files.keys())
            for path in files:
                self.assertNotEqual(mended[path], damaged[path])
            self.results("kind=discrete", "--force")
            self.assertEqual({path: path.read_bytes() for path in kept.iterdir()}, mended)

    def test_pipelines_of_another_driver(self):
        """They are whole, and no other version of the driver may see them: it takes their place."""
        self.kept = self.new_cache()
        expected, _ = self.results("kind=discrete")
        kept = self.kept / "merl-scan"
        (path,) = kept.glob("pipelines-*")
        whole = path.read_bytes()
        beginning, _, content = whole.split(b"\n", 2)
        other = b"0" * 32 + content[32:]
        path.write_bytes(b"\n".join([beginning, xxh3_128(other).encode(), other]))
        selection, _ = self.results("kind=discrete", "--force")
        self.assertEqual(selection, expected)
        self.assertEqual(list(kept.glob("pipelines-*")), [path])
        self.assertEqual(path.read_bytes().split(b"\n", 2)[2][:32], content[:32])

    def test_nothing_can_be_kept(self):
        self.kept = self.new_cache()
        self.kept.write_text("a file")
        self.results("kind=discrete")
        self.assertEqual(self.kept.read_text(), "a file")

    def test_spheres_are_the_same(self):
        images = []
        for device in (CARD, "kind=discrete heap=4096 bar=4096", CARD + " transfer-queue", CARD + " non-coherent",
                       "kind=discrete heap=4096 bar=4096 non-coherent", "kind=discrete no-float64"):
            self.assert_success("render", "--database", "db", "--size", "40", "--out", "spheres", "--force",
                                **self.on(device))
            images.append({path.name: path.read_bytes() for path in (self.work / "spheres").rglob("*.png")})
            self.assertGreaterEqual(len(images[-1]), 12)
            self.assertEqual(images[-1], images[0], device)

    def test_spheres_are_handed_over_in_pieces(self):
        """An image is 50 x 50 workgroups: more than may be handed over at once, and what is left of
        one with the start of the next is too."""
        images = []
        limit = "timestamp-bits=0 groups-at-once=2000"
        options = ("--database", "db", "--material", "m01,m02", "--size", "400", "--light", "1,1,1", "--light", "-1,1,1",
                   "--device", "0", "--out", "spheres", "--force")
        for device in "kind=discrete", "kind=integrated " + limit:
            self.assert_success("render", *options, **self.on(device))
            images.append({path.name: path.read_bytes() for path in (self.work / "spheres").rglob("*.png")})
        self.assertGreaterEqual(len(images[0]), 4)
        self.assertEqual(*images)
        # A processor has no watchdog, and nothing is cut for it.
        self.assert_refused(DEVICE, ["lost"], "render", *options, **self.on(limit))


if __name__ == "__main__":
    support.main()

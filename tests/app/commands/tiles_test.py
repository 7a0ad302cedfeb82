"""Distances in tiles: merl-scan distances, in one process, in parts and under MPI, and what reads them."""

import ast
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import time
import unittest

import support
from support import (INPUT, INTERRUPTED, OUTPUT, PROGRAM, USAGE, Case, Running, mount, read_csv, read_json, samples,
                     tree, write_database)
from tables import write_rows

MPIRUN = shutil.which("mpirun")
RESULTS = "pairs.csv", "disagreements.csv", "selection.csv"
METRICS = "cwcbrt,pawcielab,paw-ciede2000"


def has_mpi():
    """Whether the program is built with MPI, as the libraries that it loads say."""
    if MPIRUN is None:
        return False
    return "libmpi" in subprocess.run(["ldd", PROGRAM], capture_output=True, text=True, check=False).stdout


def read_array(path):
    """The sides of an array and its numbers, as numpy.lib.format describes format 1.0."""
    content = path.read_bytes()
    assert content[:8] == b"\x93NUMPY\x01\x00"
    (size,) = struct.unpack_from("<H", content, 8)
    header = ast.literal_eval(content[10:10 + size].decode("ascii"))
    assert (10 + size) % 64 == 0 and content[10 + size - 1:10 + size] == b"\n"
    assert (header["descr"], header["fortran_order"]) == ("<f8", False)
    count = 1
    for side in header["shape"]:
        count *= side
    assert len(content) == 10 + size + 8 * count
    return header["shape"], struct.unpack_from(f"<{count}d", content, 10 + size)


class Tiles(Case):
    def setUp(self):
        super().setUp()
        self.database = write_database(self.work / "db", 20)

    def distances(self, *options, out="work"):
        """Computes tiles of six materials, 10 of them, or what is missing of that."""
        return self.assert_success("distances", "--database", "db", "--metrics", METRICS, "--tile", 6, "--device",
                                   "host", "--out", out, *options)

    def refuse(self, status, words, *options, out="work"):
        return self.assert_refused(status, words, "distances", "--database", "db", "--metrics", METRICS, "--tile", 6,
                                   "--device", "host", "--out", out, *options)

    def tiles(self, out="work"):
        return tree(self.work / out)

    def test_a_scan_of_tiles_is_that_of_the_database(self):
        output = self.distances()
        self.assertRegex(output, r"(?m)^tiles +0 of 10 are there, 10 to compute$")
        for options in ["--metrics", "cwcbrt,pawcielab"], ["--metrics", "paw-ciede2000,cwcbrt"]:
            with self.subTest(options=options):
                direct = self.scan("--database", "db", "--device", "host", "--force", *options, out="direct")
                read = self.scan("--distances", "work", "--force", *options, out="read")
                for name in RESULTS:
                    self.assertEqual((read / name).read_bytes(), (direct / name).read_bytes(), name)
                one, other = read_json(direct / "summary.json"), read_json(read / "summary.json")
                for key in one.keys() - {"distance_seconds", "seconds", "slabs", "options", "engines", "warnings"}:
                    self.assertEqual(other[key], one[key], key)
                self.assertEqual(other["tiles"]["count"], 10)
                self.assertEqual(other["tiles"]["folder"], "work")
        # Without --metrics the two of a scan, although there are three.
        self.assertEqual(read_json(self.scan("--distances", "work", out="two") / "summary.json")["metrics"],
                         ["cwcbrt", "pawcielab"])

    def test_the_array_of_a_tile(self):
        self.distances()
        pairs = self.scan("--distances", "work", "--fast", out="fast") / "pairs.csv"
        # What the selection rests on is refined.
        expected = {tuple(row[:2]): [float(x) for x in row[2:4]] for row in read_csv(pairs)[1]
                    if row[6:8] == ["float32", "float32"]}
        self.assertGreater(len(expected), 50)
        manifest = read_json(self.work / "work" / "manifest.json")
        names = manifest["database"]["materials"]
        self.assertEqual(manifest["tiles"], {"side": 6, "count": 10})
        self.assertEqual([metric["name"] for metric in manifest["metrics"]], METRICS.split(","))
        for tile in range(10):
            record = read_json(self.work / "work" / f"tile-{tile:05}.json")
            row, column = record["rows"]["first"], record["columns"]["first"]
            shape, numbers = read_array(self.work / "work" / f"tile-{tile:05}.npy")
            self.assertEqual(shape, (3, 2, record["rows"]["count"], record["columns"]["count"]))

            def number(metric, bound, i, j):
                return numbers[((metric * 2 + bound) * shape[2] + i) * shape[3] + j]

            for i in range(shape[2]):
                for j in range(shape[3]):
                    a, b = names[row + i], names[column + j]
                    distances = [number(m, 0, i, j) for m in range(2)]
                    if a == b or (min(a, b), max(a, b)) in expected:
                        self.assertEqual(distances, [0, 0] if a == b else expected[min(a, b), max(a, b)])
                    self.assertGreaterEqual(number(0, 1, i, j), 0)

    def test_numpy_reads_a_tile(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("there is no NumPy")
        self.distances()
        for path in sorted((self.work / "work").glob("*.npy")):
            shape, numbers = read_array(path)
            for mode in None, "r":
                array = numpy.load(path, mmap_mode=mode)
                self.assertEqual((array.shape, array.ravel().tolist()), (shape, list(numbers)))

    def test_what_is_there_is_not_computed_again(self):
        self.distances()
        whole = self.tiles()
        times = {path: path.stat().st_mtime_ns for path in (self.work / "work").iterdir()}
        for name in "tile-00003.npy", "tile-00007.json":
            (self.work / "work" / name).unlink()
        for name in "tile-00001.npy", "tile-00003.json", "manifest.json":
            (self.work / "work" / f".{name}.partial-elsewhere-7-1").write_text("half")
        self.assertRegex(self.distances(), r"(?m)^tiles +8 of 10 are there, 2 to compute$")
        self.assertEqual(self.tiles(), whole)
        for path, time_ns in times.items():
            if path.name[:10] not in ("tile-00003", "tile-00007"):
                self.assertEqual(path.stat().st_mtime_ns, time_ns, path.name)
        output = self.distances()
        self.assertRegex(output, r"(?m)^tiles +10 of 10 are there, 0 to compute$")
        self.assertNotIn("each tile", output)

    def test_memory_threads_and_the_side_of_tiles_change_no_number(self):
        self.distances()
        whole = self.tiles()
        self.distances("--memory", "2M", "--threads", "1", out="small")
        self.assertEqual(self.tiles("small"), whole)
        scans = set()
        for side in 1, 7, 19, 20, 65536:
            self.assert_success("distances", "--database", "db", "--device", "host", "--metrics", "cwcbrt,pawcielab",
                                "--tile", side, "--out", f"of-{side}")
            scans.add((self.scan("--distances", f"of-{side}", out=f"s{side}") / "pairs.csv").read_bytes())
        self.assertEqual(len(scans), 1)

    def test_parts_in_any_order_at_once_and_twice(self):
        self.distances()
        whole = self.tiles()
        output = self.distances("--part", "3/3", out="parts")
        self.assertRegex(output, r"(?m)^results +parts: 7 of 10 tiles are missing$")
        self.assertEqual(sorted(p.name for p in (self.work / "parts").glob("*.npy")),
                         [f"tile-{tile:05}.npy" for tile in (2, 5, 8)])
        self.assert_refused(INPUT, ["parts", "7 of 10 tiles are missing", "tile-00000.npy", "merl-scan distances"],
                            "scan", "--distances", "parts", "--out", "none")
        running = [Running(self, "distances", "--database", "db", "--metrics", METRICS, "--tile", "6", "--device",
                           "host", "--out", "parts", "--part", part) for part in ("1/3", "2/3", "1/3", "3/3")]
        for one in running:
            with one:
                self.assertEqual(one.process.communicate(timeout=120)[1], "")
                self.assertEqual(one.process.returncode, 0)
        self.assertEqual(self.tiles("parts"), whole)

    def test_processes_that_begin_at_once(self):
        self.distances()
        running = [Running(self, "distances", "--database", "db", "--metrics", METRICS, "--tile", "6", "--device",
                           "host", "--out", "at-once") for _ in range(4)]
        for one in running:
            with one:
                self.assertEqual(one.process.communicate(timeout=120)[1], "")
        self.assertEqual(self.tiles("at-once"), self.tiles())

    def test_a_folder_of_something_else_is_refused(self):
        self.distances()
        write_database(self.work / "db2", 20)
        write_database(self.work / "other", 21)

        def refuse(words, *options):
            self.assert_refused(INPUT, ["work/manifest.json", *words], "distances", "--out", "work", "--device",
                                "host", *options)

        refuse(["database/name", '"db"', '"db2"'], "--database", "db2", "--metrics", METRICS, "--tile", 6)
        refuse(["database"], "--database", "other", "--metrics", METRICS, "--tile", 6)
        refuse(["database/materials has 20 there and 19 here"], "--database", "db", "--metrics", METRICS, "--tile", 6,
               "--exclude", "m19")
        # Not the number of tiles, which follows from that of materials.
        refuse(["database/materials has 20 there and 10 here"], "--database", "db", "--metrics", METRICS, "--tile", 6,
               "--exclude", "m1*")
        refuse(["database/grid", "phi_d_range"], "--database", "db", "--metrics", METRICS, "--tile", 6,
               "--phi-d-range", "2pi")
        refuse(["metrics[2]/name"], "--database", "db", "--metrics", "cwcbrt,pawcielab,rmse", "--tile", 6)
        refuse(["metrics[1]", "pawcielab:white=80"], "--database", "db", "--metrics",
               "cwcbrt,pawcielab:white=80,paw-ciede2000", "--tile", 6)
        refuse(["metrics has 3 there and 2 here"], "--database", "db", "--metrics", "cwcbrt,pawcielab", "--tile", 6)
        refuse(["tiles/side", "6", "7"], "--database", "db", "--metrics", METRICS, "--tile", 7)
        refuse(["tiles/side"], "--database", "db", "--metrics", METRICS)
        manifest = self.work / "work" / "manifest.json"
        text = manifest.read_text()
        manifest.write_text(text.replace('"version": "', '"version": "9.'))
        self.refuse(INPUT, ["program/version"])
        manifest.write_text(text.replace('"engine": "host"', '"engine": "vulkan"'))
        self.refuse(INPUT, ["engines[0]/engine", "vulkan", "host"])

    def test_what_is_in_the_way(self):
        (self.work / "file").write_text("mine")
        self.refuse(OUTPUT, ["file", "directory"], out="file")
        (self.work / "mine").mkdir()
        (self.work / "mine" / "letter.txt").write_text("mine")
        self.refuse(OUTPUT, ["mine", "letter.txt", "manifest.json"], out="mine")
        self.assert_refused(INPUT, ["mine", "manifest.json"], "scan", "--distances", "mine", "--out", "none")
        self.distances()
        self.drop_privileges()
        (self.work / "locked").mkdir()
        self.refuse(OUTPUT, ["locked"], out="locked/work")
        # What is complete needs no writing.
        folder = self.work / "work"
        folder.chmod(0o555)
        self.addCleanup(folder.chmod, 0o755)
        self.assertRegex(self.distances(), r"(?m)^results +work: merl-scan scan")
        folder.chmod(0o755)
        (folder / "tile-00003.npy").unlink()
        folder.chmod(0o555)
        self.refuse(OUTPUT, ["work/tile-00003", "Permission denied"], "--quiet")

    def test_options(self):
        for part in "0/3", "4/3", "3", "/", "1/0", "-1/3", "1/3/5", "a/b", "":
            self.refuse(USAGE, ["--part"], "--part", part)
        for side in "0", "-1", "x", "65537":
            self.assert_refused(USAGE, ["--tile"], "distances", "--out", "work", "--tile", side)
        self.assert_refused(USAGE, ["--tile 1", "2001000 tiles", "1000000"], "distances", "--database", "blends:2000",
                            "--grid", "6x6x12", "--device", "host", "--out", "work", "--tile", 1)
        self.assert_refused(USAGE, ["--out"], "distances", "--database", "db")
        self.refuse(USAGE, ["--out"], out="")
        write_database(self.work / "one", 1)
        self.assert_refused(INPUT, ["one", "1 material"], "distances", "--database", "one", "--out", "work")
        self.distances()
        self.assert_refused(USAGE, ["2 metrics"], "scan", "--distances", "work", "--metrics", "all", "--out", "none")
        self.assert_refused(INPUT, ["work/manifest.json", '"rmse"', "cwcbrt, pawcielab"], "scan", "--distances",
                            "work", "--metrics", "rmse,cwcbrt", "--out", "none")

    def test_a_damaged_tile(self):
        self.distances()
        whole = self.tiles()
        array = self.work / "work" / "tile-00004.npy"
        record = self.work / "work" / "tile-00004.json"
        content, said = array.read_bytes(), record.read_text()
        size = len(content)

        def scan_refuses(words):
            self.assert_refused(INPUT, words, "scan", "--distances", "work", "--out", "none")

        for name, bad in {"short": content[:-8], "long": content + b"\0" * 8, "empty": b"",
                          "header": content.replace(b"(3, 2, 6, 6)", b"(2, 3, 6, 6)"),
                          "fortran": content.replace(b"False", b"True "),
                          "type": content.replace(b"<f8", b">f8")}.items():
            with self.subTest(damage=name):
                array.write_bytes(bad)
                scan_refuses(["work", "1 of 10 tiles are missing", "tile-00004.npy",
                              "bytes" if len(bad) != size else "header"])
                self.assertIn("9 of 10 are there", self.distances())
                self.assertEqual(self.tiles(), whole)
        begin = size - 8 * 3 * 2 * 36
        other = self.work / "work" / "tile-00005.npy"
        for bad in (content[:begin] + struct.pack("<d", float("nan")) + content[begin + 8:],
                    content[:begin + 8] + bytes([content[begin + 8] ^ 1]) + content[begin + 9:],
                    other.read_bytes() if other.stat().st_size == size else b""):
            array.write_bytes(bad)
            scan_refuses(["tile-00004.npy", "hash" if bad else "bytes"])
            self.assertIn("9 of 10 are there", self.distances())
            self.assertEqual(self.tiles(), whole)
        array.write_bytes(content)
        for bad in "", "{", "[]", "{}", said.replace('"first": 6', '"first": 7'), \
                said.replace('"count": 6', '"count": -6'), said.replace("plane_hashes", "planes"), \
                said.replace('"plane_hashes": "', '"plane_hashes": "0'), said.replace('"m07"', "7"), \
                said.replace('"m07"', '"m08"'), re.sub(r'(samples_above_horizon": \d+)', r"\g<1>1", said, count=1):
            with self.subTest(record=bad[:50]):
                self.assertNotEqual(bad, said)
                record.write_text(bad)
                scan_refuses(["1 of 10 tiles are missing", "tile-00004.npy", "tile-00004.json"])
        record.write_text("{")
        self.assertIn("9 of 10 are there", self.distances())
        self.assertEqual(self.tiles(), whole)
        array.unlink()
        array.mkdir()
        scan_refuses(["tile-00004.npy"])
        self.refuse(OUTPUT, ["tile-00004.npy"], "--quiet")

    def test_a_damaged_manifest(self):
        self.distances()
        manifest = self.work / "work" / "manifest.json"
        good = read_json(manifest)

        def refuse(change, *words):
            changed = json.loads(json.dumps(good))
            change(changed)
            manifest.write_text(json.dumps(changed))
            self.assert_refused(INPUT, ["work/manifest.json", *words], "scan", "--distances", "work", "--out", "none")

        for text in "", "[]", "{", "null", '"x"', "\0" * 100:
            manifest.write_text(text)
            self.assert_refused(INPUT, ["work/manifest.json"], "scan", "--distances", "work", "--out", "none")
        manifest.write_text('{"tiles": {"side": ' + "[" * 300_000 + "]" * 300_000 + "}}")
        self.assert_refused(INPUT, ["work/manifest.json", "nested more than 100 deep"], "scan", "--distances", "work", "--out", "none")
        refuse(lambda m: m.update(format=99), "newer")
        refuse(lambda m: m["tiles"].update(side=0), "side")
        refuse(lambda m: m["tiles"].update(side=-1), "side")
        for number in "six", 10**30, 2**64, 2**32 + 6, 6.5, 1e30, None, [6]:
            refuse(lambda m, n=number: m["tiles"].update(side=n), "side", "whole number")
            refuse(lambda m, n=number: m["database"]["grid"].update(theta_d=n), "theta_d", "whole number")
            refuse(lambda m, n=number: m["database"].update(
                databases=[{"label": "x", "name": "x", "kind": "x", "path": "x", "materials": n}]), "materials")
        refuse(lambda m: m["tiles"].update(count=11), "count", "found 11; expected 10")
        refuse(lambda m: (m["tiles"].update(side=1),
                          m["database"].update(materials=[f"m{i:05}" for i in range(65536)])),
               "2147516416 tiles", "1000000")
        refuse(lambda m: m.pop("metrics"), "metrics")
        refuse(lambda m: m.update(metrics=[]), "metrics")
        refuse(lambda m: m["metrics"][1].update(name="cwcbrt"), "twice")
        refuse(lambda m: m["metrics"][1].pop("text"), "text")
        refuse(lambda m: m["database"].update(materials=[]), "materials")
        refuse(lambda m: m["database"]["materials"].reverse(), "order")
        refuse(lambda m: m["database"]["grid"].update(theta_h=0), "theta_h")
        refuse(lambda m: m["database"]["grid"].update(theta_h=4096, theta_d=4096, phi_d=4096))
        refuse(lambda m: m["database"].update(databases=[{"label": "x", "name": "x", "kind": "x", "path": "x",
                                                          "materials": 21}]), "databases")

    def test_a_database_that_changes(self):
        self.distances()
        whole = self.tiles()
        changed = self.database / "m00.binary"
        old = changed.read_bytes()
        changed.write_bytes(support.merl_bytes(samples(77)))
        self.assert_refused(INPUT, ["db", "content", "work/manifest.json", "--fast"], "scan", "--distances", "work",
                            "--out", "none")
        (self.work / "work" / "tile-00001.npy").unlink()
        line = self.run_program("distances", "--database", "db", "--metrics", METRICS, "--tile", "6", "--device",
                                "host", "--out", "work")
        self.assertEqual(line.returncode, INPUT)
        for word in "m00 to m05", "tile-00000.npy", "changed":
            self.assertIn(word, self.only_line(line.stderr))
        changed.write_bytes(old)
        self.distances()
        self.assertEqual(self.tiles(), whole)
        # Tiles of different states, put together by hand.
        changed.write_bytes(support.merl_bytes(samples(77)))
        self.distances(out="changed")
        for kind in "json", "npy":
            shutil.copy(self.work / "changed" / f"tile-00001.{kind}", self.work / "work")
        self.assert_refused(INPUT, ["tile-00001.json", "other samples"], "scan", "--distances", "work", "--out",
                            "none")

    def test_a_database_that_cannot_be_reached(self):
        self.distances()
        fast = self.scan("--database", "db", "--device", "host", "--fast", out="fast")
        self.database.rename(self.work / "moved")
        result = self.run_program("scan", "--distances", "work", "--out", "away")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(self.only_line(result.stderr), "warning: .*db.*within their bounds")
        summary = read_json(self.work / "away" / "summary.json")
        self.assertEqual(set(summary["refined_distances"].values()), {0})
        between = summary["disagreements_between"]
        narrower = read_json(fast / "summary.json")["disagreements_between"]  # some are refined there
        self.assertLessEqual(between["least"], narrower["least"])
        self.assertGreaterEqual(between["greatest"], narrower["greatest"])
        self.assertEqual(summary["exact"], summary["undecided_in_float32"] == 0)
        self.assertEqual(summary["warnings"], [result.stderr.strip().split("warning: ")[1]])
        # The selection of --fast needs it too, and --database says where it is now.
        asked = self.run_program("scan", "--distances", "work", "--fast", "--out", "asked")
        self.assertEqual(asked.returncode, 0)
        self.assertIn("warning: ", self.only_line(asked.stderr))
        exact = self.scan("--database", "moved", "--device", "host", out="exact")
        found = self.scan("--distances", "work", "--database", "moved", out="found")
        for name in RESULTS:
            self.assertEqual((found / name).read_bytes(), (exact / name).read_bytes())
        self.assert_refused(INPUT, ["db"], "scan", "--distances", "work", "--database", "db", "--out", "none")
        self.assert_refused(USAGE, ["--distances excludes --fast"], "scan", "--distances", exact / "pairs.csv",
                            "--fast", "--out", "none")
        self.assert_refused(USAGE, ["--distances excludes --database"], "scan", "--distances", exact / "pairs.csv",
                            "--database", "moved", "--out", "none")

    def test_compare_and_score(self):
        self.distances()
        self.assert_success("compare", "--distances", "work", "--out", "read")
        self.assert_success("compare", "--database", "db", "--metrics", METRICS, "--device", "host", "--out", "direct")
        for name in "distances.csv", "compare.csv", "triangle.csv":
            self.assertEqual((self.work / "read" / name).read_bytes(), (self.work / "direct" / name).read_bytes())
        write_rows(self.work / "said.csv", ["reference", "a", "b", "votes_a", "votes_b"],
                   [[f"m{i:02}", f"m{(i + 5) % 20:02}", f"m{(i + 9) % 20:02}", i % 3, (i + 1) % 4] for i in range(20)])
        write_rows(self.work / "rated.csv", ["original", "approximation", "rating"],
                   [[f"m{i:02}", f"m{i + 7:02}", i % 5] for i in range(12)])
        for of, names in (["--judgements", "said.csv"], ["score.csv", "score_pairs.csv"]), \
                (["--ratings", "rated.csv"], ["ratings.csv", "rating_scores.csv"]):
            self.assert_success("score", "--distances", "work", *of, "--out", f"read{of[0]}")
            self.assert_success("score", "--database", "db", "--metrics", METRICS, "--device", "host", *of,
                                "--out", f"direct{of[0]}")
            for name in names:
                self.assertEqual((self.work / f"read{of[0]}" / name).read_bytes(),
                                 (self.work / f"direct{of[0]}" / name).read_bytes())

    def test_joined_databases(self):
        """Whose summary has the hash of each, and which are found again."""
        write_database(self.work / "mine", 6)
        options = ["--database", "a=db", "--database", "b=mine", "--exclude", "a/m1*", "--device", "host"]
        self.assert_success("distances", *options, "--metrics", "cwcbrt,pawcielab", "--out", "work")
        direct = self.run_program("scan", *options, "--out", "direct")
        read = self.run_program("scan", "--distances", "work", "--out", "read")
        self.assertEqual((direct.returncode, read.returncode), (0, 0))
        self.assertEqual(read.stderr, direct.stderr)  # a/m00, b/m00 have the same content
        one, other = (read_json(self.work / name / "summary.json") for name in ("direct", "read"))
        self.assertEqual(other["database"], one["database"])
        self.assertEqual(other["warnings"], one["warnings"])
        self.assertEqual((self.work / "read/pairs.csv").read_bytes(), (self.work / "direct/pairs.csv").read_bytes())

    def test_a_full_disk(self):
        self.distances()
        small = mount(self, "24k")
        result = self.run_program("distances", "--database", "db", "--metrics", METRICS, "--tile", "6", "--device",
                                  "host", "--out", "full/work")
        self.assertEqual(result.returncode, OUTPUT)
        self.assertIn("No space left", self.only_line(result.stderr))
        there = tree(small / "work")
        self.assertFalse([path for path in there if ".partial" in path.name])
        for path, content in there.items():
            self.assertEqual(content, (self.work / "work" / path).read_bytes())

    def test_a_folder_that_vanishes(self):
        with Running(self, "distances", "--out", "work", "--grid", "45x45x90", "--metrics", "cwcbrt,pawcielab",
                     "--device", "host", stdout=subprocess.DEVNULL) as running:
            running.wait_for(lambda: list((self.work / "work").glob("*.npy")))
            (self.work / "work").rename(self.work / "gone")
            errors = running.process.communicate(timeout=120)[1]
        self.assertEqual(running.process.returncode, OUTPUT)
        self.assertRegex(self.only_line(errors), r"work/tile-\d+\.(json|npy): cannot be .*: No such file or directory")

    def test_a_signal(self):
        """It ends soon, says so, and costs the tile under way."""
        for number in signal.SIGUSR1, signal.SIGTERM, signal.SIGINT:
            with self.subTest(signal=number):
                out = f"work-{number.name}"
                with Running(self, "distances", "--out", out, "--metrics", "cwcbrt,pawcielab", "--device", "host",
                             stdout=subprocess.DEVNULL) as running:
                    running.wait_for(lambda: list((self.work / out).glob("*.npy")))
                    start = time.monotonic()
                    errors = running.stop(number)
                    self.assertLess(time.monotonic() - start, 10)
                self.assertEqual(errors, "merl-scan: interrupted; tiles that are finished stay, and the same command "
                                         "computes the others\n")
                self.assertFalse([path for path in self.tiles(out) if ".partial" in path.name])


@unittest.skipUnless(has_mpi(), "there is no mpirun, or the program is built without MPI")
class OnMpi(Case):
    """Processes of one machine, which is what a test can have."""

    OPTIONS = ["--metrics", "cwcbrt,pawcielab", "--device", "host", "--threads", "1"]
    GRID_OPTIONS = ["--grid", "18x18x36", *OPTIONS]
    LONGER = ["--grid", "30x30x60", *OPTIONS]  # some seconds

    def mpirun(self, ranks, *arguments):
        return ([MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), PROGRAM, *map(str, arguments)])

    def compute(self, ranks, out, *options):
        result = subprocess.run(self.mpirun(ranks, "distances", *(options or self.GRID_OPTIONS), "--out", out),
                                cwd=self.work, capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        return result.stdout

    def test_any_number_of_ranks(self):
        self.assert_success("distances", *self.GRID_OPTIONS, "--out", "alone")
        alone = tree(self.work / "alone")
        self.assertEqual(len(alone), 1 + 2 * 36)
        direct = self.scan("--grid", "18x18x36", "--device", "host", out="direct")
        for ranks in 1, 2, 3, 4:
            with self.subTest(ranks=ranks):
                out = f"of-{ranks}"
                output = self.compute(ranks, out)
                self.assertRegex(output, r"(?m)^tiles +0 of 36 are there, 36 to compute$")
                self.assertRegex(output, r"(?m)^computed +36 tiles by " +
                                 ("one process" if ranks == 1 else f"{ranks} processes") + "$")
                self.assertEqual(tree(self.work / out), alone)
                read = self.scan("--distances", out, "--force", out="read")
                for name in RESULTS:
                    self.assertEqual((read / name).read_bytes(), (direct / name).read_bytes())
        counted = read_json(self.work / "read" / "summary.json")
        self.assertEqual((counted["disagreements"], counted["exact"]),
                         (read_json(direct / "summary.json")["disagreements"], True))

    def ranks_of(self, launcher):
        """The processes of the program that a launcher started."""
        found = []
        for entry in os.listdir("/proc"):
            if entry.isdigit():
                try:
                    with open(f"/proc/{entry}/stat", encoding="ascii") as file:
                        parent = int(file.read().rsplit(")", 1)[1].split()[1])
                    with open(f"/proc/{entry}/cmdline", "rb") as file:
                        is_ours = file.read().startswith(os.fsencode(PROGRAM))
                except OSError:
                    continue
                if parent == launcher and is_ours:
                    found.append(int(entry))
        return sorted(found)

    def test_a_rank_is_killed(self):
        self.compute(2, "whole", *self.LONGER)
        with subprocess.Popen(self.mpirun(3, "distances", *self.LONGER, "--out", "work"), cwd=self.work,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as launcher:
            end = time.monotonic() + 120
            while len(list((self.work / "work").glob("*.npy"))) < 3:
                self.assertIsNone(launcher.poll(), "it ended")
                self.assertLess(time.monotonic(), end)
                time.sleep(0.002)
            os.kill(self.ranks_of(launcher.pid)[1], signal.SIGKILL)
            launcher.communicate(timeout=60)
            self.assertNotEqual(launcher.returncode, 0)
        left = {path.name for path in (self.work / "work").glob("*.npy")}
        self.assertLess(len(left), 36)
        times = {name: (self.work / "work" / name).stat().st_mtime_ns for name in left}
        output = self.compute(2, "work", *self.LONGER)
        self.assertRegex(output, rf"(?m)^tiles +{len(left)} of 36 are there, {36 - len(left)} to compute$")
        self.assertRegex(output, rf"(?m)^computed +{36 - len(left)} tiles? by 2 processes$")
        self.assertEqual(tree(self.work / "work"), tree(self.work / "whole"))
        for name, time_ns in times.items():
            self.assertEqual((self.work / "work" / name).stat().st_mtime_ns, time_ns)

    def test_a_rank_that_fails_ends_all(self):
        self.compute(1, "work", *self.GRID_OPTIONS, "--tile", 20)
        result = subprocess.run(self.mpirun(3, "distances", *self.GRID_OPTIONS, "--out", "work", "--tile", 10),
                                cwd=self.work, capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(result.returncode, INPUT)
        self.assertIn("tiles/side is 20 there and 10 here", result.stderr)

    def test_parts_are_for_processes_without_mpi(self):
        result = subprocess.run(self.mpirun(2, "distances", *self.GRID_OPTIONS, "--out", "work", "--part", "1/2"),
                                cwd=self.work, capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(result.returncode, USAGE)
        self.assertIn("--part", result.stderr)

    def test_a_signal_to_the_launcher(self):
        with subprocess.Popen(self.mpirun(2, "distances", "--metrics", "cwcbrt,pawcielab", "--device", "host", "--out",
                                          "work"), cwd=self.work, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as launcher:
            end = time.monotonic() + 120
            while not list((self.work / "work").glob("*.npy")):
                self.assertIsNone(launcher.poll(), "it ended")
                self.assertLess(time.monotonic(), end)
                time.sleep(0.05)
            launcher.send_signal(signal.SIGUSR1)
            errors = launcher.communicate(timeout=30)[1]
        self.assertEqual(launcher.returncode, INTERRUPTED + signal.SIGUSR1)
        self.assertIn("merl-scan: interrupted; tiles that are finished stay", errors)


if __name__ == "__main__":
    support.main()

"""How much the program takes, and what it says when it may not have it."""

import errno
import json
import os
import random
import resource
import struct
import subprocess
import sys

import support
from support import DEVICE, INPUT, RESOURCE, SUCCESS, USAGE, Case, read_json, write_database
from tables import write_table

MIB = 2**20

# A process begins with the memory of the one that started it, so that one has to be small.
MEASURE = """
import resource, subprocess, sys
status = subprocess.run(sys.argv[1:], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                        stderr=subprocess.DEVNULL).returncode
print(status, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def write_sparse(directory, name, grid):
    """A MERL file of zeros that takes no room on the disk."""
    directory.mkdir(exist_ok=True)
    with open(directory / f"{name}.binary", "wb") as file:
        file.write(struct.pack("<3i", *grid))
        file.truncate(12 + 24 * support.voxels(grid))


class Taken(Case):
    """--memory bounds what is read and computed. Beside that there are the program with its driver,
    and what grows with the pairs."""

    def taken(self, *arguments, status=SUCCESS):
        """Runs the program, which must end with this status; returns the most memory that it held,
        in bytes."""
        result = subprocess.run([sys.executable, "-c", MEASURE, support.PROGRAM, *map(str, arguments)],
                                cwd=self.work, capture_output=True, text=True, check=True,
                                env={**os.environ, "MERL_SCAN_VALIDATE": ""})
        ended, most = map(int, result.stdout.split())
        self.assertEqual(ended, status)
        return most * 1024

    def base(self):
        """The program, its driver and a scan of nothing."""
        write_database(self.work / "tiny", 2)
        return self.taken("scan", "--database", "tiny", "--out", "tiny-out")

    def test_refining_many_materials(self):
        # All pairs of 400 materials are refined; the sums of 256 blocks of each would be 330 MB.
        grid = (6, 8, 24)
        write_database(self.work / "db",
                       {f"m{i:03}": support.samples(i // 2, grid) for i in range(400)}, grid)
        base = self.base()
        tables = []
        for memory in 16, 64, 1024:
            most = self.taken("scan", "--database", "db", "--memory", f"{memory}M", "--out",
                              f"out-{memory}", "--disagreements", 0, "--threads", 2)
            # 300 bytes of every pair, and half as much again for what allocating leaves over.
            self.assertLess(most, base + 1.5 * memory * MIB + 300 * 79800)
            tables.append([(self.work / f"out-{memory}" / name).read_bytes()
                           for name in ("pairs.csv", "selection.csv")])
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])

    def test_scoring_many_materials(self):
        grid = (6, 8, 24)
        write_database(self.work / "db",
                       {f"m{i:03}": support.samples(i // 2, grid) for i in range(200)}, grid)
        # A material and its copy are as far from every other one: float32 cannot tell which is
        # farther, so all pairs are refined under every metric.
        rows = [f"m{i:03},m{j:03},m{j + 1:03},1,0" for i in range(200) for j in range(0, 200, 2)
                if i // 2 != j // 2]
        (self.work / "votes.csv").write_text("reference,a,b,votes_a,votes_b\n" + "\n".join(rows))
        most = self.taken("score", "--judgements", "votes.csv", "--database", "db", "--memory",
                          "56M", "--out", "out", "--threads", 2)
        # 200 bytes of every pair and metric, most of them while it is refined.
        self.assertLess(most, self.base() + 1.5 * 56 * MIB + 15 * 200 * 19900)

    def test_few_materials_on_a_fine_grid(self):
        for name in "ab":
            write_sparse(self.work / "db", name, (200, 200, 250))
        base = self.base()
        most = self.taken("slices", "--database", "db", "--materials", "a,b", "--out", "out")
        self.assertLess(most, base + 32 * MIB)  # a material has 240 MB
        most = self.taken("scan", "--database", "db", "--memory", "24M", "--out", "scan")
        self.assertLess(most, base + 1.5 * 24 * MIB)

    def test_a_contact_sheet_of_many(self):
        materials = {f"m{i:04}": support.samples(i, (2, 2, 2)) for i in range(1500)}
        write_database(self.work / "db", materials, (2, 2, 2))
        most = self.taken("render", "--database", "db", "--size", "128", "--out", "out")
        # At 128 pixels each it would be 30 bytes of 25 million pixels.
        self.assertLess(most, self.base() + 600 * MIB)

    def expect_few_times(self, times, name, text, status, *command):
        """That the program takes no more than so many times the size of this file of the user's
        beyond what it always takes."""
        (self.work / name).write_bytes(text.encode())
        most = self.taken(*command, status=status)
        self.assertLess(most, self.taken("--version") + 20 * MIB + times * len(text))

    def test_kits(self):
        numbers = random.Random(3)
        write_table(self.work / "t.csv", ["one", "two"], "abcdef",
                    lambda _: numbers.lognormvariate(0, 1))
        self.scan("--distances", "t.csv", "--select", "3", out="scan")
        selection = self.work / "scan" / "selection.csv"
        many = "[" + "0," * (8 * MIB) + "0]"
        deep = "[" * (8 * MIB)
        trial = '{"kind": %s}' % many
        row = "judge,trial,configuration,kind,left_1,left_2,right_1,right_2,swapped,vote," \
              "response_ms,seed,kit_hash\nj,1,1,selection,a,b,c,d,0,1,,1,k\n"
        (self.work / "votes.csv").write_text(row)
        command = ["votes", "votes.csv", "--selection", selection, "--kit", "kit.json", "--out", "o"]
        for text in ('{"more": %s}' % many, '{"metrics": %s}' % many, '{"trials": %s}' % many,
                     '{"trials": [%s]}' % trial, '{"trials": [{"left": %s}]}' % many, many,
                     '{"more": %s' % deep, '{"trials": %s' % deep, deep):
            self.expect_few_times(3, "kit.json", text, INPUT, *command)

    def test_judgements(self):
        command = ["score", "--judgements", "j.json", "--out", "o"]
        many = "0," * (8 * MIB) + "0"
        for text in ('{"answers": [[%s]]}' % many, '{"more": [%s]}' % many,
                     '{"more": %s' % ("[" * 8 * MIB)):
            self.expect_few_times(3, "j.json", text, INPUT, *command)
        rows = "reference,a,b,votes_a,votes_b\n" + "a,b,c,1,0\n" * MIB
        (self.work / "empty").mkdir()
        self.expect_few_times(6, "j.json", rows, INPUT, *command, "--database", "empty")

    def test_tables(self):
        text = "material_1,material_2,x,y\n" + "a,b,0,0\n" * (2 * MIB) + "b,a,0,1\n"
        self.expect_few_times(7, "t.csv", text, INPUT, "scan", "--distances", "t.csv", "--out", "o")


class Refused(Case):
    """What is too large is a line and a status."""

    warns = True  # of materials that are zero

    def test_a_grid_that_no_buffer_holds(self):
        for name in "ab":
            write_sparse(self.work / "db", name, (210, 210, 210))
        self.assert_refused(DEVICE, ["9261000 samples", "buffer"], "render", "--database", "db",
                            "--out", "out")

    def test_a_grid_with_a_long_side(self):
        for name in "ab":
            write_sparse(self.work / "db", name, (1, 1, 65537))
        for command in ["scan"], ["render"], ["compare"]:
            self.assert_refused(INPUT, ["1 x 1 x 65537", "at most 65536"], *command, "--database",
                                "db", "--out", "out")
        for name in "ab":
            write_sparse(self.work / "db", name, (1, 1, 65536))
        self.scan("--database", "db", "--fast")

    def test_more_runs_than_memory(self):
        for name in "ab":
            write_sparse(self.work / "db", name, (1000, 1000, 3))
        self.assert_refused(USAGE, ["--memory", "too small", "at least"], "scan",
                            "--database", "db", "--out", "out", "--memory", "32M")

    def test_more_disagreements_than_can_be_listed(self):
        numbers = random.Random(5)
        write_table(self.work / "t.csv", ["x", "y"], [f"m{i}" for i in range(300)],
                    lambda _: numbers.lognormvariate(0, 1))
        line = self.assert_refused(USAGE, ["can be listed (268435456)", "--disagreements"], "scan",
                                   "--distances", "t.csv", "--out", "out")
        for more in 268435457, 2**64 - 1:
            self.assert_refused(USAGE, ["can be listed (268435456)", "--disagreements"], "scan",
                                "--distances", "t.csv", "--out", "out", "--disagreements", more)
        self.assertIn("disagreements", line)

    def test_images_that_are_too_large(self):
        write_database(self.work / "db", 2)
        lights = ["--light=1,1,1"] * 40
        self.assert_refused(USAGE, ["2048 x 2048", "40 lights", "1024"], "render", "--database", "db",
                            "--size", 2048, *lights, "--out", "out")

    def test_long_texts_of_a_file(self):
        (self.work / "t.csv").write_text(f"material_1,material_2,x,y\na,b,1,{'9' * MIB}e9\n")
        line = self.assert_refused(INPUT, ["t.csv, line 2", " ... ", "zero or more"], "scan",
                                   "--distances", "t.csv", "--out", "out")
        self.assertLess(len(line), 4000)


class Limited(Case):
    """What the system does not give is a line and a status, and no bug."""

    def limited(self, limits, *command, **changes):
        """The result of the program under limits of the system."""
        def limit():
            for name, value in limits.items():
                resource.setrlimit(getattr(resource, name), (value, value))
        return subprocess.run(
            [support.PROGRAM, *map(str, command)], cwd=self.work, user=self.user, check=False,
            stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300,
            preexec_fn=limit, env={**os.environ, "MERL_SCAN_VALIDATE": "", **changes})

    def test_address_space_for_a_driver(self):
        result = self.limited({"RLIMIT_AS": 120 * MIB}, "devices")
        self.assertEqual(result.returncode, SUCCESS)
        text = result.stdout + result.stderr
        self.assertIn("address space of this process is limited to 120 MiB (ulimit -v)", text)
        self.assertNotIn("apt-get", text)

    def test_memory(self):
        text = "material_1,material_2,x,y\n" + "a,b,0,0\n" * (8 * MIB)
        (self.work / "t.csv").write_text(text)
        result = self.limited({"RLIMIT_AS": 150 * MIB}, "scan", "--distances", "t.csv", "--out", "out")
        self.assertEqual(result.returncode, RESOURCE, result.stderr)
        self.assertIn("out of memory", self.only_line(result.stderr))
        self.assertEqual(os.listdir(self.work), ["t.csv"])

    def test_a_driver_that_crashes_for_lack_of_memory(self):
        write_database(self.work / "db", 2)
        for limit in range(130, 320, 10):
            for name in "RLIMIT_AS", "RLIMIT_DATA":
                result = self.limited({name: (limit if name == "RLIMIT_AS" else limit - 120) * MIB},
                                      "scan", "--database", "db", "--out", f"{name}-{limit}")
                self.assertIn(result.returncode, (SUCCESS, DEVICE, RESOURCE), result.stderr)
                if result.returncode != SUCCESS:
                    self.only_line(result.stderr)
                    self.assertFalse((self.work / f"{name}-{limit}").exists())

    def test_spheres_that_nobody_asked_for(self):
        # The driver of the spheres may crash within such limits; the scan needs none.
        databases = []
        for label in "org", "one", "two":
            write_database(self.work / label, 2)
            databases += ["--database", label]
        for limit in range(280, 480, 20):
            result = self.limited({"RLIMIT_AS": limit * MIB}, "scan", *databases, "--reference", "org", "--metrics",
                                  "rmse,cwcbrt", "--out", f"out-{limit}")
            self.assertEqual(result.returncode, SUCCESS, result.stderr)
            page = (self.work / f"out-{limit}" / "approximations.html").read_text()
            self.assertIn("a Vulkan driver may crash within limited memory", page)

    def test_threads(self):
        if os.geteuid() != 0:
            self.skipTest("needs a user without other processes")
        numbers = random.Random(5)
        write_table(self.work / "t.csv", ["x", "y"], [f"m{i}" for i in range(60)],
                    lambda _: numbers.lognormvariate(0, 1))
        self.work.chmod(0o777)
        (self.work / "t.csv").chmod(0o644)
        self.drop_privileges()
        self.work.chmod(0o777)
        result = self.limited({"RLIMIT_NPROC": 1}, "scan", "--distances", "t.csv", "--out", "out")
        if result.returncode != SUCCESS:  # with one processor it needs no other thread
            self.assertEqual(result.returncode, RESOURCE, result.stderr)
            self.assertIn("threads", self.only_line(result.stderr))
            self.assertEqual(os.listdir(self.work), ["t.csv"])

    def test_no_thread_to_try_a_metric_in(self):
        write_database(self.work / "db", 2)
        (self.work / "mine.glsl").write_text(
            "vec3 transform(vec3 f, Voxel v) { return f; }\nfloat weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { return distance(a, b); }\n")
        result = self.run_program("scan", "--database", "db", "--out", "out", "--metrics", "rmse,mine.glsl",
                                  LD_PRELOAD=os.environ["MERL_SCAN_FAULT_LIBRARY"],
                                  ASAN_OPTIONS=os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0",
                                  MERL_SCAN_FAULT=f"thread:1+:{errno.EAGAIN}")
        self.assertEqual(result.returncode, RESOURCE, result.stderr)
        self.assertIn("no thread", self.only_line(result.stderr))

    def test_open_files(self):
        write_database(self.work / "db", 40)
        result = self.limited({"RLIMIT_NOFILE": 16}, "scan", "--database", "db", "--out", "out")
        self.assertEqual((result.returncode, result.stderr), (SUCCESS, ""))

    def test_a_driver_that_is_hidden(self):
        for name, value in (("VK_DRIVER_FILES", "/nowhere.json"), ("VK_ICD_FILENAMES", "/nowhere.json"),
                            ("VK_LOADER_DRIVERS_DISABLE", "*")):
            changes = {"VK_DRIVER_FILES": "/nowhere.json", "VK_ICD_FILENAMES": "/nowhere.json",
                       name: value}
            line = self.assert_refused(DEVICE, [f'{name} is "{value}"', "unset"], "scan", "--out",
                                       "out", "--device", "0", MERL_SCAN_VALIDATE="", **changes)
            self.assertNotIn("apt-get", line)
        result = self.run_program("devices", VK_DRIVER_FILES="/nowhere.json",
                                  VK_ICD_FILENAMES="/nowhere.json")
        self.assertEqual(result.returncode, SUCCESS)
        self.assertIn('VK_DRIVER_FILES is "/nowhere.json"', result.stdout)

    def test_surroundings_do_not_matter(self):
        write_database(self.work / "db", 3)
        self.scan("--database", "db", out="usual")
        usual = (self.work / "usual" / "pairs.csv").read_bytes()
        for i, changes in enumerate((
                {"HOME": "/nowhere", "XDG_CACHE_HOME": "/nowhere", "TMPDIR": "/nowhere"},
                {"LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8", "TZ": "Nowhere"},
                {"COLUMNS": "1", "TERM": "dumb", "PATH": "/nowhere"})):
            self.assert_success("scan", "--database", "db", "--out", f"out-{i}", **changes)
            self.assertEqual((self.work / f"out-{i}" / "pairs.csv").read_bytes(), usual)
        result = self.limited({"RLIMIT_STACK": 128 * 1024}, "scan", "--database", "db", "--out", "out")
        self.assertEqual((result.returncode, result.stderr), (SUCCESS, ""))


class Marks(Case):
    """A byte order mark before any text is none of it."""

    warns = True  # of a selection that is not the one that was written

    MARK = b"\xef\xbb\xbf"

    def put_before(self, name):
        path = self.work / name
        path.write_bytes(self.MARK + path.read_bytes())

    def test_every_reader(self):
        numbers = random.Random(7)
        write_table(self.work / "t.csv", ["x", "y"], "abcdefgh", lambda _: numbers.lognormvariate(0, 1))
        self.put_before("t.csv")
        results = self.scan("--distances", "t.csv", "--select", 4)
        write_database(self.work / "db", {name: support.samples(ord(name)) for name in "abcdefgh"})
        self.put_before("out/selection.csv")
        self.put_before("out/pairs.csv")
        self.assert_success("judge", "--selection", results / "selection.csv", "--database", "db",
                            "--size", 16, "--repeats", 0, "--sentinels", 0, "--random", 0,
                            "--out", "kit")
        self.put_before("kit/kit.json")
        kit = json.loads((self.work / "kit" / "kit.json").read_bytes()[3:])
        rows = ["judge,trial,configuration,kind,left_1,left_2,right_1,right_2,swapped,vote,"
                "response_ms,seed,kit_hash"]
        for number, trial in enumerate(kit["trials"], 1):
            rows.append(",".join(map(str, ["j", number, trial["configuration"], trial["kind"],
                                           *trial["left"], *trial["right"], 0, 1, "", 1,
                                           kit["kit_hash"]])))
        (self.work / "votes.csv").write_text("\n".join(rows))
        (self.work / "survey.csv").write_text("judge,question,answer\nj,comments,x\n")
        (self.work / "judged.csv").write_text("reference,a,b,votes_a,votes_b\na,b,c,2,1\n")
        for name in "votes.csv", "survey.csv", "judged.csv":
            self.put_before(name)
        self.assert_success("votes", "votes.csv", "--selection", results / "selection.csv", "--kit",
                            "kit/kit.json", "--survey", "survey.csv", "--replicates", 0, "--out", "v")
        self.assert_success("score", "--judgements", "judged.csv", "--distances", "t.csv",
                            "--out", "score")
        # The indices of the JSON are those of MERL; the built-in database has the same names.
        (self.work / "l.json").write_bytes(
            self.MARK + b'{"answers": [[0, 1, 2]], "agreement": [[3, 1]]}')
        self.assert_success("score", "--judgements", "l.json", "--metrics", "rmse", "--out",
                            "lagunas")
        summary = read_json(self.work / "lagunas" / "summary.json")
        self.assertEqual(summary["judgements"]["format"], "Lagunas 2019 JSON")


if __name__ == "__main__":
    support.main()

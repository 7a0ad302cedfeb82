"""Ctrl-C at any moment: whatever the program is at, it ends soon and leaves nothing half-written."""

import array
import fcntl
import os
import random
import signal
import termios
import time

import support
from support import INTERRUPTED, Case, Running, write_database
from tables import COLUMNS, write_rows

# The program ends within a second; a busy machine may take longer. The work takes far longer still.
SOON = 10


def is_ready(running):
    """Whether the program notes SIGINT by now, and does not die of it as any other."""
    with open(f"/proc/{running.process.pid}/status", encoding="ascii") as status:
        caught = next(line.split()[1] for line in status if line.startswith("SigCgt:"))
    return int(caught, 16) >> (signal.SIGINT - 1) & 1


def unread(pipe):
    """Bytes in a pipe that nobody has read."""
    count = array.array("i", [0])
    fcntl.ioctl(pipe, termios.FIONREAD, count)
    return count[0]


class Interrupted(Case):
    def assert_stops(self, *arguments, after=1.0):
        """Sends SIGINT when the program has been at work for some seconds: it ends, says so in one
        line, and leaves nothing."""
        before = set(self.work.rglob("*"))
        with Running(self, *map(str, arguments)) as running:
            running.wait_for(lambda: is_ready(running))
            ready = running.seconds()
            running.wait_for(lambda: running.seconds() > ready + after)
            start = time.monotonic()
            errors = running.stop(signal.SIGINT)
            self.assertLess(time.monotonic() - start, SOON)
        self.assertEqual(errors, "merl-scan: interrupted; nothing was written\n")
        self.assertEqual(set(self.work.rglob("*")), before)

    def write_table(self, materials, metrics):
        numbers = random.Random(3)
        with open(self.work / "t.csv", "w", encoding="utf-8") as file:
            file.write("material_1,material_2," + ",".join(f"x{i}" for i in range(metrics)) + "\n")
            for i in range(materials):
                for j in range(i + 1, materials):
                    distances = (f"{numbers.random():.5f}" for _ in range(metrics))
                    file.write(f"m{i:04},m{j:04}," + ",".join(distances) + "\n")

    def test_a_large_table(self):
        self.write_table(1000, 2)
        for after in 0.2, 1.0, 2.5:
            with self.subTest(after=after):
                self.assert_stops("scan", "--distances", "t.csv", "--disagreements", 60_000_000,
                                  "--out", "out", after=after)

    def test_many_disagreements_are_listed(self):
        self.write_table(150, 2)  # 62 million configurations, half of them disagreements
        for after in 0.5, 1.0:
            with self.subTest(after=after):
                self.assert_stops("scan", "--distances", "t.csv", "--out", "out", after=after)

    def test_many_metrics_are_compared(self):
        self.write_table(300, 40)
        self.assert_stops("compare", "--distances", "t.csv", "--out", "out", after=3)

    def test_kernels_are_compiled_and_run(self):
        for after in 0.1, 0.4, 1.5:
            with self.subTest(after=after):
                self.assert_stops("compare", "--metrics", "all", "--out", "out", after=after)

    def test_bootstraps(self):
        names = [f"m{i:02}" for i in range(30)]
        header = "rank,left_1,left_2,right_1,right_2,one_left,one_right,two_left,two_right,agreement"
        rows = [[k + 1, *names[k % 26 : k % 26 + 4]] for k in range(100)]
        write_rows(self.work / "selection.csv", header.split(","),
                   [[*row, 1, 2, 2, 1, 0.25] for row in rows])
        files = []
        for judge in range(6):
            write_rows(self.work / f"{judge}.csv", COLUMNS,
                       [[judge, k + 1, row[0], "selection", *row[1:], 0, 1 + (k + judge) % 3, 1000,
                         7, "kit"] for k, row in enumerate(rows)])
            files.append(f"{judge}.csv")
        self.assert_stops("votes", *files, "--selection", "selection.csv", "--replicates", 1000000,
                          "--out", "out")

    def test_power(self):
        self.assert_stops("power", "--judges", "150:200", "--configurations", "900:1000")

    def test_spheres(self):
        for after in 0.5, 2.0:
            with self.subTest(after=after):
                self.assert_stops("render", "--size", 1024, "--out", "out", after=after)

    def test_a_metric_that_the_compiler_is_long_at(self):
        text = "#define A0 + f.x * v.cos_theta_i\n"
        text += "".join(f"#define A{i} A{i - 1} A{i - 1}\n" for i in range(1, 26))
        (self.work / "long.glsl").write_text(
            text + "vec3 transform(vec3 f, Voxel v) { return vec3(0.0 A25); }\n"
            "float weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { return distance(a, b); }\n")
        write_database(self.work / "db", 2)
        self.assert_stops("scan", "--database", "db", "--metrics", "rmse,./long.glsl", "--out", "out")

    def test_the_second_ends_it_at_once(self):
        """At work that does not look: it writes into a pipe that is full. The first signal alone
        would end it, too, but later, and with a word."""
        write_database(self.work / "db", 200)
        for _ in range(5):
            full, end = os.pipe()
            fcntl.fcntl(end, fcntl.F_SETPIPE_SZ, 4096)
            with Running(self, "database", "info", "db", stdout=end) as running:
                running.wait_for(lambda: is_ready(running))
                running.wait_for(lambda: unread(full) >= 4000)
                running.process.send_signal(signal.SIGINT)
                time.sleep(0.3)  # what comes sooner is the first again
                errors = running.stop(signal.SIGINT)
            os.close(full)
            os.close(end)
            self.assertEqual(running.process.returncode, INTERRUPTED + signal.SIGINT)
            if errors == "":
                return
        self.fail(errors)

    def test_twice_within_a_moment_is_once(self):
        """timeout sends a signal to its child, and then to its group."""
        with Running(self, "compare", "--metrics", "all", "--out", "out") as running:
            running.wait_for(lambda: is_ready(running))
            running.wait_for_partial()
            running.process.send_signal(signal.SIGTERM)
            time.sleep(0.002)
            errors = running.stop(signal.SIGTERM)
        self.assertEqual(errors, "merl-scan: interrupted; nothing was written\n")
        self.assertEqual(list(self.work.iterdir()), [])


if __name__ == "__main__":
    support.main()

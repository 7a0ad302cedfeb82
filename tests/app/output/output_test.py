"""Where results go: complete or not at all, whatever happens."""

import os
import pty
import re
import resource
import shutil
import signal
import subprocess

import support
from support import INPUT, OUTPUT, USAGE, Case, read_csv, read_json, tree, write_database


class Directory(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 5)

    def assert_output_refused(self, words, out, *options):
        self.assert_refused(OUTPUT, words, "scan", "--database", "db", "--out", out, *options)

    def test_existing_directory(self):
        (self.work / "there").mkdir()
        self.assert_output_refused(["there", "exists", "--force"], "there")
        self.assert_output_refused(["there", "exists", "--force"], "there/")
        (self.work / "link").symlink_to("there")
        self.assert_output_refused(["link", "exists", "--force"], "link")
        self.assert_output_refused(["exists"], ".")
        self.assert_output_refused(["exists"], "/")

    def test_existing_file(self):
        (self.work / "file").write_text("mine")
        (self.work / "dangling").symlink_to("nowhere")
        for name in "file", "dangling":
            self.assert_output_refused([name, "not a directory"], name)
            self.assert_output_refused([name, "not a directory"], name, "--force")

    def test_working_directory_that_is_gone(self):
        gone = self.work / "gone"
        gone.mkdir()
        result = subprocess.run(
            ["sh", "-c", f'rmdir "{gone}" && exec "{support.PROGRAM}" scan --out there'], cwd=gone,
            capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, result.stdout), (OUTPUT, ""))
        self.assertIn("there", self.only_line(result.stderr))

    def test_impossible_places(self):
        (self.work / "file").touch()
        self.assert_output_refused(["file/x", "Not a directory"], "file/x")
        self.assert_output_refused(["no/x", "No such file"], "no/x")
        self.assert_output_refused(["no/x", "No such file"], "no/x", "--force")
        self.assert_output_refused(["x" * 256, "too long"], "x" * 256)
        self.assert_output_refused(["x" * 256, "too long"], "db/" + "x" * 256, "--force")
        self.assert_output_refused(["/proc/x"], "/proc/x")

    def test_no_permission(self):
        existing = self.work / "there"
        existing.mkdir()
        for name in support.RESULTS:
            (existing / name).write_text("old")
        existing.chmod(0o555)
        self.drop_privileges()
        self.assert_output_refused(["out", "Permission denied"], "out")
        self.assert_output_refused(["there", "Permission denied"], "there", "--force")
        self.work.chmod(0o777)
        self.assert_output_refused(["there", "Permission denied"], "there", "--force")

    def test_spelling_of_the_path(self):
        for out in "one", "two/", "./three", "db/../four", self.work / "five", "six seven", "-":
            results = self.scan("--database", "db", out=out)
            self.assertEqual(sorted(p.name for p in results.iterdir()), support.RESULTS)
        self.assertEqual(list(self.work.glob(".*")), [])

    def test_longest_name(self):
        self.assertEqual(len(list(self.scan("--database", "db", out="x" * 255).iterdir())), 4)

    def test_dots_after_a_symbolic_link(self):
        (self.work / "real" / "deep").mkdir(parents=True)
        (self.work / "link").symlink_to("real/deep")
        self.scan("--database", "db", "--force", out="link/..")
        self.assertEqual(sorted(p.name for p in (self.work / "real").iterdir()),
                         ["deep", *support.RESULTS])
        self.assert_output_refused(["No such file"], "no/..")

    def test_permissions_are_those_that_the_user_wants(self):
        for umask in 0o022, 0o077, 0o002:
            before = os.umask(umask)  # the program inherits it
            self.addCleanup(os.umask, before)
            name = f"{umask:03o}"
            (self.work / f"{name}-there").mkdir()
            (self.work / f"{name}-there" / "pairs.csv").write_text("old")
            for results in (self.scan("--database", "db", out=name),
                            self.scan("--database", "db", "--force", out=f"{name}-there")):
                self.assertEqual(results.stat().st_mode & 0o7777, 0o777 & ~umask)
                for file in results.iterdir():
                    self.assertEqual(file.stat().st_mode & 0o7777, 0o666 & ~umask)

    def test_what_stands_in_the_place_of_old_results(self):
        """A link is replaced and what it leads to is not touched; anything else stays."""
        results = self.scan("--database", "db")
        mine = self.work / "mine"
        mine.mkdir()
        for name in "pairs.csv", "selection.csv":
            (mine / name).write_text("mine")
            (results / name).unlink()
        (results / "pairs.csv").symlink_to(mine / "pairs.csv")
        os.link(mine / "selection.csv", results / "selection.csv")
        (results / "disagreements.csv").unlink()
        (results / "disagreements.csv").symlink_to(mine)
        self.scan("--database", "db", "--force")
        self.assertEqual({p.name: p.read_text() for p in mine.iterdir()},
                         {"pairs.csv": "mine", "selection.csv": "mine"})
        for name in support.RESULTS:
            self.assertTrue((results / name).is_file() and not (results / name).is_symlink(), name)
        (results / "selection.csv").unlink()
        os.mkfifo(results / "selection.csv")
        line = self.run_program("scan", "--database", "db", "--out", "out", "--force")
        self.assertEqual(line.returncode, OUTPUT)
        self.assertIn("out/selection.csv: is a special file", self.only_line(line.stderr))

    def test_results_of_another_command_are_not_mixed_with(self):
        results = self.scan("--database", "db")
        pairs = results / "pairs.csv"
        before = tree(self.work)
        for command in (["compare", "--distances", pairs], ["compare", "--database", "db"]):
            self.assert_refused(OUTPUT, ["out/summary.json", "other results", "distances.csv"],
                                *command, "--out", "out", "--force")
        self.assertEqual(tree(self.work), before)

    def test_input_is_not_replaced(self):
        results = self.scan("--database", "db")
        (self.work / "link.csv").symlink_to("out/pairs.csv")
        for pairs in results / "pairs.csv", "out/pairs.csv", "link.csv":
            self.assert_refused(OUTPUT, ["out/pairs.csv", "read", "--out"], "scan", "--distances",
                                pairs, "--out", "out", "--force")
        (self.work / "more").mkdir()
        for name, *command in (
            ("survey.csv", "votes", "v.csv", "--selection", "s.csv", "--survey", "more/survey.csv"),
            ("judges.csv", "votes", "more/judges.csv", "--selection", "s.csv"),
            ("score.csv", "score", "--judgements", "more/score.csv", "--distances", "d.csv"),
            ("compare.csv", "compare", "--distances", "more/compare.csv"),
            ("kit.json", "judge", "--selection", "more/kit.json"),
        ):
            (self.work / "more" / name).write_text("mine")
            self.assert_refused(OUTPUT, [f"more/{name}", "read", "--out"], *command, "--out",
                                "more", "--force")

    def test_what_only_looks_like_a_leftover(self):
        results = self.scan("--database", "db")
        (self.work / "mine").mkdir()
        (self.work / "mine" / "notes.txt").write_text("mine")
        (results / ".merl-scan.partial-link").symlink_to("../mine")
        (results / ".merl-scan.partial-file").write_text("mine")
        (results / ".merl-scan.partial-empty").mkdir()
        (results / ".merl-scan.partial-other").mkdir()
        (results / ".merl-scan.partial-other" / "pairs.csv").write_text("mine")
        for name in "run", "new", "old":
            (results / f".merl-scan.partial-{name}").mkdir()
            (results / f".merl-scan.partial-{name}" / "run").touch()
        os.mkfifo(results / ".merl-scan.partial-fifo")
        (results / ".merl-scan.partial-half" / "writing").mkdir(parents=True)
        (results / ".merl-scan.partial-half" / "writing" / "pairs.csv").write_text("half")
        for name in "new", "old":
            (results / f".merl-scan.partial-{name}" / name).mkdir()
            (results / f".merl-scan.partial-{name}" / name / "notes.txt").write_text("mine")
        before = tree(self.work)
        result = self.run_program("scan", "--database", "db", "--out", "out", "--force")
        self.assertEqual(result.returncode, support.SUCCESS)
        for name, line in zip(("new", "old", "other"), sorted(
                result.stderr.splitlines(), key=lambda line: re.search("partial-(o?.)", line)[1])):
            self.assertIn(f"out/.merl-scan.partial-{name}", line)
        self.assertEqual(result.stderr.count("\n"), 3)
        gone = {str(path.name) for path in set(before) - set(tree(self.work))}
        self.assertEqual(gone, {".merl-scan.partial-empty", ".merl-scan.partial-half",
                                ".merl-scan.partial-run", "pairs.csv", "run", "writing"})
        for path, data in tree(self.work).items():
            if data == b"mine":
                self.assertEqual(before[path], data)

    def test_a_leftover_from_an_archive_does_not_lead_elsewhere(self):
        results = self.scan("--database", "db")
        leftover = results / ".merl-scan.partial-bad"
        for name in "new", "old":
            (leftover / name).mkdir(parents=True)
        (leftover / "evil").write_text("evil")
        (self.work / "mine").write_text("mine")
        for name in "../mine", str(self.work / "mine"), "..", "":
            (leftover / "run").write_bytes(b"replace\0" + name.encode() + b"\0")
            (leftover / "mine").write_text("evil")  # new/../mine
            self.run_program("scan", "--database", "db", "--out", "out")
            self.assertEqual((self.work / "mine").read_text(), "mine")
            self.assertEqual(sorted(p.name for p in results.glob("[!.]*")), support.RESULTS)

    def test_leftovers_of_somebody_else(self):
        if os.geteuid() != 0:
            self.skipTest("only root can make files of another user")
        results = self.scan("--database", "db")
        theirs = results / ".merl-scan.partial-theirs"
        (theirs / "new").mkdir(parents=True)
        (theirs / "new" / "pairs.csv").write_text("theirs")
        (theirs / "run").write_bytes(b"replace\0pairs.csv\0")
        os.chown(theirs, 65534, 65534)
        self.assert_output_refused(["out/pairs.csv", str(theirs), "another user"], "out", "--force")

    def test_force_replaces_all_results_and_nothing_else(self):
        write_database(self.work / "other", 3)
        expected = self.scan("--database", "other", "--disagreements", 1, out="expected")
        results = self.scan("--database", "db")
        (results / "notes.txt").write_text("mine")
        (results / "more").mkdir()
        self.scan("--database", "other", "--disagreements", 1, "--force")
        self.assertEqual(sorted(p.name for p in results.iterdir()),
                         sorted([*support.RESULTS, "notes.txt", "more"]))
        for table in "pairs.csv", "disagreements.csv", "selection.csv":
            self.assertEqual((results / table).read_bytes(), (expected / table).read_bytes())
        self.assertEqual(read_json(results / "summary.json")["materials"], 3)
        self.assertEqual((results / "notes.txt").read_text(), "mine")

    def test_force_without_a_directory(self):
        self.assertEqual(len(list(self.scan("--database", "db", "--force").iterdir())), 4)

    def test_force_through_a_symbolic_link(self):
        (self.work / "real").mkdir()
        (self.work / "out").symlink_to("real")
        self.scan("--database", "db", "--force")
        self.assertEqual(sorted(os.listdir(self.work / "real")), support.RESULTS)
        self.assertTrue((self.work / "out").is_symlink())

    def test_a_scan_that_fails_replaces_nothing(self):
        self.scan("--database", "db")
        (self.work / "db" / "m03.binary").write_bytes(b"")
        self.assert_refused(INPUT, ["m03.binary"], "scan", "--database", "db", "--out", "out",
                            "--force")
        self.assert_refused(USAGE, ["nope"], "scan", "--metrics", "nope,rmse", "--out", "out",
                            "--force")

    def test_results_that_cannot_be_replaced_stay_as_they_are(self):
        results = self.scan("--database", "db")
        (results / "selection.csv").unlink()
        (results / "selection.csv").mkdir()
        (results / "selection.csv" / "notes.txt").write_text("mine")
        self.assert_output_refused(["out/selection.csv", "directory"], "out", "--force")

    def test_old_results_that_cannot_be_moved_stay_as_they_are(self):
        self.scan("--database", "db")
        old = self.work / "out" / "selection.csv"  # the second to be moved
        if subprocess.run(["chattr", "+i", old], capture_output=True, check=False).returncode != 0:
            self.skipTest("no immutable files here")
        self.addCleanup(subprocess.run, ["chattr", "-i", old], check=True)
        self.assert_stays("Operation not permitted")

    def assert_stays(self, reason):
        """The old results stay as they are, and the new ones are where the error says."""
        before = tree(self.work)
        result = self.run_program("scan", "--database", "db", "--out", "out", "--force")
        self.assertEqual(result.returncode, OUTPUT)
        line = self.only_line(result.stderr)
        self.assertIn(f"{reason}; the new results are in ", line)
        self.assertTrue(line.endswith(", the old ones as they were"), line)
        (hidden,) = (self.work / "out").glob(".*")
        self.assertIn(f" {hidden}/new,", line)
        self.assertEqual(sorted(os.listdir(hidden / "new")), support.RESULTS)
        shutil.rmtree(hidden)
        self.assertEqual(tree(self.work), before)

    def test_old_results_that_are_a_disk_of_their_own(self):
        results = self.scan("--database", "db")
        (self.work / "mine").write_text("mine")
        mount = subprocess.run(["mount", "--bind", self.work / "mine", results / "selection.csv"],
                               capture_output=True, check=False)
        if mount.returncode != 0:
            self.skipTest("no mounts here")
        self.addCleanup(subprocess.run, ["umount", results / "selection.csv"], check=True)
        self.assert_stays("Device or resource busy")

    def test_standard_output_closed(self):
        result = self.run_program("scan", "--database", "db", "--out", "open")
        self.assertEqual(result.returncode, support.SUCCESS)
        command = f'"{support.PROGRAM}" scan --database db --out closed <&- >&- 2>&-'
        self.assertEqual(os.waitstatus_to_exitcode(os.system(f"cd '{self.work}' && {command}")), 0)
        for table in "pairs.csv", "disagreements.csv", "selection.csv":
            self.assertEqual((self.work / "open" / table).read_bytes(),
                             (self.work / "closed" / table).read_bytes())

    def on_full_standard_output(self, *command):
        """The one line that the program says of it."""
        with open("/dev/full", "w", encoding="utf-8") as full:
            result = subprocess.run([support.PROGRAM, *command], cwd=self.work, stdout=full,
                                    stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(result.returncode, OUTPUT)
        line = self.only_line(result.stderr)
        self.assertIn("standard output", line)
        self.assertIn("No space left", line)
        return line

    def test_tables_on_a_full_standard_output(self):
        for command in ["devices"], ["database", "info", "db"], ["--help"], ["--version"]:
            with self.subTest(command):
                self.on_full_standard_output(*command)

    def test_summary_on_a_full_standard_output(self):
        for command in ["scan", "--database", "db", "--out", "out"], ["slices", "--out", "slices"]:
            self.assertIn("complete", self.on_full_standard_output(*command))
        self.assertEqual(sorted(os.listdir(self.work / "out")), support.RESULTS)

    def test_nobody_reads_standard_output(self):
        reader, writer = os.pipe()
        os.close(reader)
        result = subprocess.run(
            [support.PROGRAM, "scan", "--database", "db", "--out", "out"], cwd=self.work,
            stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
        os.close(writer)
        self.assertEqual((result.returncode, result.stderr), (support.SUCCESS, ""))
        self.assertEqual(sorted(os.listdir(self.work / "out")), support.RESULTS)


class ClosedPipe(Case):
    """`merl-scan … | head -1`: whoever reads standard output has seen enough."""

    def run_and_read(self, size, *command):
        """Reads so many bytes of what the program prints; returns its status and complaints."""
        process = subprocess.Popen(
            [support.PROGRAM, *command], cwd=self.work, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with process.stdout, process.stderr:
            os.read(process.stdout.fileno(), size)
            process.stdout.close()
            errors = process.stderr.read()
        return process.wait(), errors.decode()

    def test_commands_that_only_print(self):
        write_database(self.work / "db", 60)
        for command in (["metrics"], ["metrics", "show", "pawcielab"], ["devices"], ["--help"],
                        ["scan", "--help"], ["--version"], ["database", "info", "db"],
                        ["power", "--judges", "5:200", "--configurations", "20"]):
            for size in 0, 1:
                with self.subTest(command):
                    self.assertEqual(self.run_and_read(size, *command), (support.SUCCESS, ""))

    def test_what_is_wrong_stays_wrong(self):
        write_database(self.work / "db", 60)
        (self.work / "db" / "m00.binary").write_bytes(b"")
        self.assertEqual(self.run_and_read(1, "database", "info", "db"), (INPUT, ""))

    def test_results_are_written(self):
        write_database(self.work / "db", 5)
        for command, last in ((["scan", "--database", "db"], "summary.json"),
                              (["compare", "--database", "db", "--metrics", "rmse,ngan"],
                               "summary.json"),
                              (["slices"], "figure-4.4.png"),
                              (["render", "--database", "db", "--size", "16"],
                               "contact-sheet.html")):
            with self.subTest(command):
                out = command[0]
                self.assertEqual(self.run_and_read(0, *command, "--out", out), (support.SUCCESS, ""))
                self.assertTrue((self.work / out / last).exists())

    def test_a_shell(self):
        for shell in "bash", "sh":
            result = subprocess.run(
                [shell, "-c", f'{"set -o pipefail;" if shell == "bash" else ""} '
                              f'"{support.PROGRAM}" metrics | head -1'],
                capture_output=True, text=True, check=False)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(len(result.stdout.splitlines()), 1)


class FullDisk(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 20)  # pairs.csv takes 9 KiB, disagreements.csv 500

    def test_nothing_is_left(self):
        disk = support.mount(self, "64k")
        self.assert_refused(OUTPUT, ["full/out/disagreements.csv", "No space left"],
                            "scan", "--database", "db", "--out", disk / "out")

    def test_largest_file_allowed(self):
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (65536, limit[1]))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_FSIZE, limit)
        self.assert_refused(OUTPUT, ["out/disagreements.csv", "File too large"],
                            "scan", "--database", "db", "--out", "out")

    def test_not_even_the_first_table(self):
        disk = support.mount(self, "8k")
        self.assert_refused(OUTPUT, ["full/out/pairs.csv", "No space left"],
                            "scan", "--database", "db", "--out", disk / "out")
        (disk / "full").write_bytes(bytes(8192))
        self.assert_refused(OUTPUT, ["full/out", "cannot be made", "No space left"],
                            "scan", "--database", "db", "--out", disk / "out")

    def test_old_results_stay(self):
        disk = support.mount(self, "64k")
        self.scan("--database", "db", "--disagreements", 0, out=disk / "out")
        self.assert_refused(OUTPUT, ["full/out/disagreements.csv", "No space left"], "scan",
                            "--database", "db", "--out", disk / "out", "--force")

    def test_force_on_a_disk_of_its_own(self):
        disk = support.mount(self, "1m")
        for number in 3, 7:
            self.scan("--database", "db", "--disagreements", number, "--force", out=disk)
            self.assertEqual(sorted(os.listdir(disk)), support.RESULTS)
            self.assertEqual(len(read_csv(disk / "disagreements.csv")[1]), number)


class Stopped(Case):
    """A scan of the built-in database takes long enough to be stopped in the middle."""

    def assert_stopped(self, stop_signal):
        with support.Running(self, "scan", "--out", "out") as running:
            running.wait_for_partial()
            running.wait_for(lambda: running.seconds() > 1.5)  # so that progress would be shown
            errors = running.stop(stop_signal)
        self.assertIn("interrupted", self.only_line(errors))
        self.assertEqual(list(self.work.iterdir()), [])

    def test_ctrl_c(self):
        self.assert_stopped(signal.SIGINT)

    def test_terminate(self):
        self.assert_stopped(signal.SIGTERM)

    def test_terminal_closed(self):
        self.assert_stopped(signal.SIGHUP)

    def test_nohup(self):
        before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # the program inherits it
        self.addCleanup(signal.signal, signal.SIGHUP, before)
        with support.Running(self, "scan", "--out", "out") as running:
            running.wait_for_partial()
            running.process.send_signal(signal.SIGHUP)
            running.wait_for(lambda: running.seconds() > 1.5)
            running.stop(signal.SIGINT)

    def test_while_disagreements_are_written(self):
        grid = (1, 1, 1)
        write_database(self.work / "db", {f"m{i}": support.samples(i, grid) for i in range(100)},
                       grid)
        with support.Running(self, "scan", "--database", "db", "--out", "out") as running:
            table = running.wait_for_partial()[0] / "writing" / "out" / "disagreements.csv"
            running.wait_for(lambda: table.exists() or running.process.poll() is not None)
            if running.process.poll() is not None:
                self.skipTest("it wrote 200 MB faster than anybody could stop it")
            errors = running.stop(signal.SIGINT)
        self.assertIn("nothing was written", self.only_line(errors))
        self.assertEqual(os.listdir(self.work), ["db"])

    def test_old_results_stay(self):
        write_database(self.work / "db", 3)
        results = self.scan("--database", "db")
        before = tree(results)
        shutil.rmtree(self.work / "db")
        with support.Running(self, "scan", "--out", "out", "--force") as running:
            running.wait_for_partial()
            running.stop(signal.SIGINT)
        self.assertEqual(tree(results), before)
        self.assertEqual(list(self.work.iterdir()), [results])

    def on_terminal(self, until, *options):
        """What a scan shows on a terminal that is stopped as soon as that holds `until`, or after
        three seconds without it."""
        try:
            terminal, other_end = pty.openpty()
        except OSError as error:
            self.skipTest(f"no pseudo-terminal to be had: {error}")
        os.set_blocking(terminal, False)
        shown = bytearray()

        def look():
            try:
                shown.extend(os.read(terminal, 4096))
            except BlockingIOError:
                pass
            return until in shown if until else running.seconds() > 3

        with support.Running(self, "scan", *options, stderr=other_end) as running:
            running.wait_for(look)
            running.stop(signal.SIGINT)
            look()
        os.close(terminal)
        os.close(other_end)
        return shown.decode()

    def test_progress_on_a_terminal(self):
        shown = self.on_terminal(b" left")
        self.assertRegex(shown, r"\d+ %, about \d+ s left")
        # The line is cleared before the last words.
        self.assertRegex(shown, r"\r\x1b\[K(merl-scan: )?interrupted; nothing was written\r\n$")

    def test_quiet_on_a_terminal(self):
        shown = self.on_terminal(None, "--quiet")
        self.assertEqual(shown, "merl-scan: interrupted; nothing was written\r\n")


if __name__ == "__main__":
    support.main()

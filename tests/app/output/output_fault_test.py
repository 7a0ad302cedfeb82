"""Old results whole, or new results whole, or a clear word where they are: at every system call that
changes something, when it fails, and when the program is killed there."""

import errno
import fcntl
import hashlib
import os
import random
import re
import shutil
import signal
import subprocess
import tempfile

import support
from support import INPUT, OUTPUT, RESULTS, SUCCESS, Case, read_json, tree

if os.access("/dev/shm", os.W_OK):
    tempfile.tempdir = "/dev/shm"  # hundreds of runs that wait for the disk
LIBRARY = os.environ["MERL_SCAN_FAULT_LIBRARY"]
CALLS = "open", "mkdir", "write", "fsync", "rename", "unlink", "flock"
STOPPED = "a run was stopped while its results went into place"


def write_distances(path, seed):
    numbers = random.Random(seed)
    rows = [f"m{a},m{b},{numbers.random()},{numbers.random()}\n" for b in range(5) for a in range(b)]
    path.write_text("material_1,material_2,x,y\n" + "".join(rows))


def content(path):
    """What tells a result from another: of the summary all but what every run has anew."""
    data = path.read_bytes()
    if path.name == "summary.json":
        data = repr({k: v for k, v in read_json(path).items() if k != "seconds"}).encode()
    return hashlib.sha256(data).hexdigest()[:8]


def contents(*directories):
    """Results by name; more than one where several directories have a name."""
    found = {}
    for directory in directories:
        for name in RESULTS:
            if (directory / name).exists():
                found.setdefault(name, []).append(content(directory / name))
    return found


def struck(fault):
    """The environment in which one of the program's calls is struck (fault.cpp)."""
    # AddressSanitizer wants to be the first library, which does not matter for these calls.
    options = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
    return {"LD_PRELOAD": LIBRARY, "MERL_SCAN_FAULT": fault, "ASAN_OPTIONS": options}


class Faults(Case):
    """`out` holds the results of old.csv and a file of the user's; new.csv is scanned into it."""

    def setUp(self):
        super().setUp()
        for seed, name in enumerate(("old", "new")):
            write_distances(self.work / f"{name}.csv", seed)
            self.assert_success("scan", "--distances", f"{name}.csv", "--out", name)
        self.old, self.new = (contents(self.work / name) for name in ("old", "new"))
        self.out = self.work / "out"
        self.log = self.work / "log"

    def start(self, old):
        for path in self.work.iterdir():
            if path.name.startswith((".", "out", "log")):
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        if old:
            shutil.copytree(self.work / "old", self.out)
            (self.out / "notes.txt").write_text("mine")

    def scan_new(self, fault=None, table="new.csv", force=True):
        """Scans, with one of the calls struck; the result, or nothing if there are not so many."""
        variables = {}
        if fault:
            variables = {**struck(f"{fault}:{self.work}/"), "MERL_SCAN_FAULT_LOG": str(self.log)}
        result = self.run_program("scan", "--distances", table, "--out", "out", "--quiet",
                                  *["--force"] * force, **variables)
        return result if not fault or self.log.exists() else None

    def in_place(self):
        return contents(self.out) if self.out.is_dir() else {}

    def assert_whole(self, expected, directories):
        found = contents(*directories)
        for name, versions in expected.items():
            self.assertIn(versions[0], found.get(name, []), name)

    def assert_kept(self, old, result):
        """The promise, after a run that failed."""
        whole = [self.old if old else {}, self.new]
        self.assertEqual(result.stderr.count("\n"), 1 + result.stderr.count("cannot be removed"))
        self.assertEqual(result.returncode, OUTPUT, result.stderr)
        if "the new results are in" in result.stderr:
            new, _, rest = result.stderr.partition("the new results are in ")[2].partition(", ")
            directories = re.compile(r"/[^ ,;\n]+")
            self.assert_whole(self.new, [self.work / d for d in directories.findall(new)])
            if "the old ones in" in rest:
                self.assert_whole(self.old, [self.work / d for d in directories.findall(rest)])
            else:
                self.assertEqual(self.in_place(), whole[0])
        elif "may not be on the disk" in result.stderr:
            self.assertEqual(self.in_place(), self.new)
            if old:
                self.assert_whole(self.old, [next(self.out.glob(".*")) / "old"])
        else:
            self.assertEqual(self.in_place(), whole[0])

    def assert_next_run_restores(self, old, result):
        """Without --force it does not replace results, so they are what the other run left."""
        before = self.in_place()
        left = any(p.parent.name.startswith(".") for p in self.work.rglob("new"))
        following = self.scan_new(table="old.csv", force=False)
        self.assertIn(following.returncode, (SUCCESS, OUTPUT), following.stderr)
        self.assertEqual(following.stderr.count(STOPPED), left, following.stderr)
        now = self.in_place()
        if left or before == self.new:
            self.assertEqual(now, self.new, result.stderr)
            self.assertIn("exists already", following.stderr)
        else:
            self.assertEqual(now, self.old, result.stderr)  # also where they are made now
            self.assertEqual("exists already" in following.stderr, old)
        self.assertEqual(list(self.work.rglob(".*")), [])
        if old:
            self.assertEqual((self.out / "notes.txt").read_text(), "mine")

    def every_call(self, call, error, old):
        """Strikes the first, the second … until there are no more; how many there were."""
        number = 1
        while True:
            self.start(old)
            result = self.scan_new(fault=f"{call}:{number}{error}")
            if result is None:
                return number - 1
            with self.subTest(call=call, error=error, number=number, old=old,
                              log=self.log.read_text()):
                if result.returncode == -signal.SIGKILL:
                    if old and not list(self.out.glob(".*/new")):
                        self.assertIn(self.in_place(), (self.old, self.new))
                elif result.returncode == SUCCESS:
                    self.assertEqual(self.in_place(), self.new)
                else:
                    self.assert_kept(old, result)
                self.assert_next_run_restores(old, result)
            number += 1

    def test_on_the_disk_before_it_goes_into_place(self):
        """What a power cut leaves is what was synced, in any order of the rest."""
        self.start(True)
        self.scan_new(fault="any:1+:none")
        calls = [line.replace(f"{self.out}/", "").replace(str(self.out), "out")
                 for line in self.log.read_text().splitlines()]
        calls = [re.sub(r"\.merl-scan\.partial-\w+", "S", call) for call in calls]
        whole = calls.index("rename S/writing S/new")
        synced = calls[:whole]
        for path in *(f"S/writing/{name}" for name in RESULTS), "S/run", "S/writing", "S", "out":
            self.assertIn(f"fsync {path}", synced)
            self.assertNotIn(f"write {path}", calls[synced.index(f"fsync {path}"):])
        first = calls.index("rename summary.json S/old/summary.json")
        self.assertIn("fsync S", calls[whole:first])
        last = calls.index("rename S/new/summary.json summary.json")
        removed = next(i for i, call in enumerate(calls) if call.startswith("unlink"))
        self.assertIn("fsync out", calls[last:removed])
        moved = [call for call in calls if call.startswith("rename")]
        self.assertEqual((moved[1], moved[-1]), (calls[first], calls[last]))

    def test_a_disk_of_any_size(self):
        disk = support.mount(self, "1m")
        sizes = 0
        for kilobytes in range(24, 84, 4):
            for path in disk.iterdir():
                shutil.rmtree(path)
            subprocess.run(["mount", "-o", "remount,size=1m", disk], check=True)
            shutil.copytree(self.work / "old", disk / "out")
            subprocess.run(["mount", "-o", f"remount,size={kilobytes}k", disk], check=True)
            result = self.run_program("scan", "--distances", "new.csv", "--out", disk / "out",
                                      "--force", "--quiet")
            self.assertEqual(list(disk.rglob(".*")), [])
            if result.returncode != SUCCESS:
                sizes += 1
                self.assertIn("No space left", self.only_line(result.stderr))
            self.assertEqual(contents(disk / "out"),
                             self.new if result.returncode == SUCCESS else self.old)
        self.assertGreater(sizes, 2)

    def test_a_call_fails(self):
        for old in False, True:
            counts = {call: self.every_call(call, f":{errno.EIO}", old) for call in CALLS}
            self.assertGreaterEqual(counts["rename"], 9 if old else 2, counts)
            self.assertGreaterEqual(counts["fsync"], 8, counts)

    def test_a_call_fails_and_all_after_it(self):
        for old in False, True:
            for call in CALLS:
                self.every_call(call, f"+:{errno.EACCES}", old)
            self.every_call("any", f"+:{errno.ENOSPC}", old)

    def test_killed_at_a_call(self):
        for old in False, True:
            self.assertGreater(self.every_call("any", ":kill", old), 20)

    def test_killed_again_while_the_next_run_restores(self):
        def stop_in_the_middle():
            self.start(True)
            self.scan_new(fault="rename:7:kill")
            self.log.unlink()
            self.assertNotIn(self.in_place(), (self.old, self.new))

        number = 1
        while True:
            stop_in_the_middle()
            result = self.scan_new(fault=f"any:{number}:kill", table="old.csv", force=False)
            if result is None:
                break
            with self.subTest(number=number, log=self.log.read_text()):
                self.scan_new(table="old.csv", force=False)
                self.assertEqual(self.in_place(), self.new)
                self.assertEqual(list(self.work.rglob(".*")), [])
            number += 1
        self.assertGreater(number, 5)

    def test_the_next_run_fails_to_restore(self):
        self.start(True)
        self.scan_new(fault="rename:7:kill")
        self.log.unlink()
        (hidden,) = self.out.glob(".*")
        before = tree(self.work)
        result = self.scan_new(fault=f"rename:1+:{errno.EIO}", table="old.csv")
        self.assertEqual(result.returncode, OUTPUT)
        line = self.only_line(result.stderr)
        for word in STOPPED, str(hidden), "Input/output error":
            self.assertIn(word, line)
        self.log.unlink()
        self.assertEqual(tree(self.work), before)
        # What does not write these files is not kept from its work.
        result = self.run_program(
            "slices", "--out", "out/slices", "--quiet",
            **struck(f"rename:1+:{errno.EIO}:/summary.json"))
        self.assertEqual(result.returncode, SUCCESS)
        self.assertIn("Input/output error", self.only_line(result.stderr))

    def test_what_somebody_put_there_meanwhile_is_not_replaced(self):
        self.start(True)
        self.scan_new(fault="rename:7:kill")
        (self.out / "summary.json").write_text("mine")
        before = tree(self.out)
        line = self.assert_refused(OUTPUT, [STOPPED, "somebody else put summary.json there"], "scan",
                                   "--distances", "old.csv", "--out", "out", "--force")
        self.assertIn(str(next(self.out.glob(".*"))), line)
        self.assertEqual(tree(self.out), before)

    def test_what_somebody_put_there_instead_of_the_old_is_not_replaced(self):
        self.start(True)
        self.scan_new(fault="rename:2:kill")  # all are whole, and none has moved
        for name in self.old:
            (self.out / name).unlink()
            (self.out / name).write_text("mine")
        before = tree(self.out)
        for force in [], ["--force"]:
            line = self.assert_refused(OUTPUT, [STOPPED, "somebody else put"], "scan",
                                       "--distances", "old.csv", "--out", "out", *force)
            self.assertIn(str(next(self.out.glob(".*"))), line)
            self.assertEqual(tree(self.out), before)

    def test_a_killed_restoring_is_told_by_the_next_run(self):
        self.start(True)
        self.scan_new(fault="rename:5:kill")
        self.log.unlink()
        self.scan_new(fault="fsync:1:kill", table="old.csv", force=False)
        result = self.scan_new(table="old.csv", force=False)
        self.assertIn(STOPPED, result.stderr)
        self.assertEqual(self.in_place(), self.new)

    def test_what_reads_results_says_where_they_are(self):
        self.start(True)
        self.scan_new(fault="rename:6:kill")
        (hidden,) = self.out.glob(".*")
        self.assert_refused(INPUT, ["selection.csv", str(hidden)], "judge", "--selection",
                            str(self.out / "selection.csv"))

    def test_what_a_person_moved_by_hand_is_not_lost(self):
        """The new results are taken elsewhere and the old ones not put back yet."""
        self.start(True)
        self.scan_new(fault="rename:6:kill")
        (hidden,) = self.out.glob(".*")
        (hidden / "new").rename(self.work / "out2")
        for make in lambda: None, (hidden / "new").mkdir:
            make()
            self.assert_refused(OUTPUT, [STOPPED, "is missing", str(hidden)], "scan", "--distances",
                                "old.csv", "--out", "out", "--force")

    def stopped_at(self, fault, *arguments):
        """A run that stands still at a call, until `go_on`."""
        running = support.Running(self, *arguments, **struck(f"{fault}:{self.work}/"))
        self.addCleanup(running.__exit__)
        self.assertTrue(os.WIFSTOPPED(os.waitpid(running.process.pid, os.WUNTRACED)[1]))
        return running

    def go_on(self, running):
        """Its exit status and what it says."""
        running.process.send_signal(signal.SIGCONT)
        errors = running.process.communicate(timeout=60)[1]
        return running.process.returncode, errors

    SCAN_NEW = ("scan", "--distances", "new.csv", "--out", "out", "--quiet")

    def test_the_target_appears_meanwhile(self):
        for make in self.out.mkdir, self.out.touch, lambda: self.out.symlink_to("nowhere"):
            self.start(False)
            running = self.stopped_at("rename:1:stop", *self.SCAN_NEW)
            make()
            status, errors = self.go_on(running)
            self.assertEqual(status, OUTPUT)
            self.assertIn("somebody else put out there", self.only_line(errors))
            (hidden,) = self.work.glob(".*")
            self.assertIn(f"the new results are in {hidden}/new/out\n", errors)
            self.assertEqual(contents(hidden / "new" / "out"), self.new)
            # The next run says so too, and puts them there as soon as it can.
            before = tree(self.work)
            line = self.only_line(self.scan_new(table="old.csv").stderr)
            self.assertIn(str(hidden), line)
            self.assertEqual(tree(self.work), before)
            self.out.rmdir() if self.out.is_dir() else self.out.unlink()
            self.scan_new(table="old.csv", force=False)
            self.assertEqual(self.in_place(), self.new)

    def test_two_runs_into_one_directory(self):
        for old in False, True:
            for call in "open:3", "rename:1", "rename:2":
                self.start(old)
                before = self.in_place()
                running = self.stopped_at(f"{call}:stop", *self.SCAN_NEW, "--force")
                for out in "out", "./out/", "../" + self.work.name + "/out":
                    for options in [], ["--force"]:
                        second = self.run_program("scan", "--distances", "old.csv", "--out", out,
                                                  *options)
                        self.assertEqual((second.returncode, second.stdout), (OUTPUT, ""))
                        word = "exists already" if old and not options else "another run"
                        self.assertIn(word, self.only_line(second.stderr))
                        self.assertEqual(self.in_place(), before)
                third = self.run_program("scan", "--distances", "old.csv", "--out", "out2")
                self.assertEqual((third.returncode, third.stderr), (SUCCESS, ""))
                self.assertEqual(self.go_on(running), (SUCCESS, ""))
                self.assertEqual(self.in_place(), self.new)
                self.assertEqual(contents(self.work / "out2"), self.old)
                self.assertEqual(list(self.work.rglob(".*")), [])

    def test_two_runs_that_start_at_once(self):
        for _ in range(30):
            self.start(False)
            runs = [support.Running(self, "scan", "--distances", table, "--out", "out", "--quiet")
                    for table in ("old.csv", "new.csv")]
            ended = [(run.process.communicate()[1], run.process.returncode) for run in runs]
            self.assertIn(("", SUCCESS), ended)
            winners = [[self.old, self.new][i] for i in range(2) if ended[i][1] == SUCCESS]
            self.assertEqual(len(winners), 1, ended)
            self.assertEqual(self.in_place(), winners[0])
            self.assertEqual(list(self.work.rglob(".*")), [])

    def test_a_script_that_locks_the_directory_itself(self):
        self.start(True)
        for place in self.work, self.out:
            descriptor = os.open(place, os.O_RDONLY)
            self.addCleanup(os.close, descriptor)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        self.assertEqual(self.scan_new().returncode, SUCCESS)
        self.assertEqual(self.in_place(), self.new)

    def test_two_runs_for_files_in_one_directory(self):
        """Different files both succeed, the same one does not."""
        self.start(True)
        before = tree(self.out)
        command = ("render", "--material", "chrome", "--size", "16", "--quiet", "--out")
        running = self.stopped_at("rename:1:stop", *command, "out/a.exr")
        for file in "out/a.exr", "out/A.png", "out/a.png":
            second = self.run_program(*command, file)
            self.assertEqual(second.returncode, SUCCESS if file == "out/A.png" else OUTPUT)
            if second.returncode == OUTPUT:
                self.assertIn("another run", self.only_line(second.stderr))
        self.assertEqual(self.go_on(running), (SUCCESS, ""))
        names = {"a.exr", "a.png", "A.exr", "A.png"}
        self.assertEqual({str(name) for name in set(tree(self.out)) - set(before)}, names)

    def test_a_file_that_appears_meanwhile(self):
        command = ("render", "--material", "chrome", "--size", "16", "--quiet", "--out")
        running = self.stopped_at("rename:2:stop", *command, "a.exr")
        (self.work / "a.png").write_text("mine")
        status, errors = self.go_on(running)
        self.assertEqual(status, OUTPUT)
        self.assertIn("a.png", self.only_line(errors))
        self.assertEqual((self.work / "a.png").read_text(), "mine")
        (hidden,) = self.work.glob(".*")
        self.assertIn(str(hidden), errors)
        self.assertEqual({p.name for p in (hidden / "new").iterdir()}, {"a.exr", "a.png"})

    def test_two_runs_that_write_the_database(self):
        running = self.stopped_at("write:2:stop", "database", "write", "abc")
        for options in [], ["--force"]:
            second = self.run_program("database", "write", "abc", *options)
            self.assertEqual(second.returncode, OUTPUT)
            self.assertIn("another run", self.only_line(second.stderr))
        running.process.send_signal(signal.SIGINT)
        status, errors = self.go_on(running)
        self.assertEqual(status, support.INTERRUPTED + signal.SIGINT)
        self.assertIn("nothing was written", errors)
        self.assertFalse((self.work / "abc").exists() or list(self.work.glob(".*")))

    def test_a_signal_while_results_go_into_place(self):
        for number in range(1, 10):
            self.start(True)
            running = self.stopped_at(f"rename:{number}:stop", *self.SCAN_NEW, "--force")
            running.process.send_signal(signal.SIGINT)
            self.assertEqual(self.go_on(running), (SUCCESS, ""))
            self.assertEqual(self.in_place(), self.new)

    def test_a_signal_before(self):
        for call in "write:2", "fsync:2":
            self.start(True)
            before = tree(self.work)
            running = self.stopped_at(f"{call}:stop", *self.SCAN_NEW, "--force")
            running.process.send_signal(signal.SIGINT)
            status, errors = self.go_on(running)
            self.assertEqual(status, support.INTERRUPTED + signal.SIGINT)
            self.assertIn("nothing was written", self.only_line(errors))
            self.assertEqual(tree(self.work), before)

    def test_the_directory_is_taken_away(self):
        for change in lambda: shutil.rmtree(self.out), lambda: self.out.rename(self.work / "out2"):
            for call in "open:3", "rename:1", "rename:2":
                self.start(True)
                running = self.stopped_at(f"{call}:stop", *self.SCAN_NEW, "--force")
                change()
                status, errors = self.go_on(running)
                self.assertEqual(status, OUTPUT)
                self.assertIn("No such file", self.only_line(errors))
                self.assertFalse(self.out.exists())

    def test_without_locks_nothing_is_swept(self):
        """As where NFS has none: a run that was killed looks like one at work."""
        self.start(True)
        self.scan_new(fault="rename:7:kill")
        self.log.unlink()
        before = tree(self.work)
        result = self.scan_new(fault=f"flock:1+:{errno.ENOLCK}", table="old.csv")
        self.assertEqual(result.returncode, OUTPUT)
        self.assertIn("this file system cannot tell", self.only_line(result.stderr))
        self.log.unlink()
        self.assertEqual(tree(self.work), before)

    def test_an_old_file_that_cannot_be_removed(self):
        self.start(True)
        result = self.scan_new(fault=f"unlink:1+:{errno.EIO}")
        self.assertEqual(result.returncode, SUCCESS)
        self.assertIn("cannot be removed", self.only_line(result.stderr))
        self.assertEqual(self.in_place(), self.new)


if __name__ == "__main__":
    support.main()

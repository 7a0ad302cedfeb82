"""What the module does to its process: nothing. Threads, Ctrl-C, forks, memory."""

import os
import resource
import subprocess
import sys
import threading
import unittest

import numpy as np

import merl_scan as ms
from array_test import brdf


def python(code, **environment):
    return subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, timeout=300,
                          env={**os.environ, **environment}, check=False)


class Process(unittest.TestCase):
    def test_import_does_nothing(self):
        result = python("""
import os, signal, threading
import numpy
def state():
    return (dict(os.environ), [signal.getsignal(s) for s in signal.valid_signals()], os.listdir("/proc/self/task"), os.getcwd())
before = state()
import merl_scan
assert state() == before
""")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))

    def test_threads(self):
        a, b = brdf(1), brdf(2)
        database = ms.Database.from_arrays({"a": a, "b": b, "c": brdf(3)})
        metric = ms.Metric("pawcielab")
        expected = metric.distance(a, b), ms.distances(database)["cwcbrt"].tolist()
        wrong = []

        def work():
            for _ in range(20):
                if (metric.distance(a, b), ms.distances(database)["cwcbrt"].tolist()) != expected:
                    wrong.append(1)

        threads = [threading.Thread(target=work) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    def test_number_of_threads_changes_nothing(self):
        a, b = brdf(1), brdf(2)
        self.assertEqual(len({ms.distance("cwcbrt", a, b, threads=n) for n in (0, 1, 2, 5)}), 1)

    def test_interrupt(self):
        result = python("""
import os, signal, threading
import merl_scan as ms
database = ms.open(shape=(20, 20, 40))
def report(stage, share):
    os.kill(os.getpid(), signal.SIGINT)
try:
    with ms.progress(report):
        for _ in range(1000):
            ms.distances(database, "paw-ciede2000", device="host")
    print("never")
except KeyboardInterrupt:
    print("interrupted", len(ms.distances(database, "rmse")))
""")
        self.assertEqual(result.stdout.split(), ["interrupted", "4950"], result.stderr)

    def test_ends_while_a_thread_computes(self):
        for seconds in (0.2, 0.5):
            result = python(f"""
import threading, time
import merl_scan as ms
database = ms.open(shape=(20, 20, 40))
begun = threading.Event()
def work():
    while True:
        with ms.progress(lambda stage, share: begun.set()):
            ms.distances(database, "paw-ciede2000", device="host")
        database["chrome"].samples()
threading.Thread(target=work, daemon=True).start()
begun.wait()
time.sleep({seconds})
print("end")
""")
            self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "end\n", ""))

    def test_progress_raises(self):
        database = ms.open(shape=(20, 20, 40), materials="*paint*")

        def report(stage, share):
            raise RuntimeError(stage)

        with self.assertRaisesRegex(RuntimeError, "distances"), ms.progress(report):
            ms.distances(database, "rmse")
        self.assertGreater(len(ms.distances(database, "rmse")), 1)

    def test_fork(self):
        result = python("""
import os
import numpy as np
import merl_scan as ms
a, b = np.ones((4, 4, 4, 3)), np.full((4, 4, 4, 3), 2.0)
def child():
    pid = os.fork()
    if pid == 0:
        try:
            os._exit(0 if ms.distance("rmse", a, b) > 0 else 1)
        except ms.ResourceError:
            os._exit(7)
        os._exit(9)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
print(child())
ms.distance("rmse", a, b)
print(child())
""")
        self.assertEqual(result.stdout.split(), ["0", "7"], result.stderr)

    def test_without_a_driver(self):
        result = python("""
import numpy as np
import merl_scan as ms
a = np.ones((12, 10, 16, 3))
print(ms.distance("rmse", a, 2 * a) > 0)
try:
    ms.render(a, size=8)
except ms.DeviceError:
    print("refused")
""", VK_ICD_FILENAMES="/none.json", VK_DRIVER_FILES="/none.json", MERL_SCAN_VALIDATE="")
        self.assertEqual(result.stdout.split(), ["True", "refused"], result.stderr)

    @unittest.skipIf("LD_PRELOAD" in os.environ, "AddressSanitizer keeps for a while what was freed")
    def test_memory_does_not_grow(self):
        def resident():
            with open("/proc/self/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * resource.getpagesize()

        metric = ms.Metric("rmse")

        def calls(count):
            for i in range(count):
                a = brdf(i % 7)
                metric.distance(a, 2 * a)
                if i % 10 == 0:
                    d = ms.distances(ms.Database.from_arrays({"a": a, "b": 2 * a, "c": 3 * a}), device="host")
                    ms.scan(d)
                    ms.grid((6, 5, 4))
                try:
                    metric.distance(a, np.ones((1, 1, 1, 3)))
                except ms.InputError:
                    pass

        calls(200)
        before = resident()
        calls(1000)
        # One of its arrays is 46 KB: had each call kept one, it would be 46 MB.
        self.assertLess(resident() - before, 12 << 20)


if __name__ == "__main__":
    unittest.main(verbosity=2)

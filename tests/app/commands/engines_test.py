"""Which engine computes which metric, and that both engines agree."""

import support
from support import DEVICE, USAGE, Case, read_json, write_database

NO_DRIVER = {"VK_ICD_FILENAMES": "/nowhere.json", "VK_DRIVER_FILES": "/nowhere.json"}

OWN = """// title: half
// formula: half
// degree: 2
vec3 transform(vec3 f, Voxel v) { return 0.5 * f; }
float weight(Voxel v) { return 1.0; }
float difference(float d) { return d * d; }
"""


def engines(results):
    """Of a scan, each engine with its metrics."""
    return [(use["engine"], use["metrics"])
            for use in read_json(results / "summary.json")["engines"]]


class Rule(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 5)
        (self.work / "half.glsl").write_text(OWN)

    def engines(self, metrics, *options, out="out", **changes):
        self.assert_success("scan", "--database", "db", "--out", out, "--metrics", metrics,
                            *options, **changes)
        return engines(self.work / out)

    def test_a_library_metric_needs_no_driver(self):
        both = ["cwcbrt", "pawcielab"]
        self.assertEqual(self.engines(",".join(both), out="usual"), [("host", both)])
        self.assertEqual(self.engines(",".join(both), **NO_DRIVER), [("host", both)])
        self.assertEqual((self.work / "usual" / "pairs.csv").read_bytes(),
                         (self.work / "out" / "pairs.csv").read_bytes())

    def test_two_engines_in_one_scan(self):
        self.assertEqual(self.engines("cwcbrt,half.glsl"), [("vulkan", ["half.glsl"]), ("host", ["cwcbrt"])])

    def test_a_device_that_is_named_computes_everything(self):
        self.assertEqual(self.engines("cwcbrt,paw-ciede2000", "--device", "llvmpipe"),
                         [("vulkan", ["cwcbrt", "paw-ciede2000"])])

    def test_a_metric_without_a_degree_needs_no_driver(self):
        both = ["cwcbrt", "paw-ciede2000"]
        for i, (options, changes) in enumerate((((), NO_DRIVER), (("--device", "host"), {}))):
            self.assertEqual(self.engines(",".join(both), *options, out=f"out-{i}", **changes),
                             [("host", both)])
            self.assertEqual(read_json(self.work / f"out-{i}" / "summary.json")["warnings"], [])

    def test_ones_own_metric_needs_a_device(self):
        command = ["scan", "--database", "db", "--metrics", "cwcbrt,half.glsl"]
        self.assert_refused(DEVICE, ["half.glsl", "VK_DRIVER_FILES"], *command, **NO_DRIVER)
        self.assert_refused(USAGE, ["half.glsl", "host"], *command, "--device", "host")


class BuiltIn(Case):
    def test_both_engines_give_the_same_selection(self):
        found = {}
        for device in "host", "llvmpipe":
            results = self.scan("--disagreements", "0", "--device", device, out=device)
            found[device] = (read_json(results / "summary.json")["disagreements"],
                             (results / "selection.csv").read_bytes())
        self.assertEqual(engines(self.work / "llvmpipe"), [("vulkan", ["cwcbrt", "pawcielab"])])
        self.assertEqual(found["host"], found["llvmpipe"])


if __name__ == "__main__":
    support.main()

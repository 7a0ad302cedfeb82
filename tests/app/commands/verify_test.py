"""merl-scan verify."""

import re

import support
from support import Case


class Verify(Case):
    def test_lavapipe_passes(self):
        output = self.assert_success("verify")
        self.assertIn("llvmpipe", output)
        rows = re.findall(r"(?m)^(.*\S) +(\S+) +(\S+)  (PASS|FAIL)$", output)
        self.assertGreaterEqual(len(rows), 10, output)
        for check, error, allowed, verdict in rows:
            self.assertEqual(verdict, "PASS", check)
            self.assertLessEqual(float(error), float(allowed), check)
        # The framework test of Ryman 2018, table 4.2, expected and actual.
        for number in "1.000000", "1.772586", "0.886257":
            self.assertRegex(output, rf"framework.* {number} +{number} ")
        for way in "on the host", "in shaders":
            for metric in "cwcbrt", "pawcielab":
                self.assertRegex(output, rf"{metric}, .*, {way} .* 4950 ")
            self.assertRegex(output, rf"disagreements, {way}.* 4289737 ")
        self.assertIn("paw-ciede2000, its twin, in shaders", output)
        self.assertIn("paw-ciede2000, its twin, on the host", output)


    def test_the_host_alone(self):
        output = self.assert_success("verify", "--device", "host", VK_ICD_FILENAMES="/nowhere.json",
                                     VK_DRIVER_FILES="/nowhere.json")
        self.assertIn("disagreements, on the host", output)
        self.assertNotIn("in shaders", output)
        self.assertNotIn("FAIL", output)


if __name__ == "__main__":
    support.main()

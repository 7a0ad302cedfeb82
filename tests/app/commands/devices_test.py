"""merl-scan devices, and the choice of a device."""

import support
from support import DEVICE, Case, read_json, write_database

NO_DRIVER = {"VK_ICD_FILENAMES": "/nowhere.json", "VK_DRIVER_FILES": "/nowhere.json"}


class Devices(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 2)

    def assert_device_refused(self, words, *options, **changes):
        self.assert_refused(DEVICE, words, "scan", "--database", "db", *options, **changes)

    def test_lavapipe_is_listed_and_can_be_used(self):
        output = self.assert_success("devices")
        self.assertRegex(output, r"(?m)^0: llvmpipe .*\n   CPU, Vulkan 1\.\d+.*\n   can be used: ")

    def test_choice_by_number_or_part_of_the_name(self):
        for choice in "0", "llvmpipe", "LLVM":
            results = self.scan("--database", "db", "--device", choice, out=f"out-{choice}")
            (use,) = read_json(results / "summary.json")["engines"]
            self.assertEqual(use["engine"], "vulkan")
            self.assertIn("llvmpipe", use["name"])

    def test_unknown_device(self):
        for choice in "GeForce", "1", "-1", "00", "99999999999999999999":
            for command in ["scan", "--database", "db"], ["verify"]:
                self.assert_refused(DEVICE, [f'"{choice}"', "0: llvmpipe"], *command, "--device",
                                    choice)

    def test_no_driver(self):
        words = ["no Vulkan driver", "VK_DRIVER_FILES", "unset it"]
        self.assert_device_refused(words, "--device", "0", **NO_DRIVER)
        output = self.assert_success("devices", **NO_DRIVER)
        self.assertTrue(output.startswith("host: "), output)
        for word in words:
            self.assertIn(word, output.splitlines()[-1])

    def test_no_device_is_needed_for_files_and_images(self):
        self.assert_success("database", "info", "db", **NO_DRIVER)
        self.assert_success("slices", "--out", "slices", **NO_DRIVER)


if __name__ == "__main__":
    support.main()

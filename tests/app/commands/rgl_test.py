"""Databases of RGL .bsdf files: what they are evaluated to, and every command that takes a database."""

import math
import pathlib
import random
import shutil
import struct

import reference
import rgl
import support
from support import INPUT, Case

MEASURED = pathlib.Path(__file__).resolve().parents[2] / "data/rgl/paper_white_rgb.bsdf"
SIDES = (90, 90, 180)  # theta_h x theta_d x phi_d, at which they are evaluated
COUNT = support.voxels(SIDES)


def angles(index):
    """theta_h, theta_d and phi_d of a voxel's centre (Ryman 2018, 4.1)."""
    r, s, t = index % 180, index // 180 % 90, index // 180 // 90
    return math.pi / 2 * ((t + 0.5) / 90) ** 2, math.pi / 2 * (s + 0.5) / 90, math.pi * (r + 0.5) / 180


class Rgl(Case):
    def setUp(self):
        super().setUp()
        self.database = self.work / "db"
        self.database.mkdir()
        shutil.copy(MEASURED, self.database)
        for name, seed in ("made-up", 1), ("other", 2):
            (self.database / f"{name}.bsdf").write_bytes(rgl.file_bytes(rgl.made_up(seed)))

    def test_evaluated(self):
        """At voxels near and far from everything, against plain Python."""
        self.assert_success("database", "write", "merl", "--database", "db", "--quiet")
        chosen = [*random.Random(7).sample(range(COUNT), 120), 0, 179, COUNT // 2]
        for path in self.database.iterdir():
            material = rgl.Material(path.read_bytes())
            above = 0
            with open(self.work / "merl" / f"{path.stem}.binary", "rb") as file:
                for index in chosen:
                    expected = material.reflectance(*angles(index))
                    above += max(expected) > 0
                    for plane, scale in enumerate(reference.SCALE):
                        file.seek(12 + 8 * (plane * COUNT + index))
                        (found,) = struct.unpack("<d", file.read(8))
                        if max(expected) > 0:
                            self.assertLess(abs(found * scale - expected[plane]),
                                            1e-9 * max(expected), (path.stem, index))
                        else:
                            self.assertLessEqual(found, 0)
            self.assertGreater(above, 60, path.stem)

    def test_every_command(self):
        out = self.scan("--database", "db", "--metrics", "rmse,cwcbrt", "--device", "host")
        database = support.read_json(out / "summary.json")["database"]
        self.assertEqual((database["kind"], database["path"]), ("RGL directory", str(self.database)))
        self.assertEqual(sorted(database["material_hashes"]), ["made-up", "other", MEASURED.stem])
        # The same files are evaluated again, and are the content that was scanned.
        self.assert_success("render", "--selection", out / "selection.csv", "--out", "spheres", "--size", 16)
        self.assertTrue((self.work / "spheres" / "made-up.exr").exists())
        (self.work / "judged.csv").write_text(
            "reference,a,b,votes_a,votes_b\n" + f"{MEASURED.stem},other,made-up,3,1\n")
        self.assert_success("score", "--judgements", "judged.csv", "--database", "db", "--out", "scores",
                            "--metrics", "rmse", "--device", "host")
        output = self.assert_success("database", "info", "db")
        self.assertIn("3 of 3 can be read; grid 90 x 90 x 180", output)
        output = self.assert_success("database", "info", "db/made-up.bsdf")
        self.assertIn("1 of 1 can be read", output)
        self.assert_success("slices", "--database", "db", "--materials", "made-up", "--out", "slices")
        self.assertTrue((self.work / "slices" / "material-made-up.png").exists())

    def test_memory_changes_nothing(self):
        """Samples that are kept, and samples that are evaluated twice."""
        results = []
        for memory in "16M", "1G":
            out = self.scan("--database", "db", "--metrics", "rmse,cwcbrt", "--device", "host", "--memory",
                            memory, out=memory)
            results.append([(out / name).read_bytes() for name in ("pairs.csv", "selection.csv")])
        self.assertEqual(*results)

    def test_changed_since_the_scan(self):
        out = self.scan("--database", "db", "--metrics", "rmse,cwcbrt", "--device", "host")
        (self.database / "other.bsdf").write_bytes(rgl.file_bytes(rgl.made_up(3)))
        self.assert_refused(INPUT, ["other", "content"], "render", "--selection", out / "selection.csv",
                            "--out", "spheres", "--size", 16)

    def test_what_cannot_be_used(self):
        fields = rgl.made_up(3)
        spectral = {("spectra" if name == "rgb" else name): field for name, field in fields.items()}
        wide = {**fields, "phi_i": ((3,), [0, 1, 2])}
        whole = rgl.file_bytes(fields)
        bad = {
            "bad-text": (b"Source  Measured\nSymmetry  PlaneSymmetrical\n", ["is text", "Zemax", "LightTools"]),
            "bad-spectral": (rgl.file_bytes(spectral), ["is spectral", "NAME_rgb.bsdf"]),
            "bad-anisotropic": (rgl.file_bytes(wide), ["is anisotropic", "3 angles"]),
            "bad-cut": (whole[:-1], ["truncated"]),
            "bad-name": (whole.replace(b"vndf", b"v\x1bdf"), ["no field vndf"]),
        }
        for name, (content, words) in bad.items():
            path = self.database / f"{name}.bsdf"
            path.write_bytes(content)
            self.assert_refused(INPUT, [f"db/{name}.bsdf: ", *words], "scan", "--database", "db", "--out", "out")
            path.unlink()
        for name, (content, _) in bad.items():
            (self.database / f"{name}.bsdf").write_bytes(content)
        result = self.run_program("database", "info", "db")
        self.assertEqual((result.returncode, result.stderr), (INPUT, ""))
        for name, (_, words) in bad.items():
            (line,) = [line for line in result.stdout.splitlines() if line.startswith(f"{name} ")]
            for word in (f"cannot be used: db/{name}.bsdf", *words):
                self.assertIn(word, line)
        self.assertIn("3 of 8 can be read", result.stdout)

    def test_what_is_no_database(self):
        self.assert_refused(INPUT, ["db/other.bsdf", "the directory that the file is in"], "scan", "--database",
                            "db/other.bsdf")
        for path in MEASURED.name, "other.bsdf":
            (self.database / path).unlink()
        self.assert_refused(INPUT, ["db: found 1 material;"], "scan", "--database", "db")


if __name__ == "__main__":
    support.main()

"""Reflectance models: the command that lists them, and databases made of them."""

import csv
import math
import pathlib
import struct

import reference
import support
from support import INPUT, USAGE, Case, read_csv, read_json

MODELS = pathlib.Path(__file__).resolve().parents[3] / "shaders" / "models"
COLUMNS = "material,diffuse_red,diffuse_green,diffuse_blue,specular_red,specular_green,specular_blue,roughness"
ROWS = ("rough,0.1,0.2,0.3,0.05,0.06,0.07,0.4", "smooth,0.3,0.2,0.1,0.5,0.5,0.5,0.1",
        "matte,0.4,0.4,0.4,0,0,0,0.2", "dark,0.01,0.01,0.02,0.1,0.1,0.1,0.02",
        "red,0.5,0.02,0.01,0.02,0.02,0.02,0.2")


def ward(row, phi_d, theta_d, theta_h):
    """The formula of Ward at one pair of directions, for three channels; none below the horizon."""
    numbers = [float(x) for x in row.split(",")[1:]]
    straight = math.cos(theta_h) * math.cos(theta_d)
    across = math.cos(phi_d) * math.sin(theta_h) * math.sin(theta_d)
    if straight <= abs(across):
        return None
    alpha = numbers[6]
    lobe = math.exp(-(math.tan(theta_h) / alpha) ** 2) / (
        4 * math.pi * alpha ** 2 * math.sqrt((straight - across) * (straight + across)))
    return [numbers[c] / math.pi + numbers[3 + c] * lobe for c in range(3)]


class Library(Case):
    def test_list(self):
        output = self.assert_success("models")
        for part in ("abc: ABC", "ward: Ward", "blinn-phong: ", "lafortune: ", "sgd: ", "100 materials",
                     "86 materials", "roughness", "Ngan, Durand and Matusik",
                     "theta_0_red, theta_0_green, theta_0_blue: ", "exp(-tan^2 theta_h / roughness^2)"):
            self.assertIn(part, output)

    def test_show(self):
        for path in MODELS.iterdir():
            name = path.stem if path.suffix == ".glsl" else path.name
            self.assertEqual(self.assert_success("models", "show", name),
                             path.read_text(encoding="utf-8"))
        self.assert_refused(USAGE, ["phong", "blinn-phong"], "models", "show", "phong")
        self.assert_refused(USAGE, ["ward.csv.csv"], "models", "show", "ward.csv.csv")


class Table(Case):
    def setUp(self):
        super().setUp()
        self.write(*ROWS)

    def write(self, *rows, columns=COLUMNS):
        (self.work / "mine.csv").write_text("\n".join([columns, *rows, ""]))

    def test_evaluated(self):
        self.assert_success("database", "write", "merl", "--database", "ward:mine.csv", "--quiet")
        count = 90 * 90 * 180
        for row in ROWS:
            above = 0
            with open(self.work / "merl" / f"{row.split(',')[0]}.binary", "rb") as file:
                for index in range(0, count, 30_011):
                    r, s, t = index % 180, index // 180 % 90, index // 180 // 90
                    expected = ward(row, math.pi * (r + 0.5) / 180, math.pi / 2 * (s + 0.5) / 90,
                                    math.pi / 2 * ((t + 0.5) / 90) ** 2)
                    for plane, scale in enumerate(reference.SCALE):
                        file.seek(12 + 8 * (plane * count + index))
                        (found,) = struct.unpack("<d", file.read(8))
                        if expected is None:
                            self.assertLessEqual(found, 0)
                        else:
                            above += 1
                            self.assertLess(abs(found * scale / expected[plane] - 1), 1e-12)
            self.assertGreater(above, 60)

    def test_every_command(self):
        out = self.scan("--database", "ward:mine.csv", "--metrics", "rmse,pawcielab")
        database = read_json(out / "summary.json")["database"]
        self.assertEqual((database["name"], database["kind"], database["path"]),
                         ("ward:mine.csv", "ward table", f"ward:{self.work}/mine.csv"))
        self.assertEqual(sorted(database["material_hashes"]), ["dark", "matte", "red", "rough", "smooth"])
        # The same table is opened again, and is the content that was scanned.
        self.assert_success("render", "--selection", out / "selection.csv", "--size", "16", "--out",
                            "spheres", "--quiet")
        judge = ("judge", "--selection", out / "selection.csv", "--size", "16", "--sentinels", "0",
                 "--random", "0", "--quiet")
        self.assert_success(*judge)
        self.assertTrue(read_json(self.work / "merl-scan-kit" / "kit.json")["database"]["checked"])
        self.assertIn("smooth", self.assert_success("database", "info", "ward:mine.csv"))
        self.write(ROWS[0].replace("0.4", "0.5"), *ROWS[1:])
        self.assert_refused(INPUT, ["ward:", "mine.csv"], *judge, "--force")
        (self.work / "mine.csv").unlink()
        self.assert_refused(INPUT, ["mine.csv"], *judge, "--force")

    def test_bad_tables(self):
        def refused(words, *rows, columns=COLUMNS):
            self.write(*rows, columns=columns)
            with self.subTest(words):
                self.assert_refused(INPUT, ["mine.csv", *words], "scan", "--database", "ward:mine.csv",
                                    "--out", "out")
                self.assertFalse((self.work / "out").exists())
        refused(["line 1", "\"gloss\""], "a,1,1,1,1,1,1,1,1", columns=COLUMNS + ",gloss")
        refused(["line 1", "no column \"roughness\""], "a,1,1,1,1,1,1",
                columns=COLUMNS.removesuffix(",roughness"))
        refused(["line 3", "roughness", "smooth", "\"nan\""], ROWS[0],
                ROWS[1].replace(",0.1", ",nan").replace("nan,0.5", "0.1,0.5"))
        refused(["line 3", "rough", "again"], ROWS[0], ROWS[0])
        refused(["ward makes \"rough\"", "voxel"], ROWS[0].replace("0.4", "0"), ROWS[1])
        refused(["found no row"])
        (self.work / "mine.csv").write_bytes(b"")
        self.assert_refused(INPUT, ["mine.csv"], "scan", "--database", "ward:mine.csv")


class BuiltIn(Case):
    def test_a_name_of_a_model_is_the_model(self):
        support.write_database(self.work / "ward", 3)
        out = self.scan("--database", "ward", "--metrics", "rmse,cwcbrt", "--disagreements", "0")
        database = read_json(out / "summary.json")["database"]
        self.assertEqual((database["kind"], database["path"]), ("built-in stand-in", "ward"))
        with (MODELS / "ward.csv").open(encoding="utf-8") as file:
            self.assertEqual(list(database["material_hashes"]), [row["material"] for row in
                                                                 csv.DictReader(file)])
        # It is opened again by its name, not as the folder.
        self.assert_success("judge", "--selection", out / "selection.csv", "--size", "16",
                            "--sentinels", "0", "--random", "0", "--quiet")
        out = self.scan("--database", "./ward", "--metrics", "rmse,cwcbrt", out="folder")
        self.assertEqual(read_json(out / "summary.json")["database"]["kind"], "MERL directory")
        self.assertEqual(len(read_csv(out / "pairs.csv")[1]), 3)

    def test_what_is_none(self):
        self.assert_refused(INPUT, ["wrad:mine.csv", "merl-scan models", "MODEL:TABLE.csv"], "scan",
                            "--database", "wrad:mine.csv")
        self.assert_refused(INPUT, ["ward:", "ward:TABLE.csv"], "scan", "--database", "ward:")
        self.assert_refused(INPUT, ["none.csv", "No such file"], "scan", "--database", "ward:none.csv")


if __name__ == "__main__":
    support.main()

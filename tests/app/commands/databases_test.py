"""Several databases at once, under labels; some of their materials; grids."""

import json
import os
import shutil

import rgl
import support
from support import GRID, INPUT, USAGE, Case, read_csv, read_json, samples, write_database
from tables import COLUMNS, write_rows

ONE = [f"m{i}" for i in range(4)]
TWO = [f"m{i}" for i in range(4, 9)]
QUICK = ("--metrics", "rmse,cwcbrt", "--device", "host", "--select", 4)


class Databases(Case):
    """Each test has the databases `whole`, and `one` and `two`, which have its materials."""

    def setUp(self):
        super().setUp()
        for name, materials in ("whole", ONE + TWO), ("one", ONE), ("two", TWO):
            write_database(self.work / name, {m: samples(m) for m in materials})

    def judge(self, *options):
        return ("judge", "--selection", "out/selection.csv", "--size", 16, "--sentinels", 0, "--random", 0,
                *options)

    def vote(self, kit, spheres=("--spheres", "spheres")):
        """What a judge says, and the judgements of it."""
        write_rows(self.work / "ann.csv", COLUMNS,
                   [["ann", i, t["configuration"], t["kind"], *t["left"], *t["right"], 0, 3, 900, kit["seed"],
                     kit["kit_hash"]] for i, t in enumerate(kit["trials"], 1)])
        self.assert_success("votes", "ann.csv", "--selection", "out/selection.csv", "--kit",
                            "merl-scan-kit/kit.json", "--out", "analysis", *spheres)


class Joined(Databases):
    def test_distances_are_those_of_one_directory(self):
        """Bit by bit, whatever the labels, on both engines; each database has its own hash."""
        for device in "host", "llvmpipe":
            options = ("--metrics", "cwcbrt,pawcielab", "--device", device, "--force")
            whole = read_csv(self.scan("--database", "whole", *options) / "pairs.csv")[1]
            for labels in ("a", "b"), ("b", "a"):
                out = self.scan("--database", f"{labels[0]}=one", "--database", f"{labels[1]}=two", *options)
                pairs = {}
                for first, second, *numbers in read_csv(out / "pairs.csv")[1]:
                    pairs[tuple(sorted(n.split("/")[1] for n in (first, second)))] = numbers
                self.assertEqual(pairs, {tuple(row[:2]): row[2:] for row in whole})
        joined = read_json(out / "summary.json")["database"]
        self.assertEqual([(d["label"], d["name"], d["kind"], d["path"], d["materials"])
                          for d in joined["databases"]],
                         [("a", "two", "MERL directory", str(self.work / "two"), 5),
                          ("b", "one", "MERL directory", str(self.work / "one"), 4)])
        self.assertEqual((joined["name"], joined["kind"], joined["path"]), ("a, b", "MERL directory", None))
        for database in joined["databases"]:
            alone = read_json(self.scan("--database", database["name"], *QUICK, "--force") / "summary.json")
            self.assertEqual(database["content_hash"], alone["database"]["content_hash"])
            self.assertNotIn("databases", alone["database"])
            for name, content in alone["database"]["material_hashes"].items():
                self.assertEqual(content, joined["material_hashes"][f"{database['label']}/{name}"])

    def test_everything_after_a_scan_finds_them_again(self):
        output = self.assert_success("scan", "--database", "one", "--database", "my fits=two", *QUICK, "--out",
                                     "out")
        self.assertIn("databases       my fits: 5 materials of two, MERL directory\n"
                      "                one: 4 materials of one, MERL directory\n", output)
        scanned = read_json(self.work / "out" / "summary.json")["database"]
        self.assert_success("render", "--selection", "out/selection.csv", "--size", 16, "--out", "spheres")
        self.assert_success(*self.judge())
        kit = read_json(self.work / "merl-scan-kit" / "kit.json")
        self.assertTrue(kit["database"]["checked"])
        self.assertEqual(kit["database"]["databases"],
                         [{key: d[key] for key in ("label", "name", "kind", "content_hash")}
                          for d in scanned["databases"]])
        shown = {name for trial in kit["trials"] for name in trial["left"] + trial["right"]}
        self.assertEqual({p.stem for p in (self.work / "spheres").glob("*=*.exr")},
                         {name.replace("/", "=") for name in shown})
        sheet = (self.work / "spheres" / "contact-sheet.html").read_text()
        name = sorted(shown)[0]
        self.assertIn(f">{name}<", sheet)
        self.assertIn(name.replace("/", "%3D").replace(" ", "%20") + ".png", sheet)
        self.vote(kit)
        analysis = read_json(self.work / "analysis" / "summary.json")
        self.assertEqual((analysis["database"], analysis["warnings"]), (scanned, []))
        self.assertIn("data:image/png", (self.work / "analysis" / "votes.html").read_text())
        score = ("score", "--judgements", "analysis/judgements.csv", "--out", "score", "--force", "--metrics",
                 "nielsen-log")
        self.assert_success(*score)
        self.assertEqual(read_json(self.work / "score" / "summary.json")["database"], scanned)
        # Also when they are elsewhere, under the same labels.
        shutil.move(self.work / "two", self.work / "moved")
        self.assert_refused(INPUT, [f"{self.work}/two", "not there any more"], *score)
        elsewhere = ("--database", "one", "--database", "my fits=moved")
        self.assert_success(*score, *elsewhere)
        self.assert_success(*self.judge("--force"), *elsewhere)
        shutil.move(self.work / "moved", self.work / "two")
        path = self.work / "two" / "m4.binary"
        path.write_bytes(path.read_bytes()[:-1] + b"\x12")
        self.assert_refused(INPUT, ["my fits, one: the content is not what was scanned"], *score)
        self.assert_refused(INPUT, ['"my fits/m4"', "not those that were scanned"], "render", "--selection",
                            "out/selection.csv", "--materials", "m4", "--out", "again", "--size", 16)

    def test_some_of_a_scan_with_files_over_two_pi(self):
        """What is over pi is read as what was beside it made it, whatever is opened of it again."""
        half, full = (6, 4, 8), (6, 4, 16)
        mixed = write_database(self.work / "mixed", {m: samples(i, half) for i, m in enumerate("bcde")}, half)
        (mixed / "a.binary").write_bytes(support.merl_bytes(samples(9, full), full))
        write_database(self.work / "other", {m: samples(i + 20, half) for i, m in enumerate("bc")}, half)
        for i, databases in enumerate((("--database", "mixed"), ("--database", "mixed", "--database", "other"))):
            self.scan(*databases, *QUICK, out=f"scan{i}")
            database = read_json(self.work / f"scan{i}" / "summary.json")["database"]
            self.assertEqual(database["grid"]["phi_d_range"], "2pi")
            self.assert_success("render", "--selection", f"scan{i}/selection.csv", "--size", 16, "--exclude", "a",
                                "--out", f"spheres{i}")
        # Older summaries know of no range: all ended at pi.
        write_database(self.work / "ambiguous", 4, full)
        self.scan("--database", "ambiguous", "--phi-d-range", "pi", *QUICK, out="older")
        path = self.work / "older" / "summary.json"
        summary = read_json(path)
        del summary["database"]["grid"]["phi_d_range"]
        path.write_text(json.dumps(summary))
        self.assert_success("render", "--selection", "older/selection.csv", "--size", 16, "--out", "spheres")

    def test_what_was_moved_is_evaluated_on_the_grid_of_the_scan(self):
        self.scan("--database", "ward", "--database", "two", "--materials", "ward/a*,two/*", "--grid", "6x5x8", *QUICK)
        shutil.move(self.work / "two", self.work / "moved")
        self.assert_success("render", "--selection", "out/selection.csv", "--size", 16, "--out", "spheres",
                            "--database", "ward", "--database", "two=moved")
        self.scan("--database", "ward", "--materials", "a*", "--grid", "4x5x7", *QUICK, out="alone")
        self.assert_success("render", "--selection", "alone/selection.csv", "--size", 16, "--out", "again",
                            "--database", "ward")

    def test_a_folder_that_is_called_like_a_model(self):
        write_database(self.work / "ward", 3)
        self.scan("--database", "ward", "--database", "mine=./ward", "--materials", "ward/a*,mine/*", *QUICK)
        names = [d["name"] for d in read_json(self.work / "out" / "summary.json")["database"]["databases"]]
        self.assertEqual(len(names), 2)
        self.assertIn("./ward", names)
        self.assert_success("database", "write", "ward", "--database", "ward", "--materials", "alum-bronze", "--grid",
                            "4x4x8", "--force", "--quiet")

    def test_records_that_were_edited(self):
        self.scan("--database", "one", "--database", "two", *QUICK)
        path = self.work / "out" / "summary.json"
        whole = read_json(path)
        first, second = whole["database"]["databases"]
        for words, change in (
            (["does not say which database"], {"databases": []}),
            (["does not say where"], {"databases": [{**first, "path": None}, second]}),
            (["label"], {"databases": [{**first, "label": "a/b"}, second]}),
            (["one is named twice"], {"databases": [first, {**second, "path": first["path"], "name": "one"}]}),
            (["no database with the label"], {"databases": [first]}),
            (["no database with the label"], {"databases": [first, {**second, "label": "other"}]}),
            (["the grid is"], {"grid": {"theta_h": 65536, "theta_d": 65536, "phi_d": 65536}}),
            (["the grid is"], {"grid": {"theta_h": 0, "theta_d": 1, "phi_d": 1}}),
        ):
            path.write_text(json.dumps({**whole, "database": {**whole["database"], **change}}))
            before = support.tree(self.work)
            result = self.run_program(*self.judge())
            self.assertIn(result.returncode, (INPUT, USAGE), result.stderr)
            line = self.only_line(result.stderr)
            for word in words:
                self.assertIn(word, line)
            self.assertEqual(support.tree(self.work), before)
        for change in {"databases": None}, {"grid": 7}:
            path.write_text(json.dumps({**whole, "database": {**whole["database"], **change}}))
            result = self.run_program(*self.judge("--force"))
            self.assertIn(result.returncode, (0, INPUT), result.stderr)

    def test_names_of_files(self):
        write_database(self.work / "a", {"b-c": samples(0), "b=c": samples(1)})
        write_database(self.work / "a-b", {"c": samples(2)})
        both = ("--database", "a", "--database", "a-b")
        stems = ["a-b=c", "a=b-c", "a=b=c"]
        self.assert_success("database", "write", "written", *both, "--quiet")
        self.assertEqual(sorted(p.stem for p in (self.work / "written").iterdir()), stems)
        pairs = [read_csv(self.scan(*databases, *QUICK, "--force") / "pairs.csv")[1]
                 for databases in (both, ("--database", "written"))]
        for joined, written in zip(*pairs):
            self.assertEqual([name.replace("/", "=") for name in joined[:2]], written[:2])
            # A number goes through 1/sr when it is written, which may change its last digit.
            self.assertAlmostEqual(float(joined[2]), float(written[2]), 6)
        self.assert_success("render", *both, "--size", 16, "--out", "spheres")
        self.assertEqual(sorted(p.stem for p in (self.work / "spheres").glob("*.exr")), stems)
        image = (self.work / "spheres" / "a-b=c.png").read_bytes()
        self.assertIn(b"a-b/c of a-b, MERL directory; light", image)
        self.assert_success("slices", *both, "--materials", "a/*", "--out", "slices")
        self.assertEqual(sorted(p.stem for p in (self.work / "slices").glob("material*.exr")),
                         ["material-a=b-c", "material-a=b=c"])
        self.assert_refused(USAGE, ["a-b", "is the database that is read"], "database", "write", "a-b",
                            "--force", *both)

    def test_beside_the_stand_in(self):
        """What has no grid of its own has that of the others, and a stand-in is said to be one."""
        (self.work / "rgl").mkdir()
        for seed, name in enumerate(("grey", "other", "red", "white")):
            (self.work / "rgl" / f"{name}.bsdf").write_bytes(rgl.file_bytes(rgl.made_up(seed)))
        databases = ("--database", "rgl", "--database", "one", "--database", "abc=built-in")
        out = self.scan(*databases, "--materials", "rgl/*,one/*,abc/gold-*", *QUICK)
        summary = read_json(out / "summary.json")
        self.assertEqual(summary["database"]["grid"],
                         dict(zip(("theta_h", "theta_d", "phi_d"), GRID)) | {"phi_d_range": "pi"})
        self.assertEqual([d["kind"] for d in summary["database"]["databases"]],
                         ["built-in stand-in", "MERL directory", "RGL directory"])
        self.assertEqual(summary["options"]["materials"], ["rgl/*,one/*,abc/gold-*"])
        output = self.assert_success("database", "info", *databases[1::2])
        self.assertIn("108 of 108 can be read; grid 6 x 5 x 8", output)
        # As if each was alone on that grid.
        alone = self.scan("--database", "rgl", "--grid", "6x5x8", *QUICK, out="alone")
        database = read_json(alone / "summary.json")["database"]
        self.assertEqual(database["content_hash"], summary["database"]["databases"][2]["content_hash"])
        self.assert_success("render", "--selection", alone / "selection.csv", "--out", "spheres", "--size", 16)
        self.assert_success("render", *databases, "--materials", "abc/chrome", "--out", "chrome.png", "--size", 16)
        self.assertIn(b"stand-in", (self.work / "chrome.png").read_bytes())
        write_rows(self.work / "said.csv", ["reference", "a", "b", "votes_a", "votes_b"],
                   [["abc/gold-paint", "one/m1", "rgl/white", 3, 1]])
        self.assert_success("score", "--judgements", "said.csv", *databases, "--metrics", "rmse", "--device",
                            "host", "--out", "score")
        self.assertIn("stand-in", (self.work / "score" / "score.svg").read_text())

    def test_all_stand_ins_are_named(self):
        databases = ("--database", "abc", "--database", "sgd", "--database", "one")
        self.scan(*databases, "--materials", "abc/gold-*,sgd/gold-*,one/*", *QUICK)
        self.assert_success(*self.judge())
        self.vote(read_json(self.work / "merl-scan-kit" / "kit.json"), spheres=())
        self.assertIn("ABC fits of MERL (stand-in, not measured); SGD fits of MERL (stand-in, not measured)",
                      (self.work / "analysis" / "votes.html").read_text())
        self.run_program("score", "--judgements", "analysis/judgements.csv", "--metrics", "nielsen-log", "--device", "host",
                         "--out", "score")
        plot = (self.work / "score" / "score.svg").read_text()
        self.assertIn("ABC fits of MERL (stand-in, not measured); SGD fits", plot)

    def test_what_names_a_database(self):
        def named(*texts, **environment):
            out = self.work / "named"
            self.assert_success("scan", *QUICK, "--out", out, "--force",
                                *(f"--database={text}" for text in texts), **environment)
            return sorted(read_json(out / "summary.json")["database"]["material_hashes"])[0]

        self.assertEqual(named("one"), "m0")
        self.assertEqual(named("x=one"), "x/m0")
        self.assertEqual(named("x=./one/"), "x/m0")
        self.assertEqual(named("x=~/one", HOME=str(self.work)), "x/m0")
        self.assertEqual(named("~/one", "two", HOME=str(self.work)), "one/m0")
        self.assertEqual(named(f"x y={self.work}/one", "two"), "two/m4")
        # What begins like a label is one, unless a slash comes first; a name comes before a folder.
        (self.work / "one").rename(self.work / "x=one")
        self.assertEqual(named("./x=one"), "m0")
        self.assertEqual(named("y=x=one"), "y/m0")
        self.assert_refused(INPUT, ["one: there is no such database"], "scan", "--database", "x=one")
        (self.work / "two").rename(self.work / "built-in")
        self.assertEqual(named("./built-in"), "m4")
        self.assertEqual(named("a=./built-in"), "a/m4")
        self.assertEqual(named("built-in"), "alum-bronze")
        self.assertEqual(named("./built-in", "a=built-in"), "a/alum-bronze")

    def test_what_is_refused(self):
        write_database(self.work / "small", 2, (2, 3, 4))
        (self.work / "deeper").mkdir()
        shutil.copytree(self.work / "two", self.work / "deeper" / "one")
        for status, words, databases in (
            (USAGE, ['label "one"', "LABEL=PATH"], ["one", "deeper/one"]),
            (USAGE, ['label "a"'], ["a=one", "a=two"]),
            (USAGE, ["the same database"], ["one", "x=one/."]),
            (USAGE, ["built-in is named twice"], ["a=built-in", "built-in"]),
            (USAGE, ["is empty"], ["=one"]),
            (USAGE, ["nothing after"], ["a="]),
            (USAGE, ["begins with a dot"], [".a=one"]),
            (USAGE, ["nobody sees", "\\x1b"], ["\x1b[1m=one"]),
            (USAGE, ["nobody sees", "\\xff"], ["\udcff=one"]),
            (INPUT, ["no such database"], ["one", "nowhere"]),
            (INPUT, ["small/m00.binary: the grid is 2 x 3 x 4", 'of all of "small"',
                     'one/m0.binary, of "one", has 6 x 5 x 8'], ["one", "small"]),
        ):
            self.assert_refused(status, words, "scan", *(f"--database={text}" for text in databases))
        os.symlink("one", self.work / "link")
        self.assert_refused(USAGE, ["the same database"], "scan", "--database", "one", "--database", "link")
        for grid in "90", "90x90", "90x90x180x2", "0x1x1", "90x90x-1", "1x1x65537", "9000x9000x9", "axbxc", "":
            self.assert_refused(USAGE, ["--grid", "90x90x180", f'"{grid}"'], "scan", "--grid", grid)
        self.assert_refused(INPUT, ["one/m0.binary: the grid is 6 x 5 x 8", "2 x 3 x 4"], "scan", "--database", "one",
                            "--grid", "2x3x4")
        self.assert_refused(USAGE, ["--distances", "--materials"], "scan", "--distances", "t.csv", "--materials",
                            "a")

    def test_info_names_every_bad_file(self):
        (self.work / "two" / "broken.binary").write_text("no samples")
        result = self.run_program("database", "info", "one", "x=two")
        self.assertEqual((result.returncode, result.stderr), (INPUT, ""))
        self.assertTrue(result.stdout.startswith("one, two: 10 materials\n"), result.stdout)
        self.assertRegex(result.stdout, r"\nx/broken +cannot be used: two/broken.binary")
        self.assertIn("9 of 10 can be read; grid 6 x 5 x 8", result.stdout)
        output = self.assert_success("database", "info", "one", "x=two", "--exclude", "broken", "--materials", "m*")
        self.assertIn("9 of 9 can be read", output)


class Subsets(Databases):
    def test_of_a_scan(self):
        (self.work / "list.txt").write_text("m3\nm7\n")
        (self.work / "whole" / "broken.binary").write_text("is not looked at")
        out = self.scan("--database", "whole", "--materials", "m[0-2],@list.txt", "--exclude", "*1", *QUICK)
        summary = read_json(out / "summary.json")
        some = ["m0", "m2", "m3", "m7"]
        self.assertEqual(list(summary["database"]["material_hashes"]), some)
        self.assertEqual((summary["options"]["materials"], summary["options"]["exclude"]),
                         (["m[0-2],@list.txt"], ["*1"]))
        # The same numbers as of a directory of these files.
        write_database(self.work / "some", {m: samples(m) for m in some})
        alone = self.scan("--database", "some", *QUICK, out="alone")
        self.assertEqual((out / "pairs.csv").read_bytes(), (alone / "pairs.csv").read_bytes())
        self.assertEqual(summary["database"]["content_hash"],
                         read_json(alone / "summary.json")["database"]["content_hash"])
        self.assert_success("scan", "--database", "whole", "--materials", "m[0-2],@~/list.txt", "--exclude", "*1",
                            *QUICK, "--out", "home", HOME=str(self.work))
        self.assertEqual((out / "pairs.csv").read_bytes(), (self.work / "home" / "pairs.csv").read_bytes())
        # What comes after has the same materials, although the list is another now.
        (self.work / "list.txt").unlink()
        self.assert_success("render", "--selection", "out/selection.csv", "--size", 16, "--out", "spheres")
        self.assert_success(*self.judge())
        self.vote(read_json(self.work / "merl-scan-kit" / "kit.json"))
        score = ("score", "--judgements", "analysis/judgements.csv", "--out", "score", "--force", "--metrics",
                 "nielsen-log", "--device", "host")
        self.assert_success(*score)
        scored = read_json(self.work / "score" / "summary.json")
        self.assertEqual(scored["database"], summary["database"])
        # Some of those are no other content.
        self.assert_refused(INPUT, ["material that has no distances", '"m7"'], *score, "--exclude", "m7")
        (self.work / "judged.csv").write_text("reference,a,b,votes_a,votes_b\nm0,m2,m3,3,1\n")
        self.assert_refused(INPUT, ["called label/name: name one database without a label"], "score", "--judgements",
                            "judged.csv", "--database", "x=some", "--metrics", "rmse")
        (self.work / "whole" / "m3.binary").unlink()
        self.assert_refused(INPUT, ['"m3"', "whole"], *score)

    def test_of_every_command(self):
        self.assert_success("compare", "--database", "whole", "--materials", "m1,m2,m3", "--metrics", "rmse,cwcbrt",
                            "--device", "host", "--out", "compared")
        self.assertEqual(len(read_csv(self.work / "compared" / "distances.csv")[1]), 3)
        self.assert_success("render", "--database", "whole", "--exclude", "m[1-8]", "--out", "m0.png", "--size", 16)
        self.assert_success("slices", "--database", "whole", "--exclude", "m[1-8]", "--out", "slices")
        self.assertTrue((self.work / "slices" / "material-m0.png").exists())
        self.assert_success("database", "write", "some", "--database", "whole", "--materials", "m[78]", "--quiet")
        self.assertEqual(sorted(p.name for p in (self.work / "some").iterdir()), ["m7.binary", "m8.binary"])
        self.assert_success("database", "write", "--database", "whole", "--materials", "m8", "one-more", "--quiet")
        output = self.assert_success("database", "info", "--materials", "m8", "whole")
        self.assertIn("whole: 1 material\n", output)

    def test_what_is_refused(self):
        for words, options in (
            (['"nope" matches none of the 9 materials of whole'], ("--materials", "m1,nope")),
            (['"nope" matches none of the 9 materials of whole'], ("--exclude", "nope")),
            (['list.txt: "nope" matches none'], ("--exclude", "@list.txt")),
            (['"" matches none'], ("--materials", "")),
            (["none of the 9 materials of whole is left"], ("--exclude", "*")),
        ):
            (self.work / "list.txt").write_text("m1\nnope\n")
            for command in ("scan",), ("compare",), ("slices", "--out", "o"), ("render",), ("database", "write", "o"):
                self.assert_refused(USAGE, words, *command, "--database", "whole", *options)
        self.assert_refused(INPUT, ["whole: found 1 material;"], "scan", "--database", "whole", "--materials", "m1")
        self.assert_refused(INPUT, ["nowhere"], "scan", "--database", "whole", "--materials", "@nowhere")
        (self.work / "list.txt").write_text("")
        self.assert_refused(INPUT, ["list.txt", "no line"], "scan", "--database", "whole", "--materials", "@list.txt")

    def test_what_is_not_chosen_is_not_opened(self):
        """An RGL download has spectral files beside those in RGB."""
        (self.work / "rgl").mkdir()
        for seed in 1, 2, 3:
            (self.work / "rgl" / f"m{seed}_rgb.bsdf").write_bytes(rgl.file_bytes(rgl.made_up(seed)))
            (self.work / "rgl" / f"m{seed}_spec.bsdf").write_text("is not looked at")
        self.assert_refused(INPUT, ["m1_spec"], "scan", "--database", "rgl")
        self.scan("--database", "rgl", "--materials", "*_rgb", "--grid", "6x5x8", *QUICK)


if __name__ == "__main__":
    support.main()

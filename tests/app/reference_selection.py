"""A selection of `scan --reference` in miniature: originals, three approximations of each, and the
configurations of one original on which CWCbrt and PAWCIELAB disagree, found the plain way among the
distances of an ordinary scan."""

import json
import random
import subprocess

from support import PROGRAM, read_csv, samples, write_database
from tables import write_rows

REFERENCE = "measured"
LABELS = ["abc", "mine", "ward"]


def approximated(numbers, label, lots):
    """Stored numbers with the error of a label: in the colour, in what is bright, or everywhere."""
    third = len(numbers) // 3
    tint = [lots.lognormvariate(0, 0.5) if label == "abc" else 1 for _ in range(3)]
    bright = sorted(numbers)[-third // 30]
    highlight = lots.uniform(2, 8) if label == "mine" else 1
    spread = lots.uniform(0.4, 0.8) if label == "ward" else 0.1
    return [x * tint[i // third] * (highlight if x >= bright else 1) * lots.lognormvariate(0, spread)
            for i, x in enumerate(numbers)]


def write_reference_selection(directory, originals=20, select=8):
    """Writes databases measured, abc, mine and ward, and results/ with selection.csv,
    approximations.csv and summary.json. Returns how many disagreements there are."""
    lots = random.Random(5)
    materials = {f"m{i:02}": samples(i) for i in range(originals)}
    write_database(directory / REFERENCE, materials)
    for label in LABELS:
        write_database(directory / label, {name: approximated(numbers, label, lots)
                                           for name, numbers in materials.items()})
    results = directory / "results"
    databases = [option for label in [REFERENCE, *LABELS] for option in ("--database", f"{label}=./{label}")]
    subprocess.run([PROGRAM, "scan", *databases, "--out", results, "--quiet"], cwd=directory, check=True)
    distances = {frozenset(row[:2]): row[2:4] for row in read_csv(results / "pairs.csv")[1]}
    for name in "pairs.csv", "disagreements.csv":
        (results / name).unlink()

    def distance(name, label):
        return distances[frozenset((f"{REFERENCE}/{name}", f"{label}/{name}"))]

    write_rows(results / "approximations.csv",
               ["original", "approximation", "label", "cwcbrt", "pawcielab"],
               [[f"{REFERENCE}/{name}", f"{label}/{name}", label, *distance(name, label)]
                for name in materials for label in LABELS])
    found = []
    for name in materials:
        for i, one in enumerate(LABELS):
            for other in LABELS[i + 1:]:
                sides = [(*map(float, distance(name, label)), label) for label in (one, other)]
                left, right = sorted(sides, key=lambda side: (side[0], -side[1]))
                if left[1] < right[1] or left[:2] == right[:2]:
                    continue
                products = sorted((left[0] * right[1], right[0] * left[1]))
                found.append((products[0] / products[1], name, left[2], right[2]))
    found.sort(key=lambda row: row[0])
    chosen = found[:select]
    write_rows(
        results / "selection.csv",
        ["rank", "left_1", "left_2", "right_1", "right_2", "cwcbrt_left", "cwcbrt_right",
         "pawcielab_left", "pawcielab_right", "agreement"],
        [[rank, f"{REFERENCE}/{name}", f"{left}/{name}", f"{REFERENCE}/{name}", f"{right}/{name}",
          distance(name, left)[0], distance(name, right)[0], distance(name, left)[1],
          distance(name, right)[1], repr(agreement)]
         for rank, (agreement, name, left, right) in enumerate(chosen, 1)])
    summary = json.loads((results / "summary.json").read_text())
    del summary["files"]  # of which this program knows no hash; then what is counted says which it is
    summary["reference"] = {"label": REFERENCE}
    summary["selection"] = {"configurations": len(chosen), "agreement_range": [chosen[0][0], chosen[-1][0]]}
    (results / "summary.json").write_text(json.dumps(summary))
    return len(found)

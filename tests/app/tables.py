"""Writes the tables that commands read."""

import csv
import random

# Of a file of votes.
COLUMNS = ["judge", "trial", "configuration", "kind", "left_1", "left_2", "right_1", "right_2",
           "swapped", "vote", "response_ms", "seed", "kit_hash"]


def write_rows(path, header, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])


def write_table(path, metrics, materials, value, header=("material_1", "material_2")):
    """A table of all pairs in a random order and orientation; returns its pairs in pair order, as
    (name, name, distance ...)."""
    names = sorted(materials, key=lambda name: name.encode())
    pairs = [(a, b, *(value(metric) for metric in metrics))
             for i, a in enumerate(names) for b in names[i + 1 :]]
    shuffled = random.Random(1).sample(pairs, len(pairs))
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*header, *metrics])
        for number, (a, b, *distances) in enumerate(shuffled):
            writer.writerow([*((b, a) if number % 2 else (a, b)), *distances])
    return pairs

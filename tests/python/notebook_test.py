"""The notebook of examples/ runs, and says what it says there."""

import pathlib
import unittest

import nbclient
import nbformat

NOTEBOOK = pathlib.Path(__file__).resolve().parents[2] / "examples" / "materials.ipynb"


def printed(notebook):
    """What every cell prints."""
    return ["".join(output["text"] for output in cell.get("outputs", ()) if output["output_type"] == "stream")
            for cell in notebook.cells]


def pictures(notebook):
    """How many pictures every cell draws."""
    return [sum("image/png" in output.get("data", ()) for output in cell.get("outputs", ()))
            for cell in notebook.cells]


class Notebook(unittest.TestCase):
    def test_says_what_it_said(self):
        expected = nbformat.read(NOTEBOOK, 4)
        found = nbformat.read(NOTEBOOK, 4)
        for cell in found.cells:
            if cell.cell_type == "code":
                cell.outputs = []
        nbclient.NotebookClient(found, timeout=300, kernel_name="python3").execute()
        self.assertEqual(printed(found), printed(expected))
        self.assertEqual(pictures(found), pictures(expected))
        self.assertEqual(sum(pictures(expected)), 2)

    def test_is_small(self):
        self.assertLess(NOTEBOOK.stat().st_size, 150_000)


if __name__ == "__main__":
    unittest.main()

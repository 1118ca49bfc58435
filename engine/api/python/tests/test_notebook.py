"""A Jupyter kernel: traces, shows a picture, and can be interrupted."""

import unittest
from importlib.util import find_spec

CELLS = (
    """
import ballot, numpy as np
scene = ballot.Scene(np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]), [[0, 1, 2]])
scene.trace(np.float32([[0, 0, 3, 0, 0, -1]]))["t"].tolist()
""",
    'ballot.render(scene, {"eye": (0, 0, 4), "target": (0, 0, 0)}, width=32, height=32)',
    """
import _thread, threading
threading.Timer(0.5, _thread.interrupt_main).start()
try:
    while True:
        scene.trace(np.zeros((1 << 20, 6), np.float32))
except KeyboardInterrupt:
    print("interrupted", len(scene.trace(np.zeros((5, 6), np.float32))))
""",
)


@unittest.skipUnless(find_spec("nbclient") and find_spec("ipykernel"), "nbclient and ipykernel are not installed")
class Notebook(unittest.TestCase):
    def test_its_cells(self):
        import nbclient
        import nbformat

        book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
        nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute()
        trace, picture, stopped = ([dict(output) for output in cell.outputs] for cell in book.cells)
        self.assertEqual(trace[-1]["data"]["text/plain"], "[3.0]")
        self.assertIn("image/png", picture[-1]["data"])
        self.assertEqual(stopped[-1]["text"], "interrupted 5\n")


if __name__ == "__main__":
    unittest.main()

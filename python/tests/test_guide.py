"""The guide's page and the package's README, executed."""

import contextlib
import io
import os
import re
import shutil
import tempfile
import unittest

from helpers import ROBOTS, ROOT


class Guide(unittest.TestCase):
    def test_blocks_of_code_do_what_they_say(self):
        for page in ("guide/src/python.md", "python/README.md"):
            text = (ROOT / page).read_text(encoding="utf-8")
            blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
            self.assertTrue(blocks, page)
            # lines as in the page, so that a failure names its line
            starts = [text[: match.start()].count("\n") + 1 for match in re.finditer(r"```python\n", text)]
            folder, names = os.getcwd(), {}
            with tempfile.TemporaryDirectory() as place, contextlib.redirect_stdout(io.StringIO()) as said:
                shutil.copy(ROBOTS / "panda.urdf", place)
                os.chdir(place)
                try:
                    for start, block in zip(starts, blocks):
                        exec(compile("\n" * start + block, page, "exec"), names)
                finally:
                    os.chdir(folder)
            if page.startswith("guide"):
                self.assertIn("<Robot 'panda': 7 joints, nq = 7, nv = 7, float64", said.getvalue())
                self.assertIn("negative", said.getvalue().lower())


if __name__ == "__main__":
    unittest.main()

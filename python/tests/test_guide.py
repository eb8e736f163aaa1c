"""The guide's page and the package's README, executed; the pictures of the page are what its code makes.

`UPDATE_EXPECTED=1` writes the pictures: look at them.
"""

import contextlib
import functools
import importlib.util
import io
import os
import pathlib
import re
import shutil
import tempfile
import unittest

from helpers import ROBOTS, ROOT

PAGE = "guide/src/python.md"
# what blocks of these names need
MODULES = {"matplotlib": r"\bplt\b", "torch": r"\btorch\b", "jax": r"\bjax\b"}
# for light pages and dark ones; texts stay texts, and names of parts depend on nothing else than these
GREY = "#808080"
STYLE = {
    "figure.figsize": (7.2, 4),
    "figure.constrained_layout.use": True,
    "savefig.transparent": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "straightline",
    "font.family": "sans-serif",
    "legend.frameon": False,
    "path.simplify_threshold": 0.5,
    **{f"{part}color": GREY for part in ("text.", "axes.label", "axes.edge", "xtick.", "ytick.")},
}
# of coordinates in a picture, in its points: the last digit
TOLERANCE = 0.011
MOST_BYTES = 36_000


class Executed:
    """What a page has said, the pictures that it has made, and the modules that were missing."""

    def __init__(self, said, pictures, missing):
        self.said, self.pictures, self.missing = said, pictures, missing


def is_there(module):
    found = importlib.util.find_spec(module) is not None
    if module == "torch" and found:
        import torch

        return hasattr(torch.library, "register_vmap")
    return found


@functools.lru_cache(maxsize=None)
def executed(page):
    """Executes the blocks of a page in their order, but those that need what is not installed."""
    text = (ROOT / page).read_text(encoding="utf-8")
    missing = [module for module in MODULES if not is_there(module)]
    left_out = re.compile("|".join(MODULES[module] for module in missing) or "(?!)")
    folder, names = os.getcwd(), {}
    with contextlib.ExitStack() as stack:
        place = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        said = stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        if "matplotlib" not in missing:
            import matplotlib

            matplotlib.use("Agg")
            stack.enter_context(matplotlib.rc_context(STYLE))
        shutil.copy(ROBOTS / "panda.urdf", place)
        os.chdir(place)
        stack.callback(os.chdir, folder)
        for match in re.finditer(r"```python\n(.*?)```", text, re.DOTALL):
            if not left_out.search(match[1]):
                # lines as in the page, so that a failure names its line
                lines = text[: match.start()].count("\n") + 1
                exec(compile("\n" * lines + match[1], page, "exec"), names)
        pictures = {path.name: tidied(path.read_text(encoding="utf-8")) for path in place.glob("*.svg")}
        return Executed(said.getvalue(), pictures, missing)


def tidied(picture):
    """A picture without what made it and when, and with coordinates to a hundredth of a point."""
    picture = re.sub(r" *<metadata>.*?</metadata>\n", "", picture, flags=re.DOTALL)
    return re.sub(r"-?\d+\.\d{3,}", lambda match: f"{float(match[0]):.2f}", picture)


def texts_and_numbers(picture):
    """A picture as texts between numbers, and the numbers. Names of its parts are counted, as they depend on every digit of the numbers."""
    names = {}
    picture = re.sub(r"\b[mpC][0-9a-f_]{10,}\b", lambda match: names.setdefault(match[0], f"part{chr(97 + len(names))}"), picture)
    pattern = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
    return re.split(pattern, picture), [float(number) for number in re.findall(pattern, picture)]


def pinned_matplotlib():
    """Its version in `python/environment`."""
    return re.search(r"matplotlib==([\d.]+)", (ROOT / "python" / "environment").read_text(encoding="utf-8"))[1]


class Guide(unittest.TestCase):
    def test_blocks_of_code_do_what_they_say(self):
        said = executed(PAGE).said
        self.assertIn("<Robot 'panda': 7 joints, nq = 7, nv = 7, float64", said)
        self.assertIn("negative", said.lower())
        executed("python/README.md")

    def test_every_module_that_blocks_need_is_there(self):
        if executed(PAGE).missing:
            self.skipTest(f"blocks are left out without {', '.join(executed(PAGE).missing)}")

    def test_pictures_are_what_the_code_makes(self):
        page = executed(PAGE)
        if "matplotlib" in page.missing:
            self.skipTest("matplotlib is not installed")
        import matplotlib

        shown = re.findall(r"!\[.*?\]\((.*?)\)", (ROOT / PAGE).read_text(encoding="utf-8"))
        self.assertEqual(sorted(page.pictures), sorted(shown))
        self.assertTrue(shown)
        for name, made in page.pictures.items():
            self.assertLess(len(made.encode()), MOST_BYTES, name)
            path = ROOT / "guide" / "src" / name
            if os.environ.get("UPDATE_EXPECTED") == "1":
                path.write_text(made, encoding="utf-8")
            self.assertTrue(path.exists(), f"{name}: UPDATE_EXPECTED=1 writes it")
        if matplotlib.__version__ != pinned_matplotlib():
            self.skipTest(f"pictures are compared where matplotlib is {pinned_matplotlib()}; here is {matplotlib.__version__}")
        for name, made in page.pictures.items():
            kept = (ROOT / "guide" / "src" / name).read_text(encoding="utf-8")
            (texts, numbers), (kept_texts, kept_numbers) = texts_and_numbers(made), texts_and_numbers(kept)
            self.assertEqual(texts, kept_texts, f"{name} is another picture: UPDATE_EXPECTED=1 writes it")
            far = [pair for pair in zip(numbers, kept_numbers) if abs(pair[0] - pair[1]) > TOLERANCE]
            self.assertFalse(far[:5], f"{name} is another picture: UPDATE_EXPECTED=1 writes it")


if __name__ == "__main__":
    unittest.main()

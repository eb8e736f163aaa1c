"""Programs that are kept in a folder for the next time."""

import os
import pathlib
import pickle
import tempfile
import unittest

import numpy as np
import straightline as sl

from helpers import PENDULUM, ROBOTS, states


class Cache(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name) / "programs"

    def kept(self):
        return sorted(self.folder.iterdir()) if self.folder.exists() else []

    def test_programs_are_kept_and_have_the_same_bits(self):
        first = sl.load(ROBOTS / "ur5.urdf", cache=self.folder, allow=["warnings"])
        given = states(first)
        torque = first.inverse_dynamics(*given)
        self.assertEqual(len(self.kept()), 1)
        text = self.kept()[0].read_bytes()
        again = sl.load(ROBOTS / "ur5.urdf", cache=str(self.folder), allow=["warnings"])
        np.testing.assert_array_equal(again.inverse_dynamics(*given), torque)
        copied = pickle.loads(pickle.dumps(first))
        np.testing.assert_array_equal(copied.inverse_dynamics(*given), torque)
        self.assertEqual([path.read_bytes() for path in self.kept()], [text])

    def test_what_is_damaged_is_made_again(self):
        torque = sl.load(PENDULUM, cache=self.folder).gravity_force([0.3])
        (path,) = self.kept()
        text = path.read_bytes()
        path.write_bytes(text[: len(text) // 2])
        np.testing.assert_array_equal(sl.load(PENDULUM, cache=self.folder).gravity_force([0.3]), torque)
        self.assertEqual(path.read_bytes(), text)

    def test_without_a_folder_nothing_is_kept(self):
        sl.load(PENDULUM, cache=False).gravity_force([0.3])
        sl.load(PENDULUM, cache=None).gravity_force([0.3])
        sl.load(PENDULUM, cache=self.folder, optimise="quick").gravity_force([0.3])
        self.assertEqual(self.kept(), [])

    def test_a_folder_that_cannot_be_is_no_error(self):
        self.folder.write_text("a file")
        self.assertEqual(sl.load(PENDULUM, cache=self.folder / "below").gravity_force([0.0]).shape, (1,))
        self.assertEqual(self.folder.read_text(), "a file")

    @unittest.skipUnless("XDG_CACHE_HOME" in os.environ, "the folder of the user is elsewhere")
    def test_the_folder_of_the_user_is_the_default(self):
        folder = pathlib.Path(os.environ["XDG_CACHE_HOME"]) / "straightline"
        before = set(folder.iterdir()) if folder.exists() else set()
        sl.load(PENDULUM.replace("pendulum", "of the user")).gravity_force([0.3])
        self.assertEqual(len(set(folder.iterdir()) - before), 1)

    def test_what_is_no_folder_is_an_error(self):
        with self.assertRaisesRegex(TypeError, "`cache` is a int; True, False or a path is expected"):
            sl.load(PENDULUM, cache=3)


if __name__ == "__main__":
    unittest.main()

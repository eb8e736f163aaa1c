"""Every option of the compiler's table is a keyword of `load`."""

import unittest
import warnings

import straightline as sl
from helpers import PENDULUM, ROBOTS, ur5
from straightline import _straightline

# what these are of the pendulum
OF_THE_PENDULUM = {"frames": ["rod"], "joint_order": ["hinge"]}
# what is refused without another option
NEEDS = {"figures": {"target": "x86-64-v3"}, "mixed_precision": {"scalar": "f32"}}


class Options(unittest.TestCase):
    def test_every_option_is_taken(self):
        table = _straightline.option_table()
        self.assertGreater(len(table), 25)
        for name, doc, example in table:
            with self.subTest(name):
                self.assertTrue(doc)
                value = OF_THE_PENDULUM.get(name, example)
                if name == "limbs":
                    # a pendulum has none
                    with self.assertRaisesRegex(sl.RobotError, "limbs"):
                        sl.load(PENDULUM, limbs="lanes")
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", sl.RobotWarning)
                    robot = sl.load(PENDULUM, **{name: value}, **NEEDS.get(name, {}))
                self.assertEqual(robot.nv, 6 + 1 if name == "floating_base" else 1)

    def test_options_do_what_they_say(self):
        self.assertEqual(sl.load(PENDULUM, frames=["rod"]).frames, ("rod",))
        self.assertEqual(sl.load(PENDULUM, frames="rod").frames, ("rod",))
        self.assertEqual(sl.load(PENDULUM, scalar="f32").dtype, "float32")
        self.assertEqual(sl.load(PENDULUM, dtype="float32").dtype, "float32")
        plain = sl.load(ROBOTS / "ur5.urdf", rules="exact", allow=["warnings"]).cost["inverse_dynamics"]
        self.assertGreater(plain.operations, ur5().cost["inverse_dynamics"].operations)

    def test_nothing_is_the_default(self):
        sl.load(PENDULUM, frames=None, fma=None, gravity=None, scene=None, dtype=None)
        self.assertNotIn("mul_add", sl.load(PENDULUM, fma=False).rust(["gravity_force"]))
        self.assertIn("mul_add", sl.load(PENDULUM, fma=True).rust(["inverse_dynamics"]))


if __name__ == "__main__":
    unittest.main()

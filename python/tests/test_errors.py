"""What users are told: each message names the place, what was expected and what was found."""

import os
import tempfile
import unittest

import numpy as np
import straightline as sl
from helpers import PENDULUM, ROBOTS, panda, states


class Files(unittest.TestCase):
    def test_a_broken_robot_file_is_told_with_its_line(self):
        broken = PENDULUM.replace('mass value="2"', 'mass value="-2"')
        with self.assertRaises(sl.RobotError) as caught:
            sl.load(broken)
        text = str(caught.exception)
        line = 1 + broken[: broken.index("-2")].count("\n")
        self.assertIn(f"robot:{line}:", text)
        self.assertIn("^", text)
        self.assertIn("error", text)
        self.assertIsInstance(caught.exception, ValueError)

    def test_the_file_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "broken.urdf")
            with open(path, "w", encoding="utf-8") as file:
                file.write(PENDULUM.replace("</robot>", ""))
            with self.assertRaisesRegex(sl.RobotError, r"broken\.urdf:\d+:\d+"):
                sl.load(path)

    def test_what_is_no_robot_is_refused(self):
        for text in ("<nothing/>", "a\nb", b"\xff\xfe\n", b""):
            with self.assertRaises(sl.RobotError):
                sl.load(text)
        with self.assertRaises(FileNotFoundError):
            sl.load("there is no such file.urdf")
        with self.assertRaisesRegex(TypeError, "`robot` is a int"):
            sl.load(3)

    def test_a_wrong_scene_is_told_with_its_line(self):
        with self.assertRaisesRegex(sl.RobotError, r"scene:2:\d+"):
            sl.load(PENDULUM, scene="[hold]\njoints = { elbow = 0.5 }\n")


class Options(unittest.TestCase):
    def test_unknown_options_are_told(self):
        with self.assertRaisesRegex(TypeError, "did you mean `gravity`"):
            sl.load(PENDULUM, gravty=(0, 0, -1))

    def test_all_wrong_values_are_told_at_once(self):
        with self.assertRaises(sl.RobotError) as caught:
            sl.load(PENDULUM, gravity=(0, 1), angle_tolerance=3.0, rules="loose", functions=["RNEA"])
        for part in ("`gravity` takes three numbers", "3.0 is not between", "`loose`", "`inverse_dynamics`"):
            self.assertIn(part, str(caught.exception))

    def test_values_of_other_types_are_told(self):
        with self.assertRaisesRegex(TypeError, "`gravity` takes three numbers"):
            sl.load(PENDULUM, gravity=[object()])
        with self.assertRaisesRegex(TypeError, "float16"):
            sl.load(PENDULUM, dtype=np.float16)
        with self.assertRaisesRegex(TypeError, "give one of them"):
            sl.load(PENDULUM, dtype=np.float32, scalar="f64")

    def test_unknown_frames_are_told(self):
        with self.assertRaisesRegex(sl.RobotError, "tool"):
            sl.load(ROBOTS / "panda.urdf", frames=["tool"])

    def test_what_machine_code_has_not_is_told(self):
        robot = sl.load(PENDULUM, dtype=np.float32, mixed_precision=1e-8)
        with self.assertRaisesRegex(sl.RobotError, "`mixed_precision` is not supported"):
            robot.gravity_force(0.0)


class Functions(unittest.TestCase):
    def test_missing_functions_are_told(self):
        with self.assertRaisesRegex(AttributeError, "did you mean `inverse_dynamics`"):
            panda().inverse_dynamic
        with self.assertRaisesRegex(AttributeError, "did you mean `inverse_dynamics`"):
            panda().rnea
        with self.assertRaisesRegex(AttributeError, "of other robots"):
            panda().close_loops


class Calls(unittest.TestCase):
    def setUp(self):
        self.robot = panda()
        self.one = states(self.robot)
        self.many = states(self.robot, 5)

    def expect(self, kind, *parts):
        case = self

        class Context:
            def __enter__(self):
                self.inner = case.assertRaises(kind)
                self.inner.__enter__()

            def __exit__(self, *error):
                handled = self.inner.__exit__(*error)
                for part in parts:
                    case.assertIn(part, str(self.inner.exception))
                return handled

        return Context()

    def test_wrong_shapes(self):
        q, qd, qdd = self.one
        call = self.robot.inverse_dynamics
        with self.expect(ValueError, "`qd`", "(6,)", "(7,)", "(..., 7)"):
            call(q, qd[:6], qdd)
        with self.expect(ValueError, "`q`", "(7, 1)"):
            call(q[:, None], qd, qdd)
        with self.expect(ValueError, "numbers of states", "`q` (5, 7)", "`qd` (4, 7)"):
            call(self.many[0], self.many[1][:4], qdd)

    def test_wrong_types(self):
        q, qd, qdd = self.one
        call = self.robot.inverse_dynamics
        with self.expect(TypeError, "`qdd`", "complex128", "float64"):
            call(q, qd, qdd + 1j)
        with self.expect(TypeError, "`q`"):
            call(None, qd, qdd)
        with self.expect(TypeError, "`q`"):
            call("zero", qd, qdd)
        with self.expect(ValueError, "`q`"):
            call([[1], [1, 2]], qd, qdd)

    def test_wrong_arguments(self):
        q, qd, qdd = self.one
        call = self.robot.inverse_dynamics
        with self.expect(TypeError, "`q`, `qd`, `qdd`", "`qdd` missing"):
            call(q, qd)
        with self.expect(TypeError, "`qd` missing"):
            call(q, qdd=qdd)
        with self.expect(TypeError, "4 are given"):
            call(q, qd, qdd, q)
        with self.expect(TypeError, "`q` is given by position and by name"):
            call(q, qd, qdd, q=q)
        with self.expect(TypeError, "no input `qddd`", "did you mean"):
            call(q, qd, qddd=qdd)

    def test_wrong_threads(self):
        for threads, kind in [(0, ValueError), (-1, ValueError), (1025, ValueError), (1.5, TypeError), ("two", TypeError), (True, TypeError)]:
            with self.expect(kind, "`threads`"):
                self.robot.inverse_dynamics(*self.many, threads=threads)

    def test_wrong_out(self):
        call = self.robot.inverse_dynamics
        with self.expect(ValueError, "`tau`", "(7,)", "(5, 7)"):
            call(*self.many, out=np.zeros(7))
        with self.expect(TypeError, "`tau`", "float32", "float64"):
            call(*self.many, out=np.zeros((5, 7), dtype=np.float32))
        with self.expect(TypeError, "`tau`", "list"):
            call(*self.many, out=([0.0] * 7,))
        with self.expect(ValueError, "`out` has 1", "`dtau_dq`, `dtau_dqd`, `h`, `tau`"):
            self.robot.inverse_dynamics_derivatives(*self.many, out=np.zeros((5, 7)))
        out = np.zeros((5, 7))
        out.flags.writeable = False
        with self.expect(ValueError, "`tau`", "read-only"):
            call(*self.many, out=out)

    def test_out_overlaps_nothing(self):
        call = self.robot.inverse_dynamics
        q, qd, qdd = self.many
        with self.expect(ValueError, "`tau`", "overlaps"):
            call(q, qd, qdd, out=q)
        one = q[0].copy()
        with self.expect(ValueError, "`tau`", "overlaps"):
            call(qd[0], one, qdd[0], out=one)
        line = np.zeros(20)
        with self.expect(ValueError, "`tau`", "overlaps"):
            call(line[:7], one, one, out=line[6:13])
        np.testing.assert_array_equal(call(line[:7], one, one, out=line[7:14]), call(np.zeros(7), one, one))
        both = np.zeros((10, 7))
        both[:5] = q
        with self.expect(ValueError, "`tau`", "overlaps"):
            call(both[:5], qd, qdd, out=both[3:8])
        np.testing.assert_array_equal(call(both[:5], qd, qdd, out=both[5:]), call(q, qd, qdd))
        matrix = np.zeros((5, 7, 7))
        out = (matrix, np.zeros((5, 7, 7)), matrix, np.zeros((5, 7)))
        with self.expect(ValueError, "`h`", "overlaps"):
            self.robot.inverse_dynamics_derivatives(q, qd, qdd, out=out)
        # nothing stays locked
        call(q, qd, qdd, out=matrix[:, 0])


if __name__ == "__main__":
    unittest.main()

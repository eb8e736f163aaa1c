"""Values against closed forms and against the reference data of the repository."""

import unittest

import numpy as np
import straightline as sl
from helpers import MOVING, PENDULUM, ROBOTS, numbers, panda, reference, states


class Pendulum(unittest.TestCase):
    def setUp(self):
        self.robot = sl.load(PENDULUM)

    def test_torques_are_those_of_the_closed_form(self):
        mass, length, inertia, gravity = 2.0, 0.5, 0.3, 9.81
        for q, qd, qdd in [(0.3, 0.5, -0.7), (-2.0, 3.0, 1.1), (0.0, 0.0, 0.0)]:
            expected = (inertia + mass * length**2) * qdd + mass * gravity * length * np.sin(q)
            found = self.robot.inverse_dynamics([q], [qd], [qdd])
            # a few roundings of the greatest term
            np.testing.assert_allclose(found, [expected], rtol=0, atol=1e-14)

    def test_forward_dynamics_is_the_inverse_of_inverse_dynamics(self):
        qdd = self.robot.forward_dynamics([0.4], [1.0], self.robot.inverse_dynamics([0.4], [1.0], [0.8]))
        np.testing.assert_allclose(qdd, [0.8], rtol=1e-14)

    def test_gravity_is_an_option(self):
        moon = sl.load(PENDULUM, gravity=(0, 0, -1.62))
        np.testing.assert_allclose(moon.gravity_force([0.5]), [1.62 * np.sin(0.5)], rtol=1e-14)

    def test_single_precision_is_near_double_precision(self):
        single = sl.load(PENDULUM, dtype=np.float32)
        found = single.inverse_dynamics([0.3], [0.5], [-0.7])
        self.assertEqual(found.dtype, np.float32)
        np.testing.assert_allclose(found, self.robot.inverse_dynamics([0.3], [0.5], [-0.7]), rtol=1e-5)


class Reference(unittest.TestCase):
    def test_the_panda_agrees_with_the_reference(self):
        robot = panda()
        for state in reference("panda")["states"]:
            if "gravity" in state or state["kind"].startswith("far_angle"):
                continue
            q, qd, qdd = (numbers(state[name]) for name in ("q", "qd", "qdd"))
            # roundings of the sums of moduli of terms
            error = np.abs(robot.inverse_dynamics(q, qd, qdd) - numbers(state["tau"])) / numbers(state["scale"]["tau"])
            self.assertLess(error.max(), 2e-15, state["id"])
            if "H" in state:
                expected = numbers(state["H"])
                scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
                self.assertLess((np.abs(robot.mass_matrix(q) - expected) / scale).max(), 4e-15, state["id"])
            if "frames" in state:
                frame = state["frames"]["panda_hand_tcp"]
                pose = robot.forward_kinematics(q)[0]
                np.testing.assert_allclose(pose[:3], numbers(frame["p"]), rtol=0, atol=4e-15)
                np.testing.assert_allclose(pose[3:].reshape(3, 3), numbers(frame["R"]), rtol=0, atol=4e-15)

    def test_a_floating_base_has_a_quaternion(self):
        robot = sl.load(MOVING, floating_base=True)
        self.assertEqual((robot.nq, robot.nv), (7, 6))
        tau = robot.inverse_dynamics([0, 0, 0, 0, 0, 0, 1], np.zeros(6), np.zeros(6))
        np.testing.assert_allclose(tau[:3], [0, 0, 3 * 9.81], rtol=0, atol=1e-14)

    def test_a_scene_holds_joints(self):
        scene = ROBOTS.parent / "scenes" / "panda_locked_wrist.toml"
        robot = sl.load(ROBOTS / "panda.urdf", scene=scene)
        self.assertLess(robot.nq, 7)
        text = sl.load(ROBOTS / "panda.urdf", scene=scene.read_text(encoding="utf-8"))
        q = states(robot)[0]
        np.testing.assert_array_equal(robot.gravity_force(q), text.gravity_force(q))

    def test_certified_bounds_hold(self):
        robot = panda()
        bound = robot.error_bound["gravity_force"]
        self.assertEqual(bound.shape, (7,))
        self.assertTrue((bound > 0).sum() >= 5 and (bound < 1e-11).all(), bound)
        for state in reference("panda")["states"]:
            if "gravity" in state or state["kind"] != "random":
                continue
            found = robot.gravity_force(numbers(state["q"]))
            self.assertTrue((np.abs(found - numbers(state["g"])) <= bound + 1e-15).all(), state["id"])


if __name__ == "__main__":
    unittest.main()

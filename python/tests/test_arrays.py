"""Shapes, strides, types, `out`, threads: what arrays functions take and give."""

import unittest

import numpy as np
import straightline as sl
from helpers import PENDULUM, panda, states


class Shapes(unittest.TestCase):
    def test_results_have_the_axes_of_their_ports_behind_those_of_states(self):
        robot = panda()
        for lead in [(), (1,), (5,), (3, 4), (0,)]:
            q = np.zeros((*lead, 7))
            self.assertEqual(robot.mass_matrix(q).shape, (*lead, 7, 7))
            self.assertEqual(robot.gravity_force(q).shape, (*lead, 7))
            self.assertEqual(robot.jacobian(q).shape, (*lead, 1, 6, 7))

    def test_each_state_of_many_has_the_bits_that_it_has_alone(self):
        robot = panda()
        for count in (1, 2, 7, 16, 17, 33):
            q, qd, qdd = states(robot, count)
            together = robot.inverse_dynamics(q, qd, qdd)
            alone = np.array([robot.inverse_dynamics(*state) for state in zip(q, qd, qdd)])
            np.testing.assert_array_equal(together, alone)

    def test_several_results_are_a_tuple_with_names(self):
        robot = panda()
        q, qd, qdd = states(robot, 3)
        found = robot.inverse_dynamics_derivatives(q, qd, qdd)
        self.assertEqual(found._fields, ("dtau_dq", "dtau_dqd", "h", "tau"))
        self.assertEqual([array.shape for array in found], [(3, 7, 7), (3, 7, 7), (3, 7, 7), (3, 7)])
        self.assertEqual(list(robot.inverse_dynamics_derivatives.outputs), list(found._fields))
        np.testing.assert_allclose(found.tau, robot.inverse_dynamics(q, qd, qdd), rtol=0, atol=1e-13)

    def test_one_state_goes_with_many(self):
        robot = panda()
        q, qd, qdd = states(robot, 20)
        expected = robot.inverse_dynamics(np.tile(q[0], (20, 1)), qd, np.tile(qdd[1], (20, 1)))
        np.testing.assert_array_equal(robot.inverse_dynamics(q[0], qd, qdd[1]), expected)
        np.testing.assert_array_equal(robot.inverse_dynamics(q[:1], qd, qdd[1]), expected)
        grid = robot.inverse_dynamics(q[:4, None], qd[None, :3], np.zeros(7))
        self.assertEqual(grid.shape, (4, 3, 7))
        np.testing.assert_array_equal(grid[2, 1], robot.inverse_dynamics(q[2], qd[1], np.zeros(7)))

    def test_numbers_and_lists_are_arrays(self):
        robot = panda()
        q = states(robot)[0]
        expected = robot.inverse_dynamics(q, np.zeros(7), np.zeros(7))
        np.testing.assert_array_equal(robot.inverse_dynamics(q.tolist(), 0, 0.0), expected)
        np.testing.assert_array_equal(robot.inverse_dynamics(tuple(q), [0] * 7, np.float32(0)), expected)
        pendulum = sl.load(PENDULUM)
        np.testing.assert_array_equal(pendulum.gravity_force(0.5), pendulum.gravity_force([0.5]))

    def test_inputs_have_names(self):
        robot = panda()
        q, qd, qdd = states(robot)
        expected = robot.inverse_dynamics(q, qd, qdd)
        np.testing.assert_array_equal(robot.inverse_dynamics(qdd=qdd, q=q, qd=qd), expected)
        np.testing.assert_array_equal(robot.inverse_dynamics(q, qdd=qdd, qd=qd), expected)

    def test_what_is_no_number_goes_through(self):
        robot = panda()
        q, qd, qdd = states(robot, 3)
        q[1, 3] = np.nan
        found = robot.inverse_dynamics(q, qd, qdd)
        self.assertTrue(np.isnan(found[1]).any())
        self.assertTrue(np.isfinite(found[[0, 2]]).all())
        self.assertTrue(np.isnan(robot.inverse_dynamics(q[1], qd[1], qdd[1])).any())


class Strides(unittest.TestCase):
    def test_strides_do_not_matter(self):
        robot = panda()
        q, qd, qdd = states(robot, 24)
        expected = robot.inverse_dynamics(q, qd, qdd)
        wide = np.zeros((48, 14))
        wide[::2, ::2] = q
        unaligned = np.frombuffer(bytearray(q.nbytes + 1), dtype=np.uint8)[1:].view(np.float64).reshape(24, 7)
        unaligned[...] = q
        read_only = q.copy()
        read_only.flags.writeable = False
        forms = {
            "Fortran": np.asfortranarray(q),
            "negative": q[::-1].copy()[::-1],
            "both negative": q[::-1, ::-1].copy()[::-1, ::-1],
            "gaps": wide[::2, ::2],
            "unaligned": unaligned,
            "other byte order": q.astype(">f8"),
            "read-only": read_only,
            "a view of a transposed copy": q.T.copy().T,
        }
        for name, form in forms.items():
            with self.subTest(name):
                np.testing.assert_array_equal(form, q)
                np.testing.assert_array_equal(robot.inverse_dynamics(form, qd, qdd), expected)
                np.testing.assert_array_equal(robot.inverse_dynamics(form, qd, qdd, threads=2), expected)
                np.testing.assert_array_equal(robot.inverse_dynamics(form[5], qd[5], qdd[5]), expected[5])

    def test_matrices_are_read_by_rows(self):
        robot = panda()
        q = states(robot, 4)[0]
        wrench = np.random.default_rng(3).uniform(-1, 1, (4, 1, 6))
        function = robot.jacobian_hessian_product
        self.assertEqual(function.inputs["wrench"], (1, 6))
        expected = function(q, wrench)
        for found in (function(q, np.asfortranarray(wrench)), function(q, wrench[:, :, ::-1].copy()[:, :, ::-1])):
            for one, other in zip(found, expected):
                np.testing.assert_array_equal(one, other)


class Types(unittest.TestCase):
    def test_numbers_keep_the_type_of_the_robot(self):
        for dtype, other in [(np.float32, np.float64), (np.float64, np.float32)]:
            robot = panda(dtype)
            q, qd, qdd = states(robot, 3)
            self.assertEqual(robot.dtype, dtype)
            self.assertEqual(robot.inverse_dynamics(q, qd, qdd).dtype, dtype)
            self.assertEqual(robot.inverse_dynamics(q.astype(other), qd, qdd).dtype, dtype)
            self.assertEqual(robot.gravity_force(np.zeros(7, dtype=int)).dtype, dtype)


class Out(unittest.TestCase):
    def test_results_are_written_where_the_caller_says(self):
        robot = panda()
        for count in (None, 1, 40):
            q, qd, qdd = states(robot, count)
            expected = robot.inverse_dynamics(q, qd, qdd)
            for out in (np.empty_like(expected), np.asfortranarray(expected * 0), np.zeros((*expected.shape, 2))[..., 1]):
                self.assertIs(robot.inverse_dynamics(q, qd, qdd, out=out), out)
                np.testing.assert_array_equal(out, expected)

    def test_several_results_are_written_too(self):
        robot = panda()
        q, qd, qdd = states(robot, 5)
        expected = robot.inverse_dynamics_derivatives(q, qd, qdd)
        out = tuple(np.empty_like(array) for array in expected)
        found = robot.inverse_dynamics_derivatives(q, qd, qdd, out=out)
        for one, other, array in zip(found, expected, out):
            self.assertIs(one, array)
            np.testing.assert_array_equal(one, other)


class Threads(unittest.TestCase):
    def test_threads_give_the_bits_of_one(self):
        for dtype in (np.float64, np.float32):
            robot = panda(dtype)
            for count in (1, 15, 16, 31, 1000):
                q, qd, qdd = states(robot, count)
                expected = robot.inverse_dynamics(q, qd, qdd)
                for threads in (1, 2, 3, 64):
                    np.testing.assert_array_equal(robot.inverse_dynamics(q, qd, qdd, threads=threads), expected)
                    np.testing.assert_array_equal(
                        robot.inverse_dynamics(q[0], qd, np.asfortranarray(qdd), threads=threads),
                        robot.inverse_dynamics(q[0], qd, qdd),
                    )


if __name__ == "__main__":
    unittest.main()

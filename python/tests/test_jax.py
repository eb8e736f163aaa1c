"""Functions as differentiable functions of JAX, where it is installed."""

import pickle
import unittest

import numpy as np
import straightline as sl
from helpers import hanging, panda, states

try:
    import jax
    import jax.numpy as jnp
    from jax.test_util import check_grads
except ImportError:
    raise unittest.SkipTest("JAX is not installed") from None

from straightline.jax import differentiable


class Jax(unittest.TestCase):
    def setUp(self):
        before = jax.config.jax_enable_x64
        jax.config.update("jax_enable_x64", True)
        self.addCleanup(jax.config.update, "jax_enable_x64", before)


def arrays(robot, count=None, seed=7):
    """Random q, qd, qdd."""
    return [jnp.asarray(x) for x in states(robot, count, seed)]


def unit(q):
    """The configuration of `hanging`, its quaternion divided by its length."""
    q = jnp.asarray(q)
    return q.at[..., 1:5].divide(jnp.linalg.norm(q[..., 1:5], axis=-1, keepdims=True))


class Derivatives(Jax):
    def test_values_have_the_bits_of_the_robot(self):
        for dtype in (np.float64, np.float32):
            robot = panda(dtype)
            given = arrays(robot, 5)
            function = differentiable(robot).inverse_dynamics
            for call in (function, jax.jit(function), jax.vmap(function), jax.jit(jax.vmap(function))):
                found = call(*given)
                self.assertEqual(found.dtype, dtype)
                np.testing.assert_array_equal(found, robot.inverse_dynamics(*map(np.asarray, given)))

    def test_jacobians_are_those_of_derivative_functions(self):
        for dtype, tolerance in ((np.float64, 1e-14), (np.float32, 1e-6)):
            robot = panda(dtype)
            given = arrays(robot)
            expected = robot.inverse_dynamics_derivatives(*map(np.asarray, given))
            function = differentiable(robot).inverse_dynamics
            for way in (jax.jacrev, jax.jacfwd):
                of_all = way(function, (0, 1, 2))
                for found in (of_all(*given), jax.jit(of_all)(*given)):
                    for one, matrix in zip(found, expected):
                        np.testing.assert_allclose(one, matrix, rtol=0, atol=tolerance * np.abs(matrix).max())

    def test_gradients_are_those_of_differences(self):
        robot = differentiable(panda())
        q, qd, qdd = arrays(panda(), 2)
        # one velocity of all states: its gradient is the sum of theirs
        for name, given in [
            ("inverse_dynamics", (q, qd[0], qdd)),
            ("forward_dynamics", (q, qd, qdd[1])),
            ("forward_kinematics", (q,)),
            ("jacobian", (q,)),
            ("mass_matrix", (q,)),
        ]:
            with self.subTest(name):
                check_grads(getattr(robot, name), given, order=1)
        dt = jnp.array([0.01])
        check_grads(lambda *x: tuple(robot.semi_implicit_step(*x, dt)), (q, qd, qdd), order=1)

    def test_gradients_follow_quaternions(self):
        robot = differentiable(hanging())
        q, qd, qdd = arrays(hanging(), 2)
        check_grads(lambda q, *others: robot.inverse_dynamics(unit(q), *others), (q, qd, qdd), order=1)
        check_grads(lambda q, v: robot.integrate(unit(q), v), (q, qd), order=1)

    def test_derivatives_of_many_states(self):
        robot = panda()
        function = differentiable(robot).inverse_dynamics
        given = arrays(robot, 4)
        expected = robot.inverse_dynamics_derivatives(*map(np.asarray, given)).dtau_dq
        for call in (jax.vmap(jax.jacfwd(function)), jax.jit(jax.vmap(jax.jacrev(function)))):
            np.testing.assert_allclose(call(*given), expected, rtol=0, atol=1e-12)
        # one q, and four states of the rest each
        found = jax.vmap(function, (0, None, None))(given[0], given[1][0], given[2])
        for k in range(4):
            np.testing.assert_array_equal(found[k], function(given[0][k], given[1][0], given[2]))

    def test_a_motion_is_differentiated_through_all_its_steps(self):
        step, dt = differentiable(panda()).semi_implicit_step, jnp.array([0.01])
        q, qd, tau = arrays(panda())

        def end(q, qd, tau):
            def body(state, _):
                return tuple(step(*state, tau, dt)), None

            return jax.lax.scan(body, (q, qd), None, length=10)[0][0]

        check_grads(jax.jit(end), (q, qd, tau), order=1)

    def test_what_is_not_differentiated_is_said(self):
        robot = differentiable(panda())
        q, qd, tau = arrays(panda())
        with self.assertRaisesRegex(NotImplementedError, "`energy` has no derivative function"):
            jax.grad(lambda q: robot.energy(q, qd).sum())(q)
        # what is held needs no derivative
        held = jax.grad(lambda q: robot.energy(jax.lax.stop_gradient(q), qd).sum() + q.sum())(q)
        np.testing.assert_array_equal(held, np.ones(7))
        with self.assertRaisesRegex(NotImplementedError, "second derivatives of `inverse_dynamics`"):
            jax.hessian(lambda q: robot.inverse_dynamics(q, qd, tau).sum())(q)
        with self.assertRaisesRegex(NotImplementedError, "`semi_implicit_step` has no derivative by `dt`"):
            jax.grad(lambda dt: robot.semi_implicit_step(q, qd, tau, dt).q_next.sum())(jnp.array([0.01]))


class Calls(Jax):
    def test_inputs_by_name_and_several_results(self):
        robot = differentiable(panda(), threads=2)
        q, qd, qdd = arrays(panda(), 100)
        expected = robot.inverse_dynamics(q, qd, qdd)
        np.testing.assert_array_equal(robot.inverse_dynamics(q, qdd=qdd, qd=np.asarray(qd)), expected)
        found = jax.jit(robot.inverse_dynamics_derivatives)(q, qd, qdd)
        self.assertEqual(found._fields, ("dtau_dq", "dtau_dqd", "h", "tau"))
        self.assertEqual(found.h.shape, (100, 7, 7))
        self.assertEqual(robot.inverse_dynamics(q[:0], qd[0], qdd[0]).shape, (0, 7))

    def test_it_is_made_once_and_pickled(self):
        robot = differentiable(panda())
        self.assertIs(differentiable(panda()), robot)
        (q,) = arrays(panda())[:1]
        again = pickle.loads(pickle.dumps(robot))
        np.testing.assert_array_equal(again.gravity_force(q), robot.gravity_force(q))
        self.assertIn("configuration", robot.inverse_dynamics.__doc__)

    def test_wrong_inputs(self):
        robot = differentiable(panda())
        q, qd, qdd = arrays(panda(), 3)
        for error, words, given in [
            (TypeError, "`qd` of inverse_dynamics is a list; an array", (q, [0.0] * 7, qdd)),
            (TypeError, "`q` of inverse_dynamics has dtype float32; float64", (q.astype("float32"), qd, qdd)),
            (ValueError, r"`qd` has shape \(3, 6\); \(7,\) is expected", (q, qd[:, :6], qdd)),
            (ValueError, r"different numbers of states: `q` \(3, 7\), `qd` \(2, 7\)", (q, qd[:2], qdd)),
            (TypeError, "`qdd` missing", (q, qd)),
        ]:
            with self.assertRaisesRegex(error, words):
                robot.inverse_dynamics(*given)
        with self.assertRaisesRegex(AttributeError, "did you mean `inverse_dynamics`"):
            robot.inverse_dynamic

    def test_single_precision_of_jax_is_no_double_precision(self):
        jax.config.update("jax_enable_x64", False)
        with self.assertRaisesRegex(TypeError, "jax_enable_x64"):
            differentiable(panda()).gravity_force(np.zeros(7))
        self.assertEqual(differentiable(panda(np.float32)).gravity_force(jnp.zeros(7)).dtype, np.float32)


if __name__ == "__main__":
    unittest.main()

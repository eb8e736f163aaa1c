"""Functions as differentiable functions of PyTorch, where it is installed."""

import copy
import pickle
import unittest

import numpy as np
import straightline as sl
from helpers import hanging, panda, states

try:
    import torch
except ImportError:
    raise unittest.SkipTest("PyTorch is not installed") from None
if not hasattr(torch.library, "register_vmap"):
    raise unittest.SkipTest(f"PyTorch is {torch.__version__}; 2.5 is needed")

from straightline.torch import differentiable


def tensors(robot, count=None, seed=7):
    """Random q, qd, qdd whose gradients are wanted."""
    found = [torch.from_numpy(x).requires_grad_() for x in states(robot, count, seed)]
    return found


def with_unit_quaternions(function):
    """The function of `hanging`, whose quaternion is divided by its length before."""

    def call(q, *others):
        quaternion = q[..., 1:5] / q[..., 1:5].norm(dim=-1, keepdim=True)
        return function(torch.cat([q[..., :1], quaternion, q[..., 5:]], dim=-1), *others)

    return call


class Gradients(unittest.TestCase):
    def test_values_have_the_bits_of_the_robot(self):
        for dtype in (np.float64, np.float32):
            robot = panda(dtype)
            given = tensors(robot, 5)
            arrays = [x.detach().numpy() for x in given]
            for name in ("inverse_dynamics", "forward_dynamics", "energy"):
                function = getattr(differentiable(robot), name)
                n = len(function.inputs)
                expected = getattr(robot, name)(*arrays[:n])
                np.testing.assert_array_equal(function(*given[:n]).detach().numpy(), expected)
                self.assertEqual(function(*given[:n]).dtype, given[0].dtype)

    def test_gradcheck_passes(self):
        robot = differentiable(panda())
        q, qd, qdd = tensors(panda(), 2)
        one = qd[0].detach().requires_grad_()
        self.assertTrue(torch.autograd.gradcheck(robot.inverse_dynamics, (q, qd, qdd)))
        # one velocity of all states: its gradient is the sum of theirs
        self.assertTrue(torch.autograd.gradcheck(robot.forward_dynamics, (q, one, qdd)))
        for name in ("forward_kinematics", "mass_matrix", "jacobian"):
            self.assertTrue(torch.autograd.gradcheck(getattr(robot, name), (q,)))
        dt = torch.tensor([0.01], dtype=torch.float64)
        self.assertTrue(torch.autograd.gradcheck(lambda *x: tuple(robot.semi_implicit_step(*x, dt)), (q, qd, qdd)))

    def test_gradcheck_passes_along_quaternions(self):
        robot = differentiable(hanging())
        q, qd, qdd = tensors(hanging(), 2)
        for name, given in (("inverse_dynamics", (q, qd, qdd)), ("mass_matrix", (q,)), ("integrate", (q, qd))):
            self.assertTrue(torch.autograd.gradcheck(with_unit_quaternions(getattr(robot, name)), given), name)

    def test_gradients_are_those_of_derivative_functions(self):
        for dtype, tolerance in ((np.float64, 1e-12), (np.float32, 1e-5)):
            robot = panda(dtype)
            q, qd, qdd = tensors(robot)
            expected = robot.inverse_dynamics_derivatives(*(x.detach().numpy() for x in (q, qd, qdd)))
            function, jacobian = differentiable(robot).inverse_dynamics, torch.autograd.functional.jacobian
            # row by row, and all rows in one call
            rows = jacobian(function, (q, qd, qdd)) + jacobian(function, (q, qd, qdd), vectorize=True)
            for found, matrix in zip(rows, expected[:3] * 2):
                np.testing.assert_allclose(found.numpy(), matrix, rtol=0, atol=tolerance * np.abs(matrix).max())

    def test_second_derivatives_of_dynamics(self):
        robot = differentiable(panda())
        given = tensors(panda())
        self.assertTrue(torch.autograd.gradgradcheck(robot.inverse_dynamics, given))
        self.assertTrue(torch.autograd.gradgradcheck(robot.forward_dynamics, given))

    def test_what_is_not_differentiated_is_said(self):
        robot = differentiable(panda())
        q, qd, tau = tensors(panda())
        energy = robot.energy(q, qd)
        with self.assertRaisesRegex(NotImplementedError, "`energy` has no derivative function"):
            energy.sum().backward()
        (gradient,) = torch.autograd.grad(robot.gravity_force(q).sum(), q, create_graph=True)
        with self.assertRaisesRegex(NotImplementedError, "second derivatives of `gravity_force`"):
            gradient.sum().backward()
        dt = torch.tensor([0.01], dtype=torch.float64, requires_grad=True)
        with self.assertRaisesRegex(NotImplementedError, "`semi_implicit_step` has no derivative by `dt`"):
            robot.semi_implicit_step(q, qd, tau, dt).q_next.sum().backward()
        with self.assertRaisesRegex(NotImplementedError, "coordinates of quaternions"):
            moving = differentiable(hanging())
            given = tensors(hanging())
            (gradient,) = torch.autograd.grad(moving.inverse_dynamics(*given).sum(), given[:1], create_graph=True)
            gradient.sum().backward()


class Calls(unittest.TestCase):
    def test_operators_are_as_torch_wants_them(self):
        given = tensors(panda(), 3)
        torch.library.opcheck(differentiable(panda()).inverse_dynamics._operator, given)
        step = differentiable(panda()).semi_implicit_step
        torch.library.opcheck(step._operator, (*given, torch.tensor([0.01], dtype=torch.float64)))

    def test_vmap_makes_one_call(self):
        function = differentiable(panda()).inverse_dynamics
        q, qd, qdd = (x.detach() for x in tensors(panda(), 4))
        torch.testing.assert_close(torch.func.vmap(function)(q, qd, qdd), function(q, qd, qdd), rtol=0, atol=0)
        # one q, and four states of the rest each
        found = torch.func.vmap(function, (0, None, None))(q, qd[0], qdd)
        torch.testing.assert_close(found[2], function(q[2], qd[0], qdd), rtol=0, atol=0)
        found = torch.func.vmap(function, (1, None, 0), 1)(q.T, qd[1], qdd)
        torch.testing.assert_close(found, function(q, qd[1], qdd).T, rtol=0, atol=0)

    def test_compiled_functions_have_the_same_gradients(self):
        function = differentiable(panda()).inverse_dynamics
        q, qd, qdd = tensors(panda(), 4)
        given = (q, qd[1].detach().requires_grad_(), qdd)

        def loss(*x):
            return function(*x).square().sum()

        compiled = torch.compile(loss, backend="aot_eager", fullgraph=True)
        expected = torch.autograd.grad(loss(*given), given)
        for found, gradient in zip(torch.autograd.grad(compiled(*given), given), expected):
            torch.testing.assert_close(found, gradient, rtol=0, atol=0)

    def test_inputs_by_name_and_several_results(self):
        robot = differentiable(panda(), threads=2)
        q, qd, qdd = tensors(panda(), 100)
        torch.testing.assert_close(
            robot.inverse_dynamics(q, qdd=qdd, qd=qd), robot.inverse_dynamics(q, qd, qdd), rtol=0, atol=0
        )
        found = robot.inverse_dynamics_derivatives(q, qd, qdd)
        self.assertEqual(found._fields, ("dtau_dq", "dtau_dqd", "h", "tau"))
        self.assertEqual(found.h.shape, (100, 7, 7))

    def test_no_state_is_a_batch(self):
        q = torch.zeros(0, 7, dtype=torch.float64, requires_grad=True)
        differentiable(panda()).gravity_force(q).sum().backward()
        self.assertEqual(q.grad.shape, (0, 7))

    def test_it_is_made_once_and_pickled(self):
        robot = differentiable(panda())
        self.assertIs(differentiable(panda()), robot)
        self.assertIs(copy.deepcopy(robot), robot)
        again = pickle.loads(pickle.dumps(robot))
        (q,) = tensors(panda())[:1]
        torch.testing.assert_close(again.gravity_force(q), robot.gravity_force(q), rtol=0, atol=0)
        self.assertIn("inverse_dynamics", dir(robot))
        self.assertIn("configuration", robot.inverse_dynamics.__doc__)

    def test_wrong_inputs(self):
        robot = differentiable(panda())
        q, qd, qdd = (x.detach() for x in tensors(panda(), 3))
        for error, words, given in [
            (TypeError, "`qd` of inverse_dynamics is a list; a tensor", (q, [0.0] * 7, qdd)),
            (TypeError, "`q` of inverse_dynamics has dtype torch.float32; torch.float64", (q.float(), qd, qdd)),
            (ValueError, r"`qd` has shape \(3, 6\); \(7,\) is expected", (q, qd[:, :6], qdd)),
            (ValueError, r"different numbers of states: `q` \(3, 7\), `qd` \(2, 7\)", (q, qd[:2], qdd)),
            (TypeError, "`qdd` missing", (q, qd)),
            (TypeError, "4 are given", (q, qd, qdd, qdd)),
        ]:
            with self.assertRaisesRegex(error, words):
                robot.inverse_dynamics(*given)
        with self.assertRaisesRegex(TypeError, "no input `velocity`"):
            robot.inverse_dynamics(q, velocity=qd)
        with self.assertRaisesRegex(AttributeError, "did you mean `inverse_dynamics`"):
            robot.inverse_dynamic
        with self.assertRaisesRegex(AttributeError, "`nq` is no function"):
            robot.nq
        with self.assertRaisesRegex(TypeError, "`robot` is a str"):
            differentiable("panda.urdf")


if __name__ == "__main__":
    unittest.main()

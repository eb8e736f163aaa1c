"""What torch and JAX differentiate by: derivative functions beside differences, coordinates beside tangents, and what is refused."""

import functools
import unittest

import numpy as np
import straightline as sl
from helpers import PENDULUM, ROBOTS, ROOT, hanging, panda
from straightline import _derivatives as derivatives
from straightline._derivatives import CONFIGURATIONS, DIFFERENTIABLE, Coordinates, FunctionMap, NotDifferentiable

STEP = 1e-5
# of differences with this step, over the greatest entry: their own error, which is of the third derivatives times its square
TOLERANCE = 3e-8
SCENES = ROBOTS.parent / "scenes"


@functools.lru_cache(maxsize=None)
def arm():
    return sl.load(ROBOTS / "ur5.urdf", optimise="quick", allow=["warnings"])


def robots():
    scene = SCENES / "planar_2r_drives.toml"
    drives = sl.load(ROBOTS / "planar_2r.toml", scene=scene, optimise="quick", allow=["warnings"])
    return [arm(), hanging(), hanging(floating_base=True), drives]


def normalised(robot, q):
    q = q.copy()
    for iq, _ in Coordinates(robot).quaternions:
        q[..., iq : iq + 4] /= np.linalg.norm(q[..., iq : iq + 4], axis=-1, keepdims=True)
    return q


def inputs(robot, ports, seed, count=None):
    """Random inputs by their names; quaternions have length one."""
    random = np.random.default_rng(seed)
    lead = () if count is None else (count,)
    given = {name: random.uniform(-1, 1, (*lead, *shape)) for name, shape in ports.items()}
    given = {name: normalised(robot, x) if name in CONFIGURATIONS else x for name, x in given.items()}
    return {name: np.full_like(x, 0.01) if name == "dt" else x for name, x in given.items()}


def differences(robot, call, given, name):
    """Derivatives of all results by one input; quaternions are normalised before the call."""
    found = []
    for k in range(given[name].size):
        sides = []
        for step in (STEP, -STEP):
            moved = given[name].flatten()
            moved[k] += step
            moved = moved.reshape(given[name].shape)
            moved = normalised(robot, moved) if name in CONFIGURATIONS else moved
            sides.append(call(*{**given, name: moved}.values()))
        found.append([(ahead - behind) / (2 * STEP) for ahead, behind in zip(*sides)])
    return [np.stack(columns, axis=-1) for columns in zip(*found)]


class Matrices(unittest.TestCase):
    def assertNear(self, found, expected, given, tolerance=TOLERANCE):
        error = np.abs(found - expected).max() / max(1.0, np.abs(expected).max())
        self.assertLess(error, tolerance, f"at {given!r}")

    def test_they_are_those_of_differences(self):
        for robot in robots():
            for name in set(DIFFERENTIABLE) & set(robot.functions):
                function = FunctionMap(robot, name)
                given = inputs(robot, function.inputs, seed=len(name))
                matrices = function.matrices()
                found = dict(zip(matrices.outputs, matrices.call(*given.values())))
                for variable in given:
                    expected = dict(zip(function.outputs, differences(robot, function.call, given, variable)))
                    for output in function.outputs:
                        if variable != "dt":
                            with self.subTest(f"{robot.name}, nq = {robot.nq}: {output} of {name} by {variable}"):
                                self.assertNear(found[output, variable], expected[output], given)

    def test_of_many_states_they_are_those_of_each(self):
        for robot in (hanging(), hanging(floating_base=True)):
            for name in ("inverse_dynamics", "forward_kinematics", "mass_matrix", "semi_implicit_step"):
                matrices = FunctionMap(robot, name).matrices()
                given = inputs(robot, matrices.inputs, seed=1, count=4)
                # one velocity of all of them
                given = {port: x[0] if port == "qd" else x for port, x in given.items()}
                together = matrices.call(*given.values())
                for k in range(4):
                    alone = matrices.call(*(x if port == "qd" else x[k] for port, x in given.items()))
                    for one, many in zip(alone, together):
                        np.testing.assert_allclose(many[k], one, rtol=0, atol=1e-13 * max(1, np.abs(one).max()))

    def test_products_are_multipliers_times_matrices(self):
        for robot in (panda(), hanging(), hanging(floating_base=True)):
            for name in derivatives.BY_PRODUCTS:
                function = FunctionMap(robot, name)
                products, matrices = function.pullback(), function.matrices()
                given = inputs(robot, products.inputs, seed=5, count=3)
                found = dict(zip(products.outputs, products.call(*given.values())))
                multiplier = given.pop("multiplier")
                for (_, variable), matrix in zip(matrices.outputs, matrices.call(*given.values())):
                    expected = (multiplier[:, None, :] @ matrix)[:, 0]
                    self.assertNear(found[variable], expected, given, tolerance=1e-11)

    def test_second_derivatives_are_those_of_differences(self):
        for name in derivatives.BY_PRODUCTS:
            first = FunctionMap(arm(), name).pullback()
            second = first.pullback()
            given = inputs(arm(), second.inputs, seed=6)
            found = dict(zip(second.outputs, second.call(*given.values())))
            own = {port: given[port] for port in first.inputs}
            multipliers = [given[f"multiplier_{port}"] for port in first.outputs]
            for variable in own:
                by_variable = differences(arm(), first.call, own, variable)
                expected = sum(multiplier @ matrix for multiplier, matrix in zip(multipliers, by_variable))
                self.assertNear(found[variable], expected, given)

    def test_coordinates_follow_the_tangent_and_back(self):
        robot = hanging(floating_base=True)
        coordinates = Coordinates(robot)
        q = inputs(robot, {"q": (robot.nq,)}, seed=2, count=5)["q"]
        unit = np.broadcast_to(np.eye(robot.nv), (5, robot.nv, robot.nv))
        np.testing.assert_allclose(coordinates.back(q) @ coordinates.along(q), unit, rtol=0, atol=1e-15)
        for k in range(robot.nv):
            ahead, behind = (robot.integrate(q, step * np.eye(robot.nv)[k]) for step in (STEP, -STEP))
            np.testing.assert_allclose(coordinates.along(q)[..., k], (ahead - behind) / (2 * STEP), rtol=0, atol=1e-9)


    def test_inputs_that_a_scene_adds_are_held(self):
        scene = '[hold]\ngravity = "input"\n[[parameter]]\nkind = "payload"\nname = "tool"\nframe = "tool0"\n'
        robot = sl.load(ROBOTS / "ur5.urdf", scene=scene, optimise="quick", allow=["warnings"])
        function = FunctionMap(robot, "inverse_dynamics")
        self.assertEqual(list(function.inputs), ["q", "qd", "qdd", "gravity", "tool"])
        given = inputs(robot, function.inputs, seed=8)
        products, matrices = function.pullback(), function.matrices()
        self.assertEqual(list(products.outputs), ["q", "qd", "qdd"])
        found = dict(zip(products.outputs, products.call(*given.values(), np.ones(6))))
        for (_, variable), matrix in zip(matrices.outputs, matrices.call(*given.values())):
            (expected,) = differences(robot, function.call, given, variable)
            self.assertNear(matrix, expected, given)
            self.assertNear(found[variable], matrix.sum(axis=0), given, tolerance=1e-11)
        function = FunctionMap(robot, "mass_matrix")
        given = {port: given[port] for port in function.inputs}
        self.assertEqual(list(given), ["q", "tool"])
        (expected,) = differences(robot, function.call, given, "q")
        self.assertNear(function.matrices().call(*given.values())[0], expected, given)


class Refusals(unittest.TestCase):
    def refused(self, robot, name, *words):
        with self.assertRaises(NotDifferentiable) as caught:
            FunctionMap(robot, name).pullback()
        for word in words:
            self.assertIn(word, str(caught.exception))

    def test_what_has_no_derivative_function_names_what_has_one(self):
        self.refused(panda(), "energy", "`energy` has no derivative function", "inverse_dynamics")
        self.refused(panda(), "torque_regressor", "`torque_regressor`")

    def test_scenes_that_change_matrices(self):
        by_columns = sl.load(PENDULUM, scene='[outputs]\nmatrices = "by columns"\n')
        self.refused(by_columns, "gravity_force", "by columns: leave `matrices` out")
        at_rest = sl.load(ROBOTS / "ur5.urdf", scene="[zero]\nqd = true\n", optimise="quick", allow=["warnings"])
        for name in ("mass_matrix", "inverse_dynamics"):
            self.refused(at_rest, name, "leave [zero] out")
        scene = '[outputs]\nforward_kinematics = { part = "linear" }\n'
        self.refused(sl.load(PENDULUM, scene=scene), "forward_kinematics", "poses")
        scene = '[outputs]\ninverse_dynamics_derivatives = { results = ["dtau_dq"] }\n'
        with self.assertRaisesRegex(NotDifferentiable, "by `qd` is left out"):
            FunctionMap(sl.load(PENDULUM, scene=scene), "inverse_dynamics").matrices()
        scene = '[outputs]\ninverse_dynamics = { joints = ["panda_joint2"] }\n'
        of_one = sl.load(ROBOTS / "panda.urdf", scene=scene, optimise="quick")
        self.refused(of_one, "inverse_dynamics", "by `q` has shape (7, 7)", "(1, 7) is needed")

    def test_second_derivatives_of_which_a_scene_leaves_a_part(self):
        scene = '[outputs]\ninverse_dynamics_hvp = { results = ["hvp_q"] }\n'
        first = FunctionMap(sl.load(PENDULUM, scene=scene), "inverse_dynamics").pullback()
        with self.assertRaisesRegex(NotDifferentiable, "all results of `inverse_dynamics_hvp`"):
            first.pullback()

    def test_closed_loops(self):
        loop = ROOT / "generated_tests" / "reference" / "joints" / "robots" / "loop_fourbar.xml"
        self.refused(sl.load(loop, allow=["warnings"]), "inverse_dynamics", "closed loops")

    def test_second_derivatives_by_quaternions(self):
        with self.assertRaisesRegex(NotDifferentiable, "quaternions"):
            FunctionMap(hanging(), "inverse_dynamics").pullback().pullback()

    def test_no_derivative_is_of_a_higher_order(self):
        for name, order in (("gravity_force", "second"), ("inverse_dynamics", "third")):
            pullback = FunctionMap(panda(), name).pullback()
            with self.assertRaisesRegex(NotDifferentiable, f"{order} derivatives of `{name}`"):
                (pullback if order == "second" else pullback.pullback()).pullback()


if __name__ == "__main__":
    unittest.main()

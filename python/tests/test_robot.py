"""What a robot says of itself: names, costs, documentation, pages, stubs."""

import ast
import copy
import inspect
import pathlib
import pydoc
import subprocess
import sys
import tempfile
import unittest
import warnings

import numpy as np
import straightline as sl
from helpers import PENDULUM, ROBOTS, panda, states
from straightline import _straightline


# an angle that is nearly a right one
DOUBTFUL = PENDULUM.replace('<origin xyz="0 0 -0.5"/>', '<origin xyz="0 0 -0.5" rpy="1.5708 0 0"/>')


class Robot(unittest.TestCase):
    def test_the_panda_is_known(self):
        robot = panda()
        self.assertEqual((robot.name, robot.nq, robot.nv, robot.dtype), ("panda", 7, 7, np.float64))
        self.assertEqual(robot.joint_names, tuple(f"panda_joint{k}" for k in range(1, 8)))
        self.assertEqual(robot.frames, ("panda_hand_tcp",))
        self.assertTrue(robot.execution)
        for part in ("'panda'", "7 joints", "float64", robot.execution):
            self.assertIn(part, repr(robot))

    def test_functions_are_listed(self):
        robot = panda()
        self.assertIn("inverse_dynamics_derivatives", robot.functions)
        self.assertNotIn("close_loops", robot.functions)
        self.assertLessEqual(set(robot.functions), set(dir(robot)))
        for name in robot.functions:
            self.assertIsInstance(getattr(robot, name), sl.Function)
        self.assertFalse(hasattr(robot, "close_loops"))

    def test_costs_are_counted(self):
        cost = panda().cost["inverse_dynamics"]
        self.assertEqual(cost, (cost.operations, cost.sincos))
        self.assertTrue(300 < cost.operations < 600 and cost.sincos == 6, cost)
        self.assertEqual(set(panda().cost), set(panda().functions))
        with self.assertRaises(KeyError):
            panda().cost["inverse"]

    def test_functions_are_compiled_when_they_are_wanted(self):
        robot = sl.load(PENDULUM, functions=["gravity_force"])
        self.assertIsNotNone(robot.gravity_force.known_cost)
        self.assertIsNone(robot.inverse_dynamics.known_cost)
        robot.inverse_dynamics(0, 0, 0)
        self.assertIsNotNone(robot.inverse_dynamics.known_cost)

    def test_functions_are_documented(self):
        doc = panda().inverse_dynamics.__doc__
        for part in ("qdd : (..., 7)", "tau : (..., 7)", "[rad/s² or m/s²]", "[N·m or N]", "RNEA", "out", "threads"):
            self.assertIn(part, doc)
        self.assertNotIn("\\", doc)
        self.assertIn("`frames`", panda().forward_kinematics.__doc__)
        self.assertEqual(inspect.getdoc(panda().inverse_dynamics).splitlines()[0], doc.splitlines()[0])
        self.assertEqual(str(inspect.signature(panda().inverse_dynamics)), "(q, qd, qdd, *, out=None, threads=1)")
        self.assertEqual(panda().inverse_dynamics.__name__, "inverse_dynamics")
        self.assertIn("inverse_dynamics", repr(panda().inverse_dynamics))
        page = pydoc.plain(pydoc.render_doc(panda().inverse_dynamics))
        self.assertIn("inverse_dynamics(q, qd, qdd, *, out=None, threads=1)", page)
        self.assertIn("tau : (..., 7)", page)

    def test_parameters_of_a_scene_are_inputs(self):
        robot = sl.load(ROBOTS / "panda.urdf", scene=ROBOTS.parent / "scenes" / "panda_payload.toml")
        function = robot.inverse_dynamics
        self.assertIn("workpiece", function.inputs)
        self.assertIn("workpiece : ", function.__doc__)
        q = states(robot)[0]
        loads = [robot.parameter("workpiece", mass=mass, com=[0, 0, 0.1], inertia=np.zeros(6)) for mass in (0.0, 2.0)]
        light, heavy = (function(q, 0, 0, workpiece=load) for load in loads)
        # by a weight where its centre of mass is
        pose = sl.load(ROBOTS / "panda.urdf", frames=["panda_hand_tcp"]).kinematics_and_jacobian(q)
        position, jacobian = pose[0][0], pose[1][0]
        arm = position[3:].reshape(3, 3) @ [0, 0, 0.1]
        weight = np.array([0, 0, 2 * 9.81])
        expected = jacobian.T @ np.concatenate([weight, np.cross(arm, weight)])
        np.testing.assert_allclose(heavy - light, expected, rtol=0, atol=1e-12)
        with self.assertRaisesRegex(TypeError, "`com`, which is missing"):
            robot.parameter("workpiece", mass=1.0, inertia=np.zeros(6))
        with self.assertRaisesRegex(ValueError, r"`com`.*\(2,\).*\(3,\)"):
            robot.parameter("workpiece", mass=1.0, com=[0, 0], inertia=np.zeros(6))
        with self.assertRaisesRegex(KeyError, "there is workpiece"):
            robot.parameter("gripper", mass=1.0)

    def test_rust_is_generated(self):
        text = sl.load(PENDULUM).rust(["gravity_force"])
        self.assertIn("pub fn gravity_force", text)
        self.assertNotIn("pub fn inverse_dynamics", text)
        named = sl.load(PENDULUM, functions=["mass_matrix"], self_test=True).rust()
        self.assertIn("pub fn mass_matrix", named)
        self.assertIn("self_test", named)

    def test_a_report_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "pendulum.html"
            sl.load(PENDULUM).report(path, functions=["gravity_force"])
            page = path.read_text(encoding="utf-8")
        self.assertTrue(page.startswith("<!DOCTYPE html>"))
        self.assertIn("gravity_force", page)

    def test_warnings_are_said(self):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            robot = sl.load(DOUBTFUL)
        self.assertEqual([warning.category for warning in said], [sl.RobotWarning])
        self.assertIn("warning", robot.warnings)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            sl.load(DOUBTFUL, allow=["warnings"])


    def test_what_is_doubtful_about_a_function_is_said_when_it_is_compiled(self):
        light = PENDULUM.replace('mass value="2"', 'mass value="0"')
        for entry in ('ixx="0.2"', 'iyy="0.3"', 'izz="0.15"'):
            light = light.replace(entry, entry[:5] + '0"')
        scene = "[[parameter]]\nkind = \"payload\"\nname = \"load\"\nframe = \"rod\"\n"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sl.RobotWarning)
            robot = sl.load(light, scene=scene)
        load = robot.parameter("load", mass=2.0, com=[0, 0, -0.5], inertia=[0.2, 0, 0, 0.3, 0, 0.15])
        with self.assertWarnsRegex(sl.RobotWarning, "`load`"):
            qdd = robot.forward_dynamics(0.0, 0.0, 0.8, load)
        np.testing.assert_allclose(qdd, [1.0], rtol=1e-14)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            robot.forward_dynamics(0.0, 0.0, 0.8, load)


class Hostile(unittest.TestCase):
    def test_names_are_escaped(self):
        name = "&lt;script&gt;alert(1)&lt;/script&gt;&amp;&quot;\u202e"
        robot = sl.load(PENDULUM.replace('"pendulum"', f'"{name}"').replace('"hinge"', f'"{name}"'))
        self.assertIn("<script>", robot.name)
        page = robot._repr_html_()
        self.assertNotIn("<script>", page)
        self.assertNotIn("\u202e", page)
        self.assertIn("&lt;script&gt;", page)
        robot.gravity_force(0.0)
        self.assertIn("not compiled yet", robot._repr_html_())


class Copies(unittest.TestCase):
    def test_copies_are_the_robot(self):
        robot = panda()
        self.assertIs(copy.copy(robot), robot)
        self.assertIs(copy.deepcopy(robot), robot)
        self.assertIs(copy.deepcopy(robot.inverse_dynamics), robot.inverse_dynamics)


class Stubs(unittest.TestCase):
    def test_stubs_agree_with_the_module(self):
        text = (pathlib.Path(sl.__file__).parent / "__init__.pyi").read_text(encoding="utf-8")
        body = ast.parse(text).body
        classes = {node.name: node for node in body if isinstance(node, ast.ClassDef)}
        load = next(node for node in body if isinstance(node, ast.FunctionDef) and node.name == "load")
        known = {argument.arg for argument in load.args.kwonlyargs}
        self.assertEqual(known, {"scene", "dtype", "cache"} | {name for name, _, _ in _straightline.option_table()})
        self.assertEqual({*classes, "load"}, set(sl.__all__))

        def members(name):
            nodes = classes[name].body
            named = {node.target.id for node in nodes if isinstance(node, ast.AnnAssign)}
            return named | {node.name for node in nodes if isinstance(node, ast.FunctionDef)}

        functions = {name for name, _, _, _ in _straightline.function_table()}
        self.assertLessEqual(functions, members("Robot"))
        public = {name for name in dir(panda()) if not name.startswith("_")}
        self.assertEqual(public | functions, {name for name in members("Robot") if not name.startswith("_")})
        of_function = {name for name in dir(sl.Function) if not name.startswith("_")}
        self.assertEqual(of_function, {name for name in members("Function") if not name.startswith("_")})

    def test_stubs_of_modules_agree_with_them(self):
        for name in ("torch", "jax"):
            path = pathlib.Path(sl.__file__).with_name(f"{name}.py")
            module, stub = (ast.parse(p.read_text(encoding="utf-8")).body for p in (path, path.with_suffix(".pyi")))
            (public,) = [ast.literal_eval(node.value) for node in module if ast.unparse(node).startswith("__all__")]
            kept = (ast.ClassDef, ast.FunctionDef)
            self.assertEqual(sorted(node.name for node in stub if isinstance(node, kept)), public)
            functions = [node for node in module + stub if isinstance(node, ast.FunctionDef)]
            made = [node.args for node in functions if node.name == "differentiable"]
            names = [[argument.arg for argument in arguments.args + arguments.kwonlyargs] for arguments in made]
            self.assertEqual(names, [["robot", "threads"]] * 2)


class Imports(unittest.TestCase):
    def test_other_packages_are_imported_when_they_are_asked_for(self):
        code = "import sys, straightline; print({'torch', 'jax', 'matplotlib'} & set(sys.modules))"
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        self.assertEqual(found.stdout.strip(), "set()")


if __name__ == "__main__":
    unittest.main()

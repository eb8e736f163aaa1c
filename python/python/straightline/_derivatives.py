"""Functions of a robot with their derivatives, as `straightline.torch` and `straightline.jax` need them.

Derivatives come from derivative functions of the same robot. Those by q are by increments u of the tangent at q: a joint's coordinate moves by u, a
ball joint by R exp(u×), a floating base by p + R u and R exp(w×). Here they are by coordinates, with T = ∂q/∂u and its left inverse P:

    ∂y/∂q = ∂y/∂u P,    ∂q⁺/∂x = T(q⁺) ∂u⁺/∂x

The gradient by a quaternion is therefore along the sphere of quaternions of its length.
"""

from math import prod

import numpy as np

from ._results import result_type
from ._robot import Robot
from ._straightline import Function

# function: its derivative function, and which result of that is the derivative of an output by an input
BY_MATRICES = {
    "inverse_dynamics": (
        "inverse_dynamics_derivatives",
        {("tau", "q"): "dtau_dq", ("tau", "qd"): "dtau_dqd", ("tau", "qdd"): "h"},
    ),
    "forward_dynamics": (
        "forward_dynamics_derivatives",
        {("qdd", "q"): "dqdd_dq", ("qdd", "qd"): "dqdd_dqd", ("qdd", "tau"): "h_inverse"},
    ),
    "gravity_force": ("gravity_derivative", {("g", "q"): "dg_dq"}),
    "bias_force": ("bias_derivatives", {("h", "q"): "dh_dq", ("h", "qd"): "dh_dqd"}),
    "centre_of_mass": ("centre_of_mass_jacobian", {("p", "q"): "j"}),
    "momentum": ("centroidal_derivatives", {("p", "q"): "dh_dq", ("p", "qd"): "a"}),
    "frame_velocity": ("frame_derivatives", {("v", "q"): "dv_dq", ("v", "qd"): "j"}),
    "frame_acceleration": (
        "frame_derivatives",
        {("a", "q"): "da_dq", ("a", "qd"): "da_dqd", ("a", "qdd"): "j"},
    ),
    "jacobian_bias": ("frame_derivatives", {("a", "q"): "da_dq", ("a", "qd"): "da_dqd"}),
    "integrate": (
        "integrate_derivatives",
        {("q_plus_v", "q"): "dintegrate_dq", ("q_plus_v", "v"): "dintegrate_dv"},
    ),
    "difference": (
        "difference_derivatives",
        {("v", "q"): "ddifference_dq0", ("v", "q1"): "ddifference_dq1"},
    ),
    "driven_forward_dynamics": (
        "driven_forward_dynamics_derivatives",
        {
            (output, variable): f"d{output}_d{variable}"
            for output in ("qdd", "xd")
            for variable in ("q", "qd", "x", "u")
        },
    ),
}
# function: what gives the rate of an output along a motion; by unit velocities that is its derivative
BY_RATES = {
    "mass_matrix": ("coriolis_matrix", "h", "h_dot"),
    "jacobian": ("frame_derivatives", "j", "j_dot"),
    "centroidal_map": ("centroidal_map_rate", "a", "a_dot"),
}
# function: what gives it as a step with A and B
BY_STEPS = {"semi_implicit_step": "step_derivatives", "runge_kutta_step": "step_derivatives_rk4"}
# functions with _vjp, _jvp and _hvp
BY_PRODUCTS = ("inverse_dynamics", "forward_dynamics")
DIFFERENTIABLE = tuple(sorted({*BY_MATRICES, *BY_RATES, *BY_STEPS, "forward_kinematics"}))

# inputs and outputs that are configurations
CONFIGURATIONS = ("q", "q1", "q_plus_v", "q_next")


class NotDifferentiable(NotImplementedError):
    """A derivative is asked for that no derivative function gives."""


class Coordinates:
    """Where the quaternions of q are, and how coordinates move along the tangent."""

    def __init__(self, robot):
        self.nq, self.nv = robot.nq, robot.nv
        #: First coordinate and first velocity of the joints of one coordinate, of floating bases, and of quaternions.
        self.single, self.bases, self.quaternions = [], [], []
        iq = iv = 0
        for kind in robot._loaded.joint_kinds:
            if kind == "floating":
                self.bases.append((iq, iv))
                self.quaternions.append((iq + 3, iv + 3))
            elif kind == "spherical":
                self.quaternions.append((iq, iv))
            else:
                self.single.append((iq, iv))
            iq += {"floating": 7, "spherical": 4}.get(kind, 1)
            iv += {"floating": 6, "spherical": 3}.get(kind, 1)
        self.are_flat = not self.quaternions
        # dependent joints of closed loops have coordinates, but no velocities
        self.are_known = (iq, iv) == (self.nq, self.nv)

    def along(self, q):
        """T = ∂q/∂u, (..., nq, nv)."""
        matrix = np.zeros((*q.shape, self.nv), q.dtype)
        for iq, iv in self.single:
            matrix[..., iq, iv] = 1
        for iq, iv in self.bases:
            matrix[..., iq : iq + 3, iv : iv + 3] = _rotation(q[..., iq + 3 : iq + 7])
        for iq, iv in self.quaternions:
            matrix[..., iq : iq + 4, iv : iv + 3] = _half_product(q[..., iq : iq + 4])
        return matrix

    def back(self, q):
        """P, (..., nv, nq): Tᵀ, whose blocks of quaternions are divided by the squares of their columns' length |q|/2."""
        matrix = np.swapaxes(self.along(q), -1, -2).copy()
        for iq, iv in self.quaternions:
            quaternion = q[..., iq : iq + 4]
            matrix[..., iv : iv + 3, iq : iq + 4] *= 4 / np.sum(quaternion * quaternion, axis=-1)[..., None, None]
        return matrix


def _half_product(quaternion):
    """½ q ⊗ (u, 0) as a matrix times u; q = (x, y, z, w)."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    return np.stack([w, -z, y, z, w, -x, -y, x, w, -x, -y, -z], axis=-1).reshape(*x.shape, 4, 3) / 2


def _rotation(quaternion):
    """R of a quaternion (x, y, z, w) of any length but zero."""
    squared = np.sum(quaternion * quaternion, axis=-1, keepdims=True)
    x, y, z, w = np.moveaxis(quaternion / np.sqrt(squared), -1, 0)
    rows = [
        1 - 2 * (y * y + z * z),
        2 * (x * y - z * w),
        2 * (x * z + y * w),
        2 * (x * y + z * w),
        1 - 2 * (x * x + z * z),
        2 * (y * z - x * w),
        2 * (x * z - y * w),
        2 * (y * z + x * w),
        1 - 2 * (x * x + y * y),
    ]
    return np.stack(rows, axis=-1).reshape(*x.shape, 3, 3)


class Map:
    """A function of arrays to arrays, for one state or many: inputs and outputs by their names and shapes.

    Axes of states stand before those of the shapes; they follow NumPy's rules for arrays of different shapes.
    """

    def __init__(self, name, inputs, outputs, dtype, call, refusal=None):
        self.name, self.inputs, self.outputs, self.dtype, self.call = name, inputs, outputs, dtype, call
        #: What is said where it is differentiated.
        self.refusal = refusal

    def results(self, values):
        """One value, or several by their names."""
        return values[0] if len(values) == 1 else result_type(self.name, tuple(self.outputs))(*values)

    def matrices(self):
        """The map to ∂output/∂input, of each pair that a derivative function gives: axes of the output, then one of all numbers of the input.

        Outputs are named by pairs. NotDifferentiable is raised where there are none.
        """
        raise NotDifferentiable(self.refusal)

    def pullback(self):
        """The map from inputs and multipliers of the outputs to the multipliers times the derivatives, by the names of the inputs.

        Inputs by which there is no derivative have no output. NotDifferentiable is raised where there are none.
        """
        raise NotDifferentiable(self.refusal)

    def refusal_by(self, name):
        """What is said where a derivative by this input is wanted, which there is not."""
        return NotDifferentiable(f"`{self.name}` has no derivative by `{name}`: hold it (detach, stop_gradient)")


class FunctionMap(Map):
    """A function of a robot."""

    def __init__(self, robot, name, threads=1):
        function = getattr(robot, name)
        if not isinstance(function, Function):
            raise AttributeError(f"`{name}` is no function of the robot {robot.name!r}")
        self.robot, self.function, self.threads = robot, function, threads
        known = ", ".join(name for name in DIFFERENTIABLE if name in robot.functions)
        refusal = f"`{name}` has no derivative function: it is computed, but not differentiated; differentiable are {known}"
        super().__init__(name, function.inputs, function.outputs, robot.dtype, self._call, refusal)
        self.coordinates = Coordinates(robot)

    def _call(self, *inputs):
        found = self.function(*inputs, threads=self.threads)
        return [found] if len(self.outputs) == 1 else list(found)

    def _other(self, name):
        """A derivative function, to be called by the names of inputs."""
        if name not in self.robot.functions:
            raise NotDifferentiable(f"the derivative of `{self.name}` takes `{name}`, which the robot does not have")
        function = getattr(self.robot, name)

        def call(inputs):
            # what it takes beside them are accelerations, on which these results do not depend, or which are zero
            at_rest = {"qdd": np.zeros(self.coordinates.nv, self.dtype)}
            given = {**at_rest, **inputs}
            found = function(**{port: given[port] for port in function.inputs}, threads=self.threads)
            return dict(zip(function.outputs, [found] if len(function.outputs) == 1 else found))

        return call, function.outputs

    def _tangent(self, name, shape):
        """Numbers of an input or output along its tangent."""
        return self.coordinates.nv if name in CONFIGURATIONS else prod(shape)

    # -- derivatives along tangents: a function of inputs, and its results by (output, input)

    def _along_tangents(self):
        self._refuse_scenes()
        if self.name in BY_MATRICES:
            return self._by_matrices(*BY_MATRICES[self.name])
        if self.name in BY_RATES:
            return self._by_rates(*BY_RATES[self.name])
        if self.name in BY_STEPS:
            return self._by_steps(BY_STEPS[self.name])
        if self.name == "forward_kinematics":
            return self._by_jacobian()
        raise NotDifferentiable(self.refusal)

    def _refuse_scenes(self):
        scene = self.robot._loaded.undifferentiable
        if scene:
            raise NotDifferentiable(f"`{self.name}` is not differentiated in a scene with {scene}")
        if not self.coordinates.are_known:
            raise NotDifferentiable(
                f"`{self.name}` is not differentiated of a robot with closed loops, whose configurations have dependent coordinates"
            )

    def _by_matrices(self, name, results):
        function, outputs = self._other(name)
        there = {pair: result for pair, result in results.items() if pair[0] in self.outputs and pair[1] in self.inputs}
        for pair, result in there.items():
            self._check(pair, name, outputs.get(result))
        return (lambda inputs: _picked(function(inputs), there)), list(there)

    def _by_rates(self, name, output, rate):
        function, outputs = self._other(name)
        self._check((output, "q"), name, (*outputs.get(rate, ()), self.coordinates.nv))
        units = np.eye(self.coordinates.nv, dtype=self.dtype)
        axes = len(self.outputs[output])

        def call(inputs):
            # of each state as many as there are velocities
            spread = {port: np.expand_dims(inputs[port], -1 - len(shape)) for port, shape in self.inputs.items()}
            rates = function({**spread, "qd": units})[rate]
            return {(output, "q"): np.moveaxis(rates, -1 - axes, -1)}

        return call, [(output, "q")]

    def _by_steps(self, name):
        function, outputs = self._other(name)
        n = self.coordinates.nv
        if (outputs.get("a"), outputs.get("b")) != ((2 * n, 2 * n), (2 * n, n)):
            raise NotDifferentiable(f"the derivative of `{self.name}` takes A and B of `{name}` whole")
        rows = [(output, part) for output, part in (("q_next", slice(n)), ("qd_next", slice(n, None))) if output in self.outputs]
        columns = [("q", "a", slice(n)), ("qd", "a", slice(n, None)), ("tau", "b", slice(None))]
        columns = [column for column in columns if column[0] in self.inputs]

        def call(inputs):
            found = function(inputs)
            return {(output, name): found[matrix][..., row, part] for output, row in rows for name, matrix, part in columns}

        return call, [(output, name) for output, _ in rows for name, _, _ in columns]

    def _by_jacobian(self):
        """Of poses (p, R by rows): ∂p/∂u = J above, ∂R/∂u = (J below) × R."""
        function, outputs = self._other("jacobian")
        frames, n = len(self.robot.frames), self.coordinates.nv
        if self.outputs != {"x": (frames, 12)} or outputs != {"j": (frames, 6, n)}:
            raise NotDifferentiable(f"the derivative of `{self.name}` takes poses and Jacobians whole")

        def call(inputs):
            poses, j = self._call(*inputs.values())[0], function(inputs)["j"]
            axes = np.swapaxes(poses[..., 3:].reshape(*poses.shape[:-1], 3, 3), -1, -2)
            turns = np.swapaxes(j[..., 3:, :], -1, -2)
            # of each column of J and each axis of the frame
            rates = np.cross(turns[..., :, None, :], axes[..., None, :, :])
            rates = np.moveaxis(rates, -3, -1).swapaxes(-3, -2)
            return {("x", "q"): np.concatenate([j[..., :3, :], rates.reshape(*rates.shape[:-3], 9, n)], axis=-2)}

        return call, [("x", "q")]

    def _check(self, pair, name, found):
        output, variable = pair
        expected = self.outputs[output]
        if output in CONFIGURATIONS:
            expected = (self.coordinates.nv,)
        expected = (*expected, self._tangent(variable, self.inputs[variable]))
        if found is None or tuple(found) != expected:
            said = "is left out" if found is None else f"has shape {tuple(found)}"
            raise NotDifferentiable(
                f"the derivative of `{self.name}` by `{variable}` {said} in what the scene leaves of `{name}`; {expected} is needed"
            )

    # -- by coordinates

    def matrices(self):
        along_tangents, pairs = self._along_tangents()
        shapes = {(output, name): (*self.outputs[output], prod(self.inputs[name])) for output, name in pairs}

        def call(*values):
            inputs = dict(zip(self.inputs, values))
            found = along_tangents(inputs)
            if not self.coordinates.are_flat:
                found = self._by_coordinates(inputs, found)
            return list(found.values())

        return Map(f"{self.name}_derivatives", self.inputs, shapes, self.dtype, call, self._refusal_of("second"))

    def _refusal_of(self, order):
        return f"no function gives {order} derivatives of `{self.name}`"

    def _by_coordinates(self, inputs, found):
        outputs = {}
        if any(output in CONFIGURATIONS for output, _ in found):
            outputs = dict(zip(self.outputs, self._call(*inputs.values())))
        by_coordinates = {}
        for (output, name), matrix in found.items():
            if name in CONFIGURATIONS:
                back = self.coordinates.back(inputs[name])
                # axes of the output stand between those of states and the last
                back = back.reshape(*back.shape[:-2], *[1] * (len(self.outputs[output]) - 1), *back.shape[-2:])
                matrix = matrix @ back
            if output in CONFIGURATIONS:
                matrix = self.coordinates.along(outputs[output]) @ matrix
            by_coordinates[output, name] = matrix
        return by_coordinates

    def pullback(self):
        name = f"{self.name}_vjp"
        if self.name in BY_PRODUCTS and name in self.robot.functions:
            self._refuse_scenes()
            (shape,) = self.outputs.values()
            product = getattr(self.robot, name)
            # a scene can leave parts of either out
            if product.inputs == {**self.inputs, "multiplier": shape}:
                return ProductMap(self, product)
        matrices = self.matrices()
        pairs = list(matrices.outputs)
        names = [name for name in self.inputs if any(pair[1] == name for pair in pairs)]

        def call(*values):
            found = dict(zip(pairs, matrices.call(*values[: len(self.inputs)])))
            multipliers = dict(zip(self.outputs, values[len(self.inputs) :]))
            return [sum(_times(multipliers[o], found[o, i], self.outputs[o], self.inputs[i]) for o in self.outputs if (o, i) in found) for i in names]

        inputs = {**self.inputs, **{f"multiplier_{output}": shape for output, shape in self.outputs.items()}}
        return Map(name, inputs, {name: self.inputs[name] for name in names}, self.dtype, call, self._refusal_of("second"))


class ProductMap(Map):
    """Multipliers times the derivatives of inverse or forward dynamics, by functions that do not form matrices."""

    def __init__(self, whole, product):
        self.whole, self.product = whole, product
        names = [name.removeprefix("vjp_") for name in product.outputs]
        inputs = {**whole.inputs, "multiplier": product.inputs["multiplier"]}
        super().__init__(product.__name__, inputs, {name: whole.inputs[name] for name in names}, whole.dtype, self._call)

    def _call(self, *inputs):
        inputs = dict(zip(self.inputs, inputs))
        found = self.product(**inputs, threads=self.whole.threads)
        found = dict(zip(self.outputs, [found] if len(self.outputs) == 1 else found))
        if "q" in found and not self.whole.coordinates.are_flat:
            found["q"] = (found["q"][..., None, :] @ self.whole.coordinates.back(inputs["q"]))[..., 0, :]
        return list(found.values())

    def pullback(self):
        """Of gᵀ ∂(λ·y)/∂x: the Hessian of λ·y times g, and ∂y/∂x g by λ."""
        whole = self.whole
        if not whole.coordinates.are_flat:
            raise NotDifferentiable(f"second derivatives of `{whole.name}` are not known by the coordinates of quaternions")
        second, given = whole._other(f"{whole.name}_hvp")
        along, _ = whole._other(f"{whole.name}_jvp")
        if not {f"hvp_{name}" for name in self.outputs} <= set(given):
            raise NotDifferentiable(f"second derivatives of `{whole.name}` take all results of `{whole.name}_hvp`")

        def call(*values):
            inputs = dict(zip(self.inputs, values))
            inputs.update(zip((f"direction_{name}" for name in self.outputs), values[len(self.inputs) :]))
            of_inputs, of_multiplier = second(inputs), along(inputs)
            return [*(of_inputs[f"hvp_{name}"] for name in self.outputs), of_multiplier["jvp"]]

        inputs = {**self.inputs, **{f"multiplier_{name}": shape for name, shape in self.outputs.items()}}
        outputs = {**self.outputs, "multiplier": self.inputs["multiplier"]}
        return Map(f"{whole.name}_hvp", inputs, outputs, self.dtype, call, whole._refusal_of("third"))


def _picked(results, names):
    return {pair: results[name] for pair, name in names.items()}


def _times(multipliers, matrix, output, variable):
    """λ ∂y/∂x, in the shape of x."""
    lead = matrix.shape[: matrix.ndim - len(output) - 1]
    row = multipliers.reshape(*multipliers.shape[: multipliers.ndim - len(output)], 1, prod(output))
    found = row @ matrix.reshape(*lead, prod(output), prod(variable))
    return found.reshape(*found.shape[:-2], *variable)


class Differentiable:
    """What the robots of `straightline.torch` and `straightline.jax` have in common."""

    def __init__(self, robot, threads=1):
        if not isinstance(robot, Robot):
            raise TypeError(f"`robot` is a {type(robot).__name__}; what `straightline.load` gives is expected")
        self.robot, self.threads = robot, threads

    @property
    def functions(self):
        """Names of the functions."""
        return self.robot.functions

    def __getattr__(self, name):
        if name.startswith("_") or name == "robot":
            raise AttributeError(name)
        made = self.__dict__[name] = self._made(FunctionMap(self.robot, name, self.threads))
        return made

    def __dir__(self):
        return sorted({*super().__dir__(), *self.robot.functions})

    def __repr__(self):
        return f"<differentiable {self.robot!r}>"


def bound(name, ports, positions, names):
    """Values by position and by name, in the order of the inputs."""
    if len(positions) > len(ports):
        raise TypeError(f"{name} takes {_listed(ports)}: {len(positions)} are given")
    given = dict(zip(ports, positions))
    for port, value in names.items():
        if port not in ports:
            raise TypeError(f"{name} has no input `{port}`; it takes {_listed(ports)}")
        if port in given:
            raise TypeError(f"{name}: `{port}` is given by position and by name")
        given[port] = value
    missing = [port for port in ports if port not in given]
    if missing:
        raise TypeError(f"{name} takes {_listed(ports)}: {_listed(missing)} missing")
    return [given[port] for port in ports]


def states_of(ports, shapes):
    """The axes of states that inputs of these shapes have together."""
    leads = []
    for (name, own), shape in zip(ports.items(), shapes):
        shape = tuple(shape)
        axes = len(shape) - len(own)
        if axes < 0 or shape[axes:] != tuple(own):
            raise ValueError(
                f"`{name}` has shape {shape}; {tuple(own)} is expected, or (..., {', '.join(map(str, own))}) of many states"
            )
        leads.append(shape[:axes])
    common = [1] * max(map(len, leads), default=0)
    for lead in leads:
        for axis in range(-len(lead), 0):
            if common[axis] == 1:
                common[axis] = lead[axis]
            elif lead[axis] not in (1, common[axis]):
                listed = ", ".join(f"`{name}` {tuple(shape)}" for name, shape in zip(ports, shapes))
                raise ValueError(f"inputs are of different numbers of states: {listed}")
    return tuple(common)


def _listed(names):
    return ", ".join(f"`{name}`" for name in names) or "no input"

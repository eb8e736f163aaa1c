"""Functions of a robot as differentiable functions of JAX.

>>> import straightline as sl
>>> import straightline.jax
>>> panda = straightline.jax.differentiable(sl.load("panda.urdf"))
>>> jax.jacobian(panda.inverse_dynamics)(q, qd, qdd)        # with jax_enable_x64, or dtype="float32" of `load`

Derivatives are those of the robot's derivative functions. Functions are executed on the host (`jax.pure_callback`).
"""

from functools import lru_cache
from math import prod

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from ._derivatives import Differentiable, bound, states_of

__all__ = ["JaxFunction", "JaxRobot", "differentiable"]


def differentiable(robot, *, threads=1):
    """The robot with functions of JAX's arrays.

    Functions are called as those of the robot; inputs are arrays of the robot's dtype, and of as many states as NumPy's rules allow. `jax.jit`,
    `jax.vmap`, `jax.jvp`, `jax.grad` and what is made of them take these functions.

    The gradient by a quaternion is along the sphere of quaternions. There are no second derivatives. What has no derivative function raises
    `NotImplementedError` where it is differentiated.

    Parameters
    ----------
    robot : Robot
        What `straightline.load` gave.
    threads : int
        Threads that share the states of a batch.
    """
    return _differentiable(robot, threads)


class JaxRobot(Differentiable):
    """A robot whose functions take and give arrays of JAX. `differentiable` makes it."""

    def _made(self, mapping):
        return JaxFunction(mapping)

    def __reduce__(self):
        return (_differentiable, (self.robot, self.threads))


@lru_cache(maxsize=None)
def _differentiable(robot, threads):
    return JaxRobot(robot, threads)


class JaxFunction:
    """A function of a robot: an array of one result, a named tuple of several."""

    def __init__(self, mapping):
        self.__name__ = mapping.name
        self.__doc__ = mapping.function.__doc__
        self.inputs, self.outputs = mapping.inputs, mapping.outputs
        self._mapping = mapping
        self._differentiated = _differentiated(mapping)

    def __call__(self, *inputs, **named_inputs):
        inputs = bound(self.__name__, self.inputs, inputs, named_inputs)
        inputs = [self._read(name, value) for name, value in zip(self.inputs, inputs)]
        states_of(self.inputs, [value.shape for value in inputs])
        return self._mapping.results(self._differentiated(*inputs))

    def _read(self, name, value):
        if not isinstance(value, (jax.Array, np.ndarray)):
            raise TypeError(f"`{name}` of {self.__name__} is a {type(value).__name__}; an array is expected")
        array = jnp.asarray(value)
        if array.dtype != self._mapping.dtype:
            remedy = "load the robot with another dtype, or convert it"
            if self._mapping.dtype == np.float64 and not jax.config.jax_enable_x64:
                remedy = 'call `jax.config.update("jax_enable_x64", True)` first, or load the robot with dtype="float32"'
            raise TypeError(f"`{name}` of {self.__name__} has dtype {array.dtype}; {self._mapping.dtype} is expected: {remedy}")
        return array

    def __repr__(self):
        return f"<differentiable {self._mapping.function!r}>"


def _on_host(mapping):
    """The map as a function of arrays to a list of arrays, without derivatives."""

    def call(*values):
        states = states_of(mapping.inputs, [value.shape for value in values])
        found = [jax.ShapeDtypeStruct((*states, *shape), mapping.dtype) for shape in mapping.outputs.values()]
        # as many axes each, so that those of `vmap` stand before them
        spread = [
            value.reshape(*[1] * (len(states) + len(shape) - value.ndim), *value.shape)
            for value, shape in zip(values, mapping.inputs.values())
        ]
        return jax.pure_callback(run, found, *spread, vmap_method="expand_dims")

    def run(*values):
        return mapping.call(*(np.asarray(value) for value in values))

    return call


def _differentiated(mapping):
    """The same with derivatives: matrices from the host, times tangents."""
    function = jax.custom_jvp(_on_host(mapping))

    def rule(values, tangents):
        moving = {
            name: tangent for name, tangent in zip(mapping.inputs, tangents) if not isinstance(tangent, SymbolicZero)
        }
        found = function(*values)
        rates = [jnp.zeros_like(output) for output in found]
        if moving:
            by_host, pairs = _matrices(mapping)
            for name in moving:
                if not any(pair[1] == name for pair in pairs):
                    raise mapping.refusal_by(name)
            for (output, name), matrix in zip(pairs, by_host(*values)):
                if name in moving:
                    place = list(mapping.outputs).index(output)
                    rates[place] = rates[place] + _along(matrix, moving[name], mapping.inputs[name], len(mapping.outputs[output]))
        return found, rates

    function.defjvp(rule, symbolic_zeros=True)
    return function


@lru_cache(maxsize=None)
def _matrices(mapping):
    matrices = mapping.matrices()
    return _differentiated(matrices), list(matrices.outputs)


def _along(matrix, tangent, shape, axes):
    """∂y/∂x times a tangent of x; y has as many axes."""
    states = tangent.shape[: tangent.ndim - len(shape)]
    row = tangent.reshape(*states, *[1] * axes, prod(shape))
    return jnp.sum(matrix * row, axis=-1)

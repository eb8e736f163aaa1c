"""Functions of a robot as differentiable functions of PyTorch.

>>> import straightline as sl
>>> import straightline.torch
>>> panda = straightline.torch.differentiable(sl.load("panda.urdf"))
>>> tau = panda.inverse_dynamics(q, qd, qdd)        # tensors on the CPU, of one state or many
>>> tau.square().sum().backward()

Gradients are those of the robot's derivative functions.
"""

from functools import lru_cache
from itertools import count

import numpy as np
import torch

from ._derivatives import Differentiable, bound, states_of

__all__ = ["TorchFunction", "TorchRobot", "differentiable"]

if not hasattr(torch.library, "register_vmap"):
    raise ImportError(f"straightline.torch takes PyTorch 2.5 or later; here is {torch.__version__}")

_NUMBERS = {"float64": torch.float64, "float32": torch.float32}
_SERIAL = count()


def differentiable(robot, *, threads=1):
    """The robot with functions of tensors.

    Functions are called as those of the robot; inputs are tensors on the CPU of the robot's dtype, and of as many states as NumPy's rules allow.
    Each is a custom operator: `torch.compile` keeps it whole, `torch.func.vmap` makes one call of many states.

    The gradient by a quaternion is along the sphere of quaternions. Second derivatives are those of inverse and forward dynamics of robots
    without quaternions. What has no derivative function raises `NotImplementedError` in the backward pass.

    Parameters
    ----------
    robot : Robot
        What `straightline.load` gave.
    threads : int
        Threads that share the states of a batch.
    """
    return _differentiable(robot, threads)


class TorchRobot(Differentiable):
    """A robot whose functions take and give tensors. `differentiable` makes it."""

    def _made(self, mapping):
        return TorchFunction(mapping)

    def __reduce__(self):
        return (_differentiable, (self.robot, self.threads))


@lru_cache(maxsize=None)
def _differentiable(robot, threads):
    return TorchRobot(robot, threads)


class TorchFunction:
    """A function of a robot: a tensor of one result, a named tuple of several."""

    def __init__(self, mapping):
        self.__name__ = mapping.name
        self.__doc__ = mapping.function.__doc__
        self.inputs, self.outputs = mapping.inputs, mapping.outputs
        self._mapping = mapping
        self._dtype = _NUMBERS[np.dtype(mapping.dtype).name]
        self._operator = _operator(mapping)

    def __call__(self, *inputs, **named_inputs):
        inputs = bound(self.__name__, self.inputs, inputs, named_inputs)
        for name, value in zip(self.inputs, inputs):
            self._check(name, value)
        states_of(self.inputs, [value.shape for value in inputs])
        found = self._operator(*inputs)
        return self._mapping.results([found] if isinstance(found, torch.Tensor) else found)

    def _check(self, name, value):
        if not isinstance(value, torch.Tensor):
            raise TypeError(f"`{name}` of {self.__name__} is a {type(value).__name__}; a tensor is expected")
        if value.dtype != self._dtype:
            raise TypeError(
                f"`{name}` of {self.__name__} has dtype {value.dtype}; {self._dtype} is expected: convert it, or load the robot with another dtype"
            )
        if value.device.type not in ("cpu", "meta"):
            raise ValueError(f"`{name}` of {self.__name__} is on {value.device}; functions are executed on the CPU: take `{name}.cpu()`")

    def __repr__(self):
        return f"<differentiable {self._mapping.function!r}>"


def _operator(mapping):
    """The map as an operator of PyTorch, with its pullback."""
    several = len(mapping.outputs) > 1
    # names of inputs could be words of the schema's language
    inputs = ", ".join(f"Tensor x{k}" for k in range(len(mapping.inputs)))
    outputs = ", ".join("Tensor" for _ in mapping.outputs)
    schema = f"({inputs}) -> {f'({outputs})' if several else outputs}"

    def packed(values):
        return tuple(values) if several else values[0]

    def run(*values):
        found = mapping.call(*(value.numpy(force=True) for value in values))
        return packed([torch.from_numpy(np.ascontiguousarray(array)) for array in found])

    operator = torch.library.custom_op(
        f"straightline::{mapping.name}_{next(_SERIAL)}", run, mutates_args=(), device_types="cpu", schema=schema
    )

    @operator.register_fake
    def _(*values):
        states = states_of(mapping.inputs, [value.shape for value in values])
        return packed([values[0].new_empty((*states, *shape)) for shape in mapping.outputs.values()])

    @operator.register_vmap
    def _(info, axes, *values):
        shapes = [tuple(shape) for shape in mapping.inputs.values()]
        own = [value.dim() - len(shape) - (axis is not None) for value, axis, shape in zip(values, axes, shapes)]
        spread = [
            value if axis is None else _spread(value.movedim(axis, 0), max(own) - number)
            for value, axis, number in zip(values, axes, own)
        ]
        return operator(*spread), packed([0] * len(mapping.outputs))

    def keep(ctx, inputs, output):
        ctx.save_for_backward(*inputs)

    def backward(ctx, *gradients):
        pullback, by_operator = _pullback(mapping)
        values = ctx.saved_tensors
        given = [_whole(gradient, shape, values, mapping) for gradient, shape in zip(gradients, mapping.outputs.values())]
        found = by_operator(*values, *given)
        found = dict(zip(pullback.outputs, [found] if isinstance(found, torch.Tensor) else found))
        for name, is_needed in zip(mapping.inputs, ctx.needs_input_grad):
            if is_needed and name not in found:
                raise mapping.refusal_by(name)
        # of one state that went with many, torch takes the sum
        return tuple(found.get(name) for name in mapping.inputs)

    operator.register_autograd(backward, setup_context=keep)
    return operator


@lru_cache(maxsize=None)
def _pullback(mapping):
    pullback = mapping.pullback()
    return pullback, _operator(pullback)


def _spread(value, axes):
    """With further axes behind the first."""
    return value.reshape(value.shape[0], *[1] * axes, *value.shape[1:])


def _whole(gradient, shape, values, mapping):
    """The gradient by an output, also by one that nothing depends on."""
    if gradient is not None:
        return gradient
    states = states_of(mapping.inputs, [value.shape for value in values])
    return values[0].new_zeros((*states, *shape))

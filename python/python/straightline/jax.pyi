"""Functions of a robot as differentiable functions of JAX."""

from typing import Any, Union

import jax
from numpy.typing import NDArray

from . import Robot

class JaxFunction:
    """A function of a robot: an array of one result, a named tuple of several."""

    __name__: str
    inputs: dict[str, tuple[int, ...]]
    outputs: dict[str, tuple[int, ...]]
    def __call__(
        self, *inputs: Union[jax.Array, NDArray[Any]], **named_inputs: Union[jax.Array, NDArray[Any]]
    ) -> Any: ...

class JaxRobot:
    """A robot whose functions take and give arrays of JAX."""

    robot: Robot
    threads: int
    @property
    def functions(self) -> tuple[str, ...]: ...
    def __getattr__(self, name: str) -> JaxFunction: ...

def differentiable(robot: Robot, *, threads: int = 1) -> JaxRobot: ...

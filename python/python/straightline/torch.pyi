"""Functions of a robot as differentiable functions of PyTorch."""

from typing import Any

import torch

from . import Robot

class TorchFunction:
    """A function of a robot: a tensor of one result, a named tuple of several."""

    __name__: str
    inputs: dict[str, tuple[int, ...]]
    outputs: dict[str, tuple[int, ...]]
    def __call__(self, *inputs: torch.Tensor, **named_inputs: torch.Tensor) -> Any: ...

class TorchRobot:
    """A robot whose functions take and give tensors."""

    robot: Robot
    threads: int
    @property
    def functions(self) -> tuple[str, ...]: ...
    def __getattr__(self, name: str) -> TorchFunction: ...

def differentiable(robot: Robot, *, threads: int = 1) -> TorchRobot: ...

"""Dynamics of a robot file as functions over NumPy arrays."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

__version__: str

class RobotError(ValueError): ...
class RobotWarning(UserWarning): ...

class Cost(NamedTuple):
    operations: int
    sincos: int

class Function:
    """A function of a robot: an array of one result, a named tuple of several."""

    @property
    def __name__(self) -> str: ...
    @property
    def inputs(self) -> dict[str, tuple[int, ...]]: ...
    @property
    def outputs(self) -> dict[str, tuple[int, ...]]: ...
    @property
    def cost(self) -> tuple[int, int]: ...
    @property
    def known_cost(self) -> tuple[int, int] | None: ...
    @property
    def execution(self) -> str: ...
    @property
    def error_bound(self) -> Any: ...
    def __call__(
        self,
        *inputs: ArrayLike,
        out: NDArray[Any] | Sequence[NDArray[Any]] | None = None,
        threads: int | None = 1,
        **named_inputs: ArrayLike,
    ) -> Any: ...

def load(
    robot: str | bytes | os.PathLike[str],
    *,
    scene: str | bytes | os.PathLike[str] | None = None,
    dtype: DTypeLike | None = None,
    cache: bool | str | os.PathLike[str] | None = True,
    functions: str | Iterable[str] | None = None,
    frames: str | Iterable[str] | None = None,
    scalar: str | Iterable[str] | None = None,
    lanes: str | None = None,
    fma: bool | str | None = None,
    generic: bool | None = None,
    rules: str | None = None,
    optimise: str | None = None,
    forward_dynamics: str | None = None,
    limbs: str | None = None,
    columns: str | None = None,
    entries: str | None = None,
    target: str | None = None,
    memory: str | None = None,
    figures: bool | None = None,
    self_test: bool | None = None,
    max_part_operations: int | None = None,
    fixed: bool | str | None = None,
    fixed_error: float | None = None,
    certify_seconds: float | None = None,
    certify_boxes: int | None = None,
    certify_state: bool | None = None,
    certify: bool | None = None,
    mixed_precision: float | None = None,
    floating_base: bool | None = None,
    joint_order: str | Iterable[str] | None = None,
    angle_tolerance: float | None = None,
    gravity: Iterable[float] | None = None,
    allow: str | Iterable[str] | None = None,
    warn: str | Iterable[str] | None = None,
    deny: str | Iterable[str] | None = None,
) -> Robot: ...

class Robot:
    """A robot whose functions can be called."""

    name: str
    joint_names: tuple[str, ...]
    drive_names: tuple[str, ...]
    frames: tuple[str, ...]
    nq: int
    nv: int
    dtype: np.dtype[Any]
    execution: str
    functions: tuple[str, ...]
    warnings: str
    cost: Mapping[str, Cost]
    error_bound: Mapping[str, Any]
    def parameter(self, name: str, **numbers: ArrayLike) -> NDArray[Any]: ...
    def rust(self, functions: Iterable[str | Function] | str | None = None) -> str: ...
    def report(self, path: str | os.PathLike[str], functions: Iterable[str | Function] | str | None = None) -> None: ...
    def _repr_html_(self) -> str: ...
    forward_kinematics: Function
    frame_velocity: Function
    frame_acceleration: Function
    jacobian: Function
    jacobian_bias: Function
    inverse_dynamics: Function
    gravity_force: Function
    bias_force: Function
    velocity_force: Function
    mass_matrix: Function
    forward_dynamics: Function
    joint_wrenches: Function
    energy: Function
    centre_of_mass: Function
    momentum: Function
    kinematics_and_jacobian: Function
    mass_matrix_and_gravity_force: Function
    inverse_dynamics_derivatives: Function
    inverse_dynamics_jvp: Function
    inverse_dynamics_vjp: Function
    inverse_dynamics_hvp: Function
    forward_dynamics_derivatives: Function
    forward_dynamics_derivatives_at_motion: Function
    forward_dynamics_jvp: Function
    forward_dynamics_vjp: Function
    forward_dynamics_hvp: Function
    gravity_derivative: Function
    bias_derivatives: Function
    coriolis_matrix: Function
    coriolis_transpose_force: Function
    frame_derivatives: Function
    frame_derivatives_in_own_axes: Function
    frame_derivatives_at_world_origin: Function
    centre_of_mass_jacobian: Function
    subtree_centres_of_mass: Function
    jacobian_hessian_product: Function
    centroidal_map: Function
    centroidal_map_rate: Function
    centroidal_derivatives: Function
    operational_space_dynamics: Function
    inverse_kinematics_step: Function
    integrate: Function
    difference: Function
    integrate_derivatives: Function
    difference_derivatives: Function
    integrate_transport: Function
    semi_implicit_step: Function
    runge_kutta_step: Function
    step_derivatives: Function
    step_derivatives_rk4: Function
    torque_regressor: Function
    torque_regressor_entries: Function
    gravity_regressor: Function
    momentum_regressor: Function
    energy_regressor: Function
    base_wrench_regressor: Function
    base_parameters: Function
    support_parameters: Function
    parameter_derivatives: Function
    driven_forward_dynamics: Function
    driven_inverse_dynamics: Function
    drive_torques: Function
    complete_model: Function
    state_space: Function
    drive_power: Function
    drive_energy: Function
    driven_forward_dynamics_derivatives: Function
    close_loops: Function
    loop_jacobian: Function
    loop_motion: Function

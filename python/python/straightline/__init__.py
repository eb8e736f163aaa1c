"""Dynamics of a robot file as functions over NumPy arrays.

>>> import straightline as sl
>>> panda = sl.load("panda.urdf", frames=["panda_hand_tcp"])
>>> tau = panda.inverse_dynamics(q, qd, qdd)

Functions take one state, arrays of shape (7,), or many, (n, 7). ``panda.functions`` lists them.
"""

from ._robot import Cost, Robot, RobotWarning, load
from ._straightline import Function, RobotError, __version__

__all__ = ["Cost", "Function", "Robot", "RobotError", "RobotWarning", "load"]

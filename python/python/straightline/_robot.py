"""Robots: from a file, or its text, to functions."""

import os
import warnings
from collections import namedtuple
from collections.abc import Mapping
from functools import lru_cache
from html import escape

import numpy as np

from . import _straightline

if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_straightline.before_fork,
        after_in_parent=lambda: _straightline.after_fork(False),
        after_in_child=lambda: _straightline.after_fork(True),
    )

Cost = namedtuple("Cost", ["operations", "sincos"])
Cost.__doc__ = "Multiplications, additions, divisions and square roots of a function; and pairs of sine and cosine."


class RobotWarning(UserWarning):
    """What is doubtful in a robot file: the text says what was assumed."""


def load(robot, *, scene=None, dtype=None, cache=True, **options):
    """The robot of a file in URDF, MJCF, SDF or TOML.

    Parameters
    ----------
    robot : path or text
        The robot file, or its text.
    scene : path or text, optional
        What is wanted of the robot and what is held, in TOML.
    dtype : optional
        ``numpy.float64`` or ``numpy.float32``: the numbers of inputs and results.
    cache : bool or path, optional
        The folder where programs are kept for the next time; they are checked again then. ``True`` is a folder of the user, ``False`` none.
    **options
        Options of the compiler by their names: ``frames=["tool"]``, ``gravity=(0, 0, -1.62)``, ``floating_base=True``, ...
        ``optimise="quick"`` compiles in milliseconds, to a few more operations and other last bits.
        ``functions=["inverse_dynamics"]`` compiles these functions at once; others are compiled when they are first used.

    Raises
    ------
    RobotError
        What is wrong with the robot file, the scene or the options.
    OSError
        A file cannot be read.
    """
    given = {name: _frozen(value) for name, value in options.items()}
    if dtype is not None:
        if "scalar" in given:
            raise TypeError("`dtype` and `scalar` say the same: give one of them")
        given["scalar"] = _scalar(dtype)
    scene = None if scene is None else _file(scene, "scene")
    state = (*_file(robot, "robot"), scene, tuple(sorted(given.items())), _folder(cache))
    made = Robot(state)
    for name in made._loaded.named:
        made.cost[name]
    return made


def _scalar(dtype):
    names = {"float64": "f64", "float32": "f32"}
    name = np.dtype({"f64": "float64", "f32": "float32"}.get(dtype, dtype) if isinstance(dtype, str) else dtype).name
    if name not in names:
        raise TypeError(f"dtype is {name}; float64 or float32 is expected")
    return names[name]


def _frozen(value):
    """The value of an option, which cannot change any more."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_frozen(item) for item in value) if isinstance(value, (list, tuple, set, frozenset)) else value


def _file(given, what):
    """The path and the bytes of a file, or of a text that stands for it."""
    if isinstance(given, (bytes, bytearray)):
        return what, bytes(given)
    if isinstance(given, str) and ("\n" in given or given.lstrip().startswith("<")):
        return what, given.encode("utf-8", "surrogatepass")
    if not isinstance(given, (str, os.PathLike)):
        raise TypeError(f"`{what}` is a {type(given).__name__}; a path or a text is expected")
    path = os.fspath(given)
    with open(path, "rb") as file:
        return os.fsdecode(path), file.read()


def _folder(cache):
    """Where programs are kept: None, a path, or "" for the folder of whoever runs this."""
    if cache is None or isinstance(cache, (bool, np.bool_)):
        return "" if cache else None
    if not isinstance(cache, (str, os.PathLike)):
        raise TypeError(f"`cache` is a {type(cache).__name__}; True, False or a path is expected")
    path = os.path.abspath(os.fspath(cache))
    return os.fsdecode(path)


class _OfFunctions(Mapping):
    """What is known of each function, found out when it is asked for."""

    def __init__(self, names, find):
        self._names, self._find, self._found = names, find, {}

    def __getitem__(self, name):
        if name not in self._names:
            raise KeyError(name)
        if name not in self._found:
            self._found[name] = self._find(name)
        return self._found[name]

    def __iter__(self):
        return iter(self._names)

    def __len__(self):
        return len(self._names)

    def __repr__(self):
        return f"<of {len(self)} functions, {len(self._found)} found out so far: {self._found!r}>"


class Robot:
    """A robot whose functions can be called. `load` makes it.

    Each function is a method: ``robot.functions`` lists them, and its documentation says what it takes and gives.
    """

    def __init__(self, state):
        loaded = _straightline.LoadedRobot(state)
        self._loaded = loaded
        self._state = state
        #: Its name in the file.
        self.name = loaded.name
        #: Joints in the order of their coordinates.
        self.joint_names = tuple(loaded.joint_names)
        #: Drives in the order of the inputs u.
        self.drive_names = tuple(loaded.drive_names)
        #: Frames of the functions that answer per frame.
        self.frames = tuple(loaded.frames)
        #: Number of configuration coordinates q.
        self.nq = loaded.nq
        #: Number of velocity coordinates qd, qdd, tau.
        self.nv = loaded.nv
        #: The numbers of inputs and results.
        self.dtype = np.dtype(loaded.dtype)
        #: How functions are executed.
        self.execution = loaded.execution
        #: Names of the functions.
        self.functions = tuple(loaded.functions)
        #: What the compiler says of the file.
        self.warnings, count = loaded.warnings
        made = {name: loaded.function(name) for name in self.functions}
        #: Operations of each function.
        self.cost = _OfFunctions(self.functions, lambda name: Cost(*made[name].cost))
        #: Certified bounds of the rounding errors of each function.
        self.error_bound = _OfFunctions(self.functions, lambda name: made[name].error_bound)
        self.__dict__.update(made)
        if count:
            warnings.warn(self.warnings, RobotWarning, stacklevel=3)

    def parameter(self, name, **numbers):
        """The input of a payload, a link or a drive that the scene makes a parameter.

        Of a body: ``mass`` [kg], ``com`` (3) [m] and ``inertia`` about it (xx, xy, xz, yy, yz, zz) [kg·m²], in its frame; of a drive its ``numbers``.
        """
        given = []
        for expected, shape in self._loaded.parameter_inputs(name):
            if expected not in numbers:
                raise TypeError(f"parameter `{name}` takes `{expected}`, which is missing")
            values = np.atleast_1d(np.asarray(numbers.pop(expected), dtype=float))
            if values.shape != tuple(shape):
                raise ValueError(f"`{expected}` of parameter `{name}` has shape {values.shape}; {tuple(shape)} is expected")
            given.extend(values.tolist())
        if numbers:
            raise TypeError(f"parameter `{name}` takes no `{next(iter(numbers))}`")
        return np.array(self._loaded.parameter(name, given), dtype=self.dtype)

    def rust(self, functions=None):
        """The generated Rust of these functions; otherwise of those that `load` was given, or that are made without being named."""
        return self._loaded.rust(_names(functions))

    def report(self, path, functions=None):
        """Writes a page of HTML about these functions, with what each optimisation saves; of which functions, see `rust`."""
        page = self._loaded.report(_names(functions))
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(self._loaded.lacking(name))

    def __repr__(self):
        return (
            f"<Robot {self.name!r}: {len(self.joint_names)} joints, nq = {self.nq}, nv = {self.nv}, {self.dtype}, "
            f"{len(self.functions)} functions, {self.execution}>"
        )

    def _repr_html_(self):
        joints = zip(self.joint_names, self._loaded.joint_kinds)
        rows = "".join(f"<tr><td>{_escaped(joint)}</td><td>{_escaped(kind)}</td></tr>" for joint, kind in joints)
        text = (
            f"<p><b>{_escaped(self.name)}</b>: nq = {self.nq}, nv = {self.nv}, {self.dtype}, {_escaped(self.execution)}</p>"
            f"<table><tr><th>joint</th><th>kind</th></tr>{rows}</table>"
            "<table><tr><th>function</th><th>operations</th><th>sincos</th></tr>"
        )
        for name in self.functions:
            cost = self.__dict__[name].known_cost
            cells = "".join(f"<td>{number}</td>" for number in cost) if cost else "<td colspan='2'>not compiled yet</td>"
            text += f"<tr><td>{_escaped(name)}</td>{cells}</tr>"
        return text + "</table>"

    def __reduce__(self):
        return (_robot, (self._state,))

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self


def _names(functions):
    if functions is None:
        return None
    functions = [functions] if isinstance(functions, (str, _straightline.Function)) else functions
    return [function if isinstance(function, str) else function.__name__ for function in functions]


def _escaped(text):
    """Text of a robot file as it may stand in a page: without marks, and without what turns the direction of writing."""
    def is_mark(c):
        return ord(c) < 32 or 0x7F <= ord(c) < 0xA0 or "\u202a" <= c <= "\u202e" or "\u2066" <= c <= "\u2069"

    return escape("".join("\ufffd" if is_mark(c) else c for c in text))


@lru_cache(maxsize=16)
def _robot(state):
    """The robot of a state that came from another process; each is made once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return Robot(state)


def _function(state, name):
    return _robot(state).__dict__[name]

"""Robot dynamics over Arrow's arrays: the functions of SQL as functions of Python, for engines that take such.

`load` gives a robot whose functions take pyarrow arrays, a list of numbers per row, and give a struct with a number per joint. Lists without gaps are
taken as they lie in memory, and so are results. A result has the bits of the function of SQL.
"""

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import straightline

#: What each function takes, behind the robot.
FUNCTIONS = {
    "inverse_dynamics": ("q", "qd", "qdd"),
    "forward_dynamics": ("q", "qd", "tau"),
    "gravity_force": ("q",),
    "bias_force": ("q", "qd"),
    "residual": ("q", "qd", "qdd", "effort"),
}


def load(robot, **options):
    """The robot of a file or of its text, with the options of `straightline.load`."""
    return ArrowRobot(straightline.load(robot, optimise="quick", **options))


class ArrowRobot:
    """A robot whose functions take and give Arrow's arrays. It can be pickled, so that engines send it to others."""

    def __init__(self, robot):
        if robot.nq != len(robot.joint_names) or robot.nv != robot.nq:
            raise ValueError(f"{robot.name} has joints of several coordinates: its functions are those of SQL alone")
        #: As `straightline.load` gives it.
        self.robot = robot
        #: The type of results: a number per joint \\[N·m, N, rad/s² or m/s²\\].
        self.type = pa.struct([(name, pa.float64()) for name in robot.joint_names])

    def inverse_dynamics(self, q, qd, qdd):
        """τ of each row."""
        return self._rows("inverse_dynamics", q, qd, qdd)

    def forward_dynamics(self, q, qd, tau):
        """q̈ of each row."""
        return self._rows("forward_dynamics", q, qd, tau)

    def gravity_force(self, q):
        """g of each row."""
        return self._rows("gravity_force", q)

    def bias_force(self, q, qd):
        """h of each row."""
        return self._rows("bias_force", q, qd)

    def residual(self, q, qd, qdd, effort):
        """Measured efforts less the model's, of each row."""
        return self._rows("residual", q, qd, qdd, effort)

    def _rows(self, function, *columns):
        given = [self._states(name, column) for name, column in zip(FUNCTIONS[function], columns)]
        numbers = [numbers for numbers, _ in given]
        # one column behind the other, so that none is copied on its way out
        found = np.empty((len(columns[0]), self.robot.nv), order="F")
        if function == "residual":
            self.robot.inverse_dynamics(*numbers[:3], out=found)
            np.subtract(numbers[3], found, out=found)
        else:
            getattr(self.robot, function)(*numbers, out=found)
        masks = [is_null for _, is_null in given if is_null is not None]
        is_null = np.logical_or.reduce(masks) if masks else None
        joints = [pa.array(found[:, joint], mask=is_null) for joint in range(self.robot.nv)]
        mask = None if is_null is None else pa.array(is_null)
        return pa.StructArray.from_arrays(joints, fields=list(self.type), mask=mask)

    def _states(self, name, column):
        """The numbers of a column, a row each, and which rows have none, if any."""
        if isinstance(column, pa.ChunkedArray):
            column = column.combine_chunks()
        if pa.types.is_struct(column.type):
            return self._of_struct(name, column)
        if not _is_list(column.type):
            raise TypeError(f"`{name}` is of type {column.type}: it is a list of numbers, or a struct with a number per joint")
        count = self.robot.nv
        lengths = pc.fill_null(pc.list_value_length(column), count).to_numpy(zero_copy_only=False)
        if (lengths != count).any():
            row = int(np.argmax(lengths != count))
            raise ValueError(f"`{name}` has {lengths[row]} numbers in row {row} of its batch, {self.robot.name} takes {count}")
        is_null = column.is_null().to_numpy(zero_copy_only=False) if column.null_count else None
        values = (column if is_null is None else column.drop_null()).flatten()
        numbers, holes = _numbers(values)
        numbers = numbers.reshape(-1, count)
        if is_null is not None:
            kept = numbers
            numbers = np.zeros((len(column), count))
            numbers[~is_null] = kept
        if holes is not None:
            of_rows = np.zeros(len(column), bool) if is_null is None else is_null.copy()
            of_rows[np.ones(len(column), bool) if is_null is None else ~is_null] |= holes.reshape(-1, count).any(axis=1)
            is_null = of_rows
        return numbers, is_null

    def _of_struct(self, name, column):
        fields = [column.type.field(k).name for k in range(column.type.num_fields)]
        if fields != list(self.robot.joint_names):
            raise ValueError(f"`{name}` has the fields {fields}: {self.robot.name} has, in this order, {list(self.robot.joint_names)}")
        of_fields = [_numbers(field) for field in column.flatten()]
        masks = [holes for _, holes in of_fields if holes is not None]
        return np.stack([numbers for numbers, _ in of_fields], axis=1), np.logical_or.reduce(masks) if masks else None


def _is_list(kind):
    kinds = pa.types
    return kinds.is_list(kind) or kinds.is_large_list(kind) or kinds.is_fixed_size_list(kind)


def _numbers(values):
    """In double precision, not copied if they are; and which are null, if any."""
    holes = values.is_null().to_numpy(zero_copy_only=False) if values.null_count else None
    values = values.cast(pa.float64())
    return (values if holes is None else values.fill_null(0.0)).to_numpy(zero_copy_only=True), holes

"""Functions of Arrow's arrays beside those of NumPy's."""

import pickle
import unittest
from pathlib import Path

import numpy as np
import pyarrow as pa
import straightline_arrow

ROBOTS = Path(__file__).resolve().parents[3] / "robots" / "descriptions"
PANDA = straightline_arrow.load(ROBOTS / "panda.urdf")
ROWS = 1003
Q, QD, QDD, EFFORT = np.random.default_rng(7).uniform(-1.5, 1.5, (4, ROWS, 7))
LISTS = pa.list_(pa.float64())


def lists(numbers, kind=LISTS):
    return pa.array(numbers.tolist(), LISTS).cast(kind)


def table(found):
    return np.stack([found.field(k).to_numpy(zero_copy_only=False) for k in range(found.type.num_fields)], axis=1)


class Values(unittest.TestCase):
    def test_rows_are_those_of_numpy(self):
        robot = PANDA.robot
        for name, given, wanted in [
            ("inverse_dynamics", (Q, QD, QDD), robot.inverse_dynamics(Q, QD, QDD)),
            ("forward_dynamics", (Q, QD, EFFORT), robot.forward_dynamics(Q, QD, EFFORT)),
            ("gravity_force", (Q,), robot.gravity_force(Q)),
            ("bias_force", (Q, QD), robot.bias_force(Q, QD)),
            ("residual", (Q, QD, QDD, EFFORT), EFFORT - robot.inverse_dynamics(Q, QD, QDD)),
        ]:
            self.assertEqual(len(given), len(straightline_arrow.FUNCTIONS[name]))
            found = getattr(PANDA, name)(*map(lists, given))
            self.assertEqual(found.type, PANDA.type)
            np.testing.assert_array_equal(table(found), wanted, name)

    def test_lists_of_every_kind_are_taken(self):
        wanted = table(PANDA.gravity_force(lists(Q)))
        for kind in [pa.large_list(pa.float64()), pa.list_(pa.float64(), 7)]:
            np.testing.assert_array_equal(table(PANDA.gravity_force(lists(Q, kind))), wanted)
        parts = pa.chunked_array([lists(Q[:100]), lists(Q[100:])])
        np.testing.assert_array_equal(table(PANDA.gravity_force(parts)), wanted)
        np.testing.assert_array_equal(table(PANDA.gravity_force(lists(Q).slice(10, 20))), wanted[10:30])
        np.testing.assert_array_equal(table(PANDA.gravity_force(lists(Q, pa.list_(pa.float64(), 7)).slice(10, 20))), wanted[10:30])
        narrow = table(PANDA.gravity_force(lists(Q, pa.list_(pa.float32()))))
        np.testing.assert_array_equal(narrow, PANDA.robot.gravity_force(Q.astype(np.float32).astype(float)))

    def test_a_result_is_a_state_of_another_function(self):
        torques = PANDA.inverse_dynamics(lists(Q), lists(QD), lists(QDD))
        found = table(PANDA.forward_dynamics(lists(Q), lists(QD), torques))
        np.testing.assert_array_equal(found, PANDA.robot.forward_dynamics(Q, QD, table(torques)))

    def test_a_row_without_a_state_has_no_result(self):
        rows = Q.tolist()
        rows[17], rows[20][3] = None, None
        for kind in [LISTS, pa.large_list(pa.float64()), pa.list_(pa.float64(), 7)]:
            found = PANDA.inverse_dynamics(pa.array(rows, kind), lists(QD), lists(QDD))
            self.assertEqual([row for row, there in enumerate(found.is_valid().to_pylist()) if not there], [17, 20])
            self.assertEqual(found.field(4).null_count, 2)
            kept = np.delete(np.arange(ROWS), [17, 20])
            np.testing.assert_array_equal(table(found)[kept], PANDA.robot.inverse_dynamics(Q, QD, QDD)[kept])

    def test_lists_are_not_copied(self):
        given = lists(Q)
        numbers, _ = PANDA._states("q", given)
        self.assertEqual(numbers.ctypes.data, given.values.buffers()[1].address)

    def test_robots_come_back_from_other_processes(self):
        again = pickle.loads(pickle.dumps(PANDA))
        self.assertEqual(again.gravity_force(lists(Q)), PANDA.gravity_force(lists(Q)))


class Complaints(unittest.TestCase):
    def test_a_list_of_another_length_is_told_with_its_row(self):
        rows = Q.tolist()
        rows[5] = rows[5][:6]
        with self.assertRaisesRegex(ValueError, "`q` has 6 numbers in row 5 of its batch, panda takes 7"):
            PANDA.gravity_force(pa.array(rows))

    def test_what_has_no_numbers_is_refused(self):
        with self.assertRaisesRegex(TypeError, "`q` is of type double: it is a list"):
            PANDA.gravity_force(pa.array([1.0]))
        with self.assertRaisesRegex(ValueError, "`q` has the fields .*'a'.*panda_joint1"):
            PANDA.gravity_force(pa.array([{"a": 1.0}]))

    def test_a_robot_that_floats_is_refused(self):
        with self.assertRaisesRegex(ValueError, "joints of several coordinates"):
            straightline_arrow.load(ROBOTS / "panda.urdf", floating_base=True)


unittest.main()

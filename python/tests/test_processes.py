"""Other processes, other threads."""

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import unittest
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import straightline as sl
from helpers import PENDULUM, ROBOTS, panda, states


def torques(robot, q):
    return robot.inverse_dynamics(q, 0.0, 0.0, threads=2)


class Pickles(unittest.TestCase):
    def test_robots_come_back(self):
        scene = (ROBOTS.parent / "scenes" / "panda_locked_wrist.toml").read_text(encoding="utf-8")
        for robot in (
            sl.load(PENDULUM, gravity=np.array([0, 0, -1.62]), dtype=np.float32),
            sl.load(ROBOTS / "panda.urdf", frames=["panda_hand_tcp"], scene=scene),
        ):
            again = pickle.loads(pickle.dumps(robot))
            self.assertEqual(repr(again), repr(robot))
            self.assertEqual(again.frames, robot.frames)
            q = states(robot, 3)[0]
            np.testing.assert_array_equal(again.gravity_force(q), robot.gravity_force(q))

    def test_functions_and_results_come_back(self):
        robot = panda()
        q, qd, qdd = states(robot, 3)
        function = pickle.loads(pickle.dumps(robot.inverse_dynamics))
        np.testing.assert_array_equal(function(q, qd, qdd), robot.inverse_dynamics(q, qd, qdd))
        found = robot.inverse_dynamics_derivatives(q, qd, qdd)
        again = pickle.loads(pickle.dumps(found))
        self.assertEqual((type(again), again._fields), (type(found), found._fields))
        np.testing.assert_array_equal(again.h, found.h)


class Processes(unittest.TestCase):
    def test_forked_and_spawned_processes_compute_the_same(self):
        robot = panda()
        q = states(robot, 64)[0]
        # compiled before the fork, and threads have run
        expected = torques(robot, q)
        for method in multiprocessing.get_all_start_methods():
            with self.subTest(method), multiprocessing.get_context(method).Pool(2) as pool:
                for found in pool.starmap(torques, [(robot, q), (robot, q)]):
                    np.testing.assert_array_equal(found, expected)

    @unittest.skipUnless("fork" in multiprocessing.get_all_start_methods(), "no fork")
    def test_a_forked_process_compiles(self):
        robot = sl.load(PENDULUM)
        context = multiprocessing.get_context("fork")
        with context.Pool(1) as pool:
            np.testing.assert_array_equal(pool.apply(torques, (robot, 0.5)), torques(robot, 0.5))


    @unittest.skipUnless(hasattr(os, "fork"), "no fork")
    def test_a_child_compiles_that_is_forked_while_threads_compile(self):
        for _ in range(3):
            robot = sl.load(ROBOTS / "panda.urdf", frames=["panda_hand_tcp"], cache=False)
            names = ("inverse_dynamics_derivatives", "forward_dynamics_derivatives", "mass_matrix")
            threads = [threading.Thread(target=lambda name=name: robot.cost[name]) for name in names]
            for thread in threads:
                thread.start()
            # they hold the lock by now
            time.sleep(0.02)
            child = os.fork()
            if child == 0:
                status = 1
                try:
                    status = 0 if len(robot.gravity_force(np.zeros(7))) == 7 else 1
                finally:
                    os._exit(status)
            status = _ended(child, seconds=60)
            for thread in threads:
                thread.join()
            self.assertEqual(status, 0, "it waits for ever" if status is None else "it fails")


def _ended(child, seconds):
    """How a child has ended, or None; it does not run any more."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


class Threads(unittest.TestCase):
    def test_a_function_is_compiled_once_by_many_threads(self):
        robot = sl.load(ROBOTS / "ur5.urdf", allow=["warnings"])
        q, qd, qdd = states(robot, 50)
        with ThreadPoolExecutor(8) as pool:
            calls = [pool.submit(robot.inverse_dynamics, q, qd, qdd) for _ in range(32)]
            calls += [pool.submit(robot.mass_matrix, q) for _ in range(8)]
            found = [call.result() for call in calls]
        for tau in found[:32]:
            np.testing.assert_array_equal(tau, robot.inverse_dynamics(q, qd, qdd))

    def test_others_run_meanwhile(self):
        robot = panda()
        q, qd, qdd = states(robot, 200_000)
        robot.inverse_dynamics(q[:1], qd[:1], qdd[:1])
        counted, stop = [0], threading.Event()

        def count():
            while not stop.is_set():
                counted[0] += 1
                time.sleep(0)

        interval = sys.getswitchinterval()
        # who holds the interpreter keeps it
        sys.setswitchinterval(60)
        thread = threading.Thread(target=count)
        try:
            thread.start()
            while counted[0] == 0:
                time.sleep(1e-4)
            before = counted[0]
            robot.inverse_dynamics(q, qd, qdd)
            during = counted[0] - before
        finally:
            stop.set()
            thread.join()
            sys.setswitchinterval(interval)
        self.assertGreater(during, 10)


if __name__ == "__main__":
    unittest.main()

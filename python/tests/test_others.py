"""Beside other libraries, where they are installed."""

import importlib.util
import unittest

import numpy as np
import straightline as sl
from helpers import ROBOTS, panda, states, ur5


def compare(case, name, found, expected, scale, within=1e-12):
    error = np.abs(np.asarray(found) - expected).max() / scale
    case.assertLess(error, within, f"{name}: {error:.1e} of {scale:.1e}")


@unittest.skipUnless(importlib.util.find_spec("pinocchio"), "skipped: Pinocchio is not installed")
class Pinocchio(unittest.TestCase):
    def test_dynamics_agree(self):
        import pinocchio as pin

        for name, floating in [("panda", False), ("ur5", False), ("solo12", True)]:
            path = ROBOTS / f"{name}.urdf"
            robot = sl.load(path, floating_base=floating, allow=["warnings"])
            base = [pin.JointModelFreeFlyer()] if floating else []
            model = pin.buildModelFromUrdf(str(path), *base)
            data = model.createData()
            random = np.random.default_rng(11)
            for _ in range(20):
                q = pin.integrate(model, pin.neutral(model), random.uniform(-1, 1, model.nv))
                qd, qdd = random.uniform(-1, 1, (2, model.nv))
                tau = pin.rnea(model, data, q, qd, qdd)
                mass = pin.crba(model, data, q)
                mass = np.triu(mass) + np.triu(mass, 1).T
                with self.subTest(name):
                    compare(self, "inverse dynamics", robot.inverse_dynamics(q, qd, qdd), tau, np.abs(tau).max())
                    compare(self, "mass matrix", robot.mass_matrix(q), mass, np.abs(mass).max())
                    found = robot.forward_dynamics(q, qd, tau)
                    condition = np.linalg.cond(mass)
                    scale = max(np.abs(qdd).max(), condition * 1e-2)
                    compare(self, "forward dynamics", found, pin.aba(model, data, q, qd, tau), scale)

    def test_derivatives_agree(self):
        import pinocchio as pin

        model = pin.buildModelFromUrdf(str(ROBOTS / "panda.urdf"))
        data = model.createData()
        q, qd, qdd = states(panda())
        found = panda().inverse_dynamics_derivatives(q, qd, qdd)
        dtau_dq, dtau_dqd, _ = pin.computeRNEADerivatives(model, data, q, qd, qdd)
        compare(self, "by q", found.dtau_dq, dtau_dq, np.abs(dtau_dq).max())
        compare(self, "by qd", found.dtau_dqd, dtau_dqd, np.abs(dtau_dqd).max())


@unittest.skipUnless(importlib.util.find_spec("mujoco"), "skipped: MuJoCo is not installed")
class Mujoco(unittest.TestCase):
    def test_dynamics_agree(self):
        import mujoco

        # MuJoCo bounds inertias of links from below unless told otherwise
        head = '<mujoco><compiler boundinertia="0" boundmass="0" balanceinertia="false" discardvisual="true" fusestatic="false"/></mujoco>'
        text = (ROBOTS / "ur5.urdf").read_text(encoding="utf-8")
        at = text.index(">", text.index("<robot")) + 1
        model = mujoco.MjModel.from_xml_string(text[:at] + head + text[at:])
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        data = mujoco.MjData(model)
        robot = ur5()
        random = np.random.default_rng(5)
        for _ in range(20):
            data.qpos[:], data.qvel[:], qdd = random.uniform(-1, 1, (3, model.nv))
            data.qacc[:] = qdd
            mujoco.mj_inverse(model, data)
            tau = data.qfrc_inverse.copy()
            mass = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, mass)
            q, qd = data.qpos.copy(), data.qvel.copy()
            compare(self, "inverse dynamics", robot.inverse_dynamics(q, qd, qdd), tau, np.abs(tau).max())
            compare(self, "mass matrix", robot.mass_matrix(q), mass, np.abs(mass).max())
            data.qfrc_applied[:] = tau
            mujoco.mj_forward(model, data)
            found = robot.forward_dynamics(q, qd, tau)
            compare(self, "forward dynamics", found, data.qacc, max(1.0, np.linalg.cond(mass) * 1e-2))


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""Robots of public packages beside MuJoCo and Pinocchio: H, bias forces and inverse dynamics of exported C.

Every MJCF that `straightline check` reads is compared with MuJoCo, contacts and limits off, damping and springs on; every URDF with
Pinocchio, whose joints all have coordinates: those that follow others are moved with them, tau = G^T tau_full. Loops, couplings by tendons, and
joints that one of both reads in another way are counted as not compared, with the reason.

    generated_tests/zoo/compare.py --work FOLDER --straightline target/release/straightline > table.md

Needs numpy, mujoco and pin from PyPI, and gcc.
"""

import argparse
import collections
import ctypes
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

from run import PACKAGES, SECONDS, is_robot, unpacked

FUNCTIONS = ["mass_matrix", "bias_force", "inverse_dynamics"]
STATES = 5
# dry friction is a constraint of MuJoCo, and Pinocchio has none; it has no damping either
SCENES = {"mjcf": '[effects]\ncoulomb = "off"\n', "urdf": '[effects]\ncoulomb = "off"\ndamping = false\n'}


class NotCompared(Exception):
    """Why a robot is not compared."""


class Ours:
    """Functions of exported C."""

    def __init__(self, path: pathlib.Path, kind: str, straightline: str, folder: pathlib.Path):
        scene = folder / "scene.toml"
        scene.write_text(SCENES[kind])
        command = [straightline, "export", str(path), "--c99", "--prefix", "r", "-o", str(folder / "c"), "--scene", str(scene)]
        for function in FUNCTIONS:
            command += ["--function", function]
        try:
            made = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            raise NotCompared("not exported in time") from None
        if made.returncode:
            codes = sorted(set(re.findall(r"^error\[([a-z0-9-]+)\]", made.stderr, flags=re.M)))
            raise NotCompared("refused: " + (", ".join(codes) or "without a code"))
        source = next((folder / "c").glob("*.c"))
        library = folder / "r.so"
        subprocess.run(["gcc", "-O0", "-ffp-contract=off", "-shared", "-fPIC", "-o", str(library), str(source), "-lm"], check=True)
        self.library = ctypes.CDLL(str(library))
        self.nq, self.nv = self.library.r_nq(), self.library.r_nv()
        header = source.with_suffix(".h").read_text()
        # index, first velocity, name, kind
        self.joints = re.findall(r"^ \*\s+(\d+)\s+(\d+)\s+(\S+), (\w+)", header.split("Frames:")[0], flags=re.M)

    def of(self, function: str, *inputs: np.ndarray, size: int) -> np.ndarray:
        result = np.zeros(size)
        arrays = [np.ascontiguousarray(x, float) for x in inputs] + [result]
        pointers = [x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for x in arrays]
        getattr(self.library, f"r_{function}")(*pointers)
        return result


def errors(ours: Ours, q: np.ndarray, v: np.ndarray, a: np.ndarray, h: np.ndarray, bias: np.ndarray) -> dict[str, float]:
    """How far results are from those of the other program, of the greatest entry; of H, of the roots of its diagonal."""
    nv = ours.nv
    own = ours.of("mass_matrix", q, size=nv * nv).reshape(nv, nv)
    scale = np.sqrt(np.maximum(np.diag(h), 1e-300))
    tau = h @ a + bias
    size = max(abs(tau).max(), abs(h @ a).max(), abs(bias).max())
    return {
        "H": (abs(own - h) / np.outer(scale, scale)).max(),
        "bias": abs(ours.of("bias_force", q, v, size=nv) - bias).max() / size,
        "inverse": abs(ours.of("inverse_dynamics", q, v, a, size=nv) - tau).max() / size,
    }


def unit(random: np.random.Generator) -> np.ndarray:
    q = random.normal(size=4)
    return q / np.linalg.norm(q)


def beside_mujoco(ours: Ours, path: pathlib.Path) -> dict[str, float]:
    import mujoco

    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise NotCompared(f"not read by MuJoCo: {str(error).splitlines()[0][:60]}") from None
    hinge, slide, free_joint = (int(getattr(mujoco.mjtJoint, f"mjJNT_{name}")) for name in ("HINGE", "SLIDE", "FREE"))
    connects, follows = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_JOINT)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    if any(int(kind) == connects and active for kind, active in zip(model.eq_type, model.eq_active0)):
        raise NotCompared("loops")
    followers = {}
    for e in range(model.neq):
        if model.eq_active0[e] and int(model.eq_type[e]) == follows and model.eq_obj2id[e] >= 0:
            followers[int(model.eq_obj1id[e])] = (int(model.eq_obj2id[e]), *model.eq_data[e][:2])
    named = {model.joint(j).name: j for j in range(model.njnt) if model.joint(j).name}
    free = [j for j in range(model.njnt) if int(model.jnt_type[j]) == free_joint]
    order = [j for j in range(model.njnt) if j not in followers]
    if len(order) == len(ours.joints):
        joints = order
    else:
        joints = [named.get(name, free[0] if kind == "floating" and len(free) == 1 else None) for _, _, name, kind in ours.joints]
    if None in joints:
        raise NotCompared("joints without names among bodies that are left out, or couplings by tendons")
    random, worst = np.random.default_rng(7), collections.defaultdict(float)
    for _ in range(STATES):
        q, qpos = [], model.qpos0.copy()
        motion, convective = np.zeros((model.nv, ours.nv)), np.zeros(model.nv)
        v, a = random.normal(size=ours.nv), random.normal(size=ours.nv)
        at = 0
        for j in joints:
            place, rate = model.jnt_qposadr[j], model.jnt_dofadr[j]
            kind = int(model.jnt_type[j])
            if kind in (hinge, slide):
                qpos[place] = random.uniform(-1, 1)
                q.append(qpos[place])
                motion[rate, at] = 1
                at += 1
                continue
            if kind == free_joint:
                qpos[place : place + 3] = random.normal(size=3)
                q += [*qpos[place : place + 3]]
                place += 3
            w, x, y, z = qpos[place : place + 4] = unit(random)
            q += [x, y, z, w]
            if kind == free_joint:
                # velocities of the base along its own axes
                rotation = np.zeros(9)
                mujoco.mju_quat2Mat(rotation, qpos[place : place + 4])
                rotation = rotation.reshape(3, 3)
                motion[rate : rate + 3, at : at + 3] = rotation
                convective[rate : rate + 3] = rotation @ np.cross(v[at + 3 : at + 6], v[at : at + 3])
                rate, at = rate + 3, at + 3
            motion[rate : rate + 3, at : at + 3] = np.eye(3)
            at += 3
        if at != ours.nv or len(q) != ours.nq:
            raise NotCompared("other joints are dependent")

        def follow(j: int) -> None:
            if j in followers:
                source, offset, ratio = followers[j]
                follow(source)
                own, other = model.jnt_qposadr[j], model.jnt_qposadr[source]
                qpos[own] = model.qpos0[own] + offset + ratio * (qpos[other] - model.qpos0[other])
                motion[model.jnt_dofadr[j]] = ratio * motion[model.jnt_dofadr[source]]

        for j in followers:
            follow(j)
        data.qpos[:], data.qvel[:] = qpos, motion @ v
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        bias = motion.T @ (data.qfrc_bias - data.qfrc_passive + full @ convective)
        for what, error in errors(ours, np.array(q), v, a, motion.T @ full @ motion, bias).items():
            worst[what] = max(worst[what], error)
    return worst


def beside_pinocchio(ours: Ours, path: pathlib.Path) -> dict[str, float]:
    import pinocchio

    text = path.read_text(errors="replace")
    try:
        model = pinocchio.buildModelFromXML(text)
    except Exception as error:  # noqa: BLE001: whatever it says, it reads no robot
        raise NotCompared(f"not read by Pinocchio: {str(error).splitlines()[0][:60]}") from None
    data = model.createData()
    mimics = {}
    for joint in ElementTree.fromstring(text).iter("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            mimics[joint.get("name")] = (mimic.get("joint"), float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0)))
    random, worst = np.random.default_rng(7), collections.defaultdict(float)
    for _ in range(STATES):
        q, place = np.zeros(ours.nq), {}
        for k, (_, _, name, kind) in enumerate(ours.joints):
            if kind not in ("revolute", "prismatic", "continuous") or not model.existJointName(name):
                raise NotCompared(f"a joint of kind {kind}")
            place[name] = k
        if len(ours.joints) != ours.nv:
            raise NotCompared("joints of several coordinates")
        q[:] = random.uniform(-1, 1, size=ours.nq)
        v, a = random.normal(size=ours.nv), random.normal(size=ours.nv)
        full, motion = pinocchio.neutral(model), np.zeros((model.nv, ours.nv))

        def along(name: str) -> tuple[float, np.ndarray]:
            if name in place:
                return q[place[name]], np.eye(ours.nv)[place[name]]
            if name not in mimics:
                raise NotCompared(f"joint `{name}` is not ours")
            source, ratio, offset = mimics[name]
            x, row = along(source)
            return ratio * x + offset, ratio * row

        for j in range(1, model.njoints):
            joint = model.joints[j]
            x, row = along(model.names[j])
            if joint.nq == 2:
                full[joint.idx_q : joint.idx_q + 2] = np.cos(x), np.sin(x)
            elif joint.nq == 1:
                full[joint.idx_q] = x
            else:
                raise NotCompared("joints of several coordinates")
            motion[joint.idx_v] = row
        h = pinocchio.crba(model, data, full)
        h = np.triu(h) + np.triu(h, 1).T
        bias = pinocchio.rnea(model, data, full, motion @ v, np.zeros(model.nv))
        for what, error in errors(ours, q, v, a, motion.T @ h @ motion, motion.T @ bias).items():
            worst[what] = max(worst[what], error)
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--straightline", required=True)
    given = parser.parse_args()
    print("| files | package | compared | H | bias | inverse | not compared |\n|---|---|---|---|---|---|---|")
    for kind, beside in (("mjcf", beside_mujoco), ("urdf", beside_pinocchio)):
        for package in PACKAGES[kind]:
            folder = unpacked(package, given.work)
            worst, reasons, compared = collections.defaultdict(float), collections.Counter(), 0
            for path in sorted(p for p in folder.rglob("*") if p.is_file() and is_robot(p, kind)):
                with tempfile.TemporaryDirectory() as scratch:
                    try:
                        found = beside(Ours(path, kind, given.straightline, pathlib.Path(scratch)), path)
                    except NotCompared as why:
                        reasons[str(why)] += 1
                        continue
                compared += 1
                for what, error in found.items():
                    worst[what] = max(worst[what], error)
                print(f"{path.relative_to(given.work)}: " + ", ".join(f"{k} {x:.1e}" for k, x in found.items()), file=sys.stderr, flush=True)
            left = "; ".join(f"{count} × {why}" for why, count in sorted(reasons.items())) or "none"
            row = " | ".join(f"{worst[what]:.1e}" for what in ("H", "bias", "inverse"))
            print(f"| {kind.upper()} | {package} | {compared} | {row} | {left} |", flush=True)


if __name__ == "__main__":
    main()

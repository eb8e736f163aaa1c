#!/usr/bin/env python3
"""Robots of public packages beside other programs: H, bias forces and inverse dynamics of exported C.

    generated_tests/zoo/compare.py WHAT.. --work FOLDER --straightline target/release/straightline > table.md

mjcf       every MJCF beside MuJoCo, contacts and limits off, damping and springs on, with the masses of bodies
urdf       every URDF beside Pinocchio, whose joints all have coordinates: those that follow others move with them, tau = G^T tau_full
mimic      every URDF with joints that follow others beside Pinocchio with `mimic=True`, with forward dynamics
converted  every URDF written as MJCF by `straightline convert`, read by MuJoCo, beside ours of the URDF; every MJCF as URDF beside Pinocchio
saved      every URDF that MuJoCo reads and saves as MJCF, with all digits: ours of both
pairs      robots of which packages have a URDF and an MJCF, ours of both, with the number that differs most
drake      every SDF, SDFs that `straightline convert` writes of URDFs and MJCFs, URDFs and MJCFs beside Drake, which computes H of all joints
drawn      SDFs drawn at random beside Drake

Loops, couplings by tendons, and joints that one of both reads in another way are counted as not compared, with the reason.
Needs numpy and gcc, and mujoco, pin and drake from PyPI for what is asked.
"""

import argparse
import collections
import ctypes
import functools
import multiprocessing
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from run import PACKAGES, SECONDS, is_robot, unpacked

FUNCTIONS = ["mass_matrix", "bias_force", "inverse_dynamics"]
STATES = 5
# robots that are drawn at random
DRAWN = 200
# what `export --optimise` takes
OPTIMISE = "full"
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
# dry friction is a constraint of MuJoCo, and the others have none; Pinocchio has no damping; of MJCF Drake reads no
# springs, and an armature only where there is a motor
NO_FRICTION = '[effects]\ncoulomb = "off"\n'
NO_DAMPING = NO_FRICTION + "damping = false\n"
DAMPING_ALONE = NO_FRICTION + "springs = false\nrotor_inertia = false\n"
INERTIAS_ONLY = NO_DAMPING + "springs = false\nrotor_inertia = false\n"
# URDF of example-robot-data or synriard, MJCF of another package or of synriard
PAIRS = [
    ("b1_description/urdf/b1.urdf", "robosuite_models/assets/robots/b1/robot.xml"),
    ("g1_description/urdf/g1_29dof_rev_1_0.urdf", "robosuite_models/assets/robots/g1/robot.xml"),
    ("go2_description/urdf/go2.urdf", "robosuite_models/assets/robots/go2/robot.xml"),
    ("z1_description/urdf/z1.urdf", "robosuite_models/assets/robots/z1/robot.xml"),
    ("pr2_description/urdf/pr2.urdf", "robosuite_models/assets/robots/pr2/robot.xml"),
    ("kinova_description/robots/kinova.urdf", "dm_control/third_party/kinova/jaco_arm.xml"),
]


class NotCompared(Exception):
    """Why a robot is not compared."""


class State(NamedTuple):
    """A state and what the other program says of it, in our coordinates."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    h: np.ndarray
    bias: np.ndarray


class Ours:
    """Functions of exported C."""

    def __init__(self, path: pathlib.Path, scene: str, straightline: str, folder: pathlib.Path, *more: str):
        self.path, self.straightline, self.folder = path, straightline, folder
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "scene.toml").write_text(scene)
        command = ["export", str(path), "--c99", "--prefix", "r", "-o", str(folder / "c"), "--scene", str(folder / "scene.toml")]
        command += ["--optimise", OPTIMISE]
        for function in FUNCTIONS:
            command += ["--function", function]
        run(straightline, *command, *more)
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

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        return self.of("mass_matrix", q, size=self.nv**2).reshape(self.nv, self.nv)


def run(straightline: str, *command: str) -> None:
    try:
        made = subprocess.run([straightline, *command], capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise NotCompared(f"no {command[0]} in time") from None
    if made.returncode:
        codes = sorted(set(re.findall(r"^error\[([a-z0-9-]+)\]", made.stderr, flags=re.M)))
        raise NotCompared("refused: " + (", ".join(codes) or "without a code"))


def write(path: pathlib.Path, ending: str, straightline: str, folder: pathlib.Path) -> pathlib.Path:
    """The robot in another format, less what that cannot say."""
    written = folder / f"converted.{ending}"
    run(straightline, "convert", "-q", "--lossy", str(path), str(written))
    return written


def errors(ours: Ours, at: State) -> dict[str, float]:
    """How far results are from those of the other program, of the greatest entry; of H, of the roots of its diagonal."""
    scale = np.sqrt(np.maximum(np.diag(at.h), 1e-300))
    tau = at.h @ at.a + at.bias
    size = max(abs(tau).max(), abs(at.h @ at.a).max(), abs(at.bias).max())
    return {
        "H": (abs(ours.mass_matrix(at.q) - at.h) / np.outer(scale, scale)).max(),
        "bias": abs(ours.of("bias_force", at.q, at.v, size=ours.nv) - at.bias).max() / size,
        "inverse": abs(ours.of("inverse_dynamics", at.q, at.v, at.a, size=ours.nv) - tau).max() / size,
    }


def greatest(found: Iterator[dict[str, float]]) -> dict[str, float]:
    worst = collections.defaultdict(float)
    for errors_of_state in found:
        for what, error in errors_of_state.items():
            worst[what] = max(worst[what], error)
    return worst


def unit(dice: np.random.Generator) -> np.ndarray:
    q = dice.normal(size=4)
    return q / np.linalg.norm(q)


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """The matrix of w, x, y, z."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:60]


def mujoco_states(ours: Ours, path: pathlib.Path) -> Iterator[State]:
    import mujoco

    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise NotCompared(f"not read by MuJoCo: {first_line(error)}") from None
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
    names = {name for _, _, name, _ in ours.joints}
    for e in np.flatnonzero(model.eq_active0 & (model.eq_type == int(mujoco.mjtEq.mjEQ_TENDON)) & (model.eq_obj2id < 0)):
        # a tendon over two joints has one length: the joint that ours has not follows the other one
        first, count = model.tendon_adr[model.eq_obj1id[e]], model.tendon_num[model.eq_obj1id[e]]
        over = sorted(range(first, first + count), key=lambda w: model.joint(model.wrap_objid[w]).name in names)
        if count == 2 and all(int(model.wrap_type[w]) == int(mujoco.mjtWrap.mjWRAP_JOINT) for w in over):
            follower, source = (int(model.wrap_objid[w]) for w in over)
            coefficients = [model.wrap_prm[w] for w in over]
            followers[follower] = (source, model.eq_data[e][0] / coefficients[0], -coefficients[1] / coefficients[0])
    named = {model.joint(j).name: j for j in range(model.njnt) if model.joint(j).name}
    free = [j for j in range(model.njnt) if int(model.jnt_type[j]) == free_joint]
    order = [j for j in range(model.njnt) if j not in followers]
    if len(order) == len(ours.joints):
        joints = order
    else:
        joints = [named.get(name, free[0] if kind == "floating" and len(free) == 1 else None) for _, _, name, kind in ours.joints]
    if None in joints:
        raise NotCompared("joints without names among bodies that are left out, or couplings by tendons")
    dice = np.random.default_rng(7)
    for _ in range(STATES):
        q, qpos = [], model.qpos0.copy()
        motion, convective = np.zeros((model.nv, ours.nv)), np.zeros(model.nv)
        v, a = dice.normal(size=ours.nv), dice.normal(size=ours.nv)
        at = 0
        for j in joints:
            place, rate = model.jnt_qposadr[j], model.jnt_dofadr[j]
            kind = int(model.jnt_type[j])
            if kind in (hinge, slide):
                qpos[place] = dice.uniform(-1, 1)
                q.append(qpos[place])
                motion[rate, at] = 1
                at += 1
                continue
            if kind == free_joint:
                qpos[place : place + 3] = dice.normal(size=3)
                q += [*qpos[place : place + 3]]
                place += 3
            w, x, y, z = qpos[place : place + 4] = unit(dice)
            q += [x, y, z, w]
            if kind == free_joint:
                # velocities of the base along its own axes
                turned = rotation(qpos[place : place + 4])
                motion[rate : rate + 3, at : at + 3] = turned
                convective[rate : rate + 3] = turned @ np.cross(v[at + 3 : at + 6], v[at : at + 3])
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
        yield State(np.array(q), v, a, motion.T @ full @ motion, bias)


def masses(path: pathlib.Path, straightline: str, folder: pathlib.Path) -> dict[str, float]:
    """How far masses of bodies with names are from those of MuJoCo, of the greatest one; ours as `convert` writes them."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    links = {}
    for link in ElementTree.parse(write(path, "urdf", straightline, folder)).getroot().iter("link"):
        mass = link.find("inertial/mass")
        links[link.get("name")] = float(mass.get("value")) if mass is not None else 0
    theirs = {model.body(b).name: model.body_mass[b] for b in range(1, model.nbody)}
    off = [abs(links[name] - mass) for name, mass in theirs.items() if name in links]
    return {"masses": max(off) / max(theirs.values())} if off else {}


def mimics(path: pathlib.Path) -> dict[str, tuple[str, float, float]]:
    """Joints of a URDF or SDF that follow others: the leader, a ratio and an offset."""
    found = {}
    for joint in ElementTree.parse(path).getroot().iter("joint"):
        for mimic in joint.iter("mimic"):
            told = {"multiplier": 1.0, "offset": 0.0, "reference": 0.0}
            for key in told:
                told[key] = float(mimic.get(key, mimic.findtext(key, told[key])))
            offset = told["offset"] - told["multiplier"] * told["reference"]
            found[joint.get("name")] = (mimic.get("joint"), told["multiplier"], offset)
    return found


def along(name: str, places: dict[str, int], q: np.ndarray, followers: dict) -> tuple[float, np.ndarray]:
    """The coordinate of a joint and its row of G."""
    if name in places:
        return q[places[name]], np.eye(len(q))[places[name]]
    if name not in followers:
        raise NotCompared(f"joint `{name}` is not ours")
    source, ratio, offset = followers[name]
    x, row = along(source, places, q, followers)
    return ratio * x + offset, ratio * row


def pinocchio_states(ours: Ours, path: pathlib.Path, mimic: bool = False) -> Iterator[State]:
    import pinocchio

    try:
        model = pinocchio.buildModelFromXML(path.read_text(errors="replace"), mimic=mimic)
    except Exception as error:  # noqa: BLE001: whatever it says, it reads no robot
        raise NotCompared(f"not read by Pinocchio: {first_line(error)}") from None
    data, followers, places = model.createData(), mimics(path), {}
    for k, (_, _, name, kind) in enumerate(ours.joints):
        if kind not in ("revolute", "prismatic", "continuous") or not model.existJointName(name):
            raise NotCompared(f"a joint of kind {kind}")
        places[name] = k
    if len(ours.joints) != ours.nv:
        raise NotCompared("joints of several coordinates")
    dice = np.random.default_rng(7)
    for _ in range(STATES):
        q = dice.uniform(-1, 1, size=ours.nq)
        v, a = dice.normal(size=ours.nv), dice.normal(size=ours.nv)
        full, motion = pinocchio.neutral(model), np.zeros((model.nv, ours.nv))
        for j in range(1, model.njoints):
            joint = model.joints[j]
            if mimic and model.names[j] in followers:
                continue
            x, row = along(model.names[j], places, q, followers)
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
        yield State(q, v, a, motion.T @ h @ motion, motion.T @ bias)


def forward_error(ours: Ours, at: State) -> float:
    """How far q̈ is from the solution of H q̈ = tau - bias of the other program."""
    tau = at.h @ at.a + at.bias
    theirs = np.linalg.solve(at.h, tau - at.bias)
    return abs(ours.of("forward_dynamics", at.q, at.v, tau, size=ours.nv) - theirs).max() / abs(theirs).max()



def drake_plant(path: pathlib.Path):
    """The robot as Drake reads it, with gravity as the file says; the root link of a URDF stands in the world."""
    import logging

    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import BodyIndex

    warned = []
    log = logging.getLogger("drake")
    log.handlers, log.propagate = [logging.Handler()], False
    log.handlers[0].emit = lambda record: warned.append(record.getMessage())
    plant = MultibodyPlant(0.0)
    root = ElementTree.parse(path).getroot()
    try:
        if path.suffix == ".xml" and not root.get("model"):
            root.set("model", "robot")
            Parser(plant).AddModelsFromString(ElementTree.tostring(root, encoding="unicode"), "xml")
        else:
            Parser(plant).AddModels(str(path))
        moved = {int(plant.get_joint(j).child_body().index()) for j in plant.GetJointIndices()}
        for b in range(1, plant.num_bodies()):
            if path.suffix == ".urdf" and b not in moved:
                plant.WeldFrames(plant.world_frame(), plant.get_body(BodyIndex(b)).body_frame())
        plant.Finalize()
    except (RuntimeError, ValueError) as error:
        raise NotCompared(f"not read by Drake: {without_place(error, path)}") from None
    if any("CouldBePhysicallyValid" in said for said in warned):
        raise NotCompared("inertias that no body has, of which Drake makes others")
    if any(map(without_mass, root.iter("inertial"))):
        raise NotCompared("inertias without mass, of which Drake makes 1 kg")
    if any("'settotalmass'" in said for said in warned):
        raise NotCompared("`settotalmass`, which Drake leaves out")
    if path.suffix == ".xml":
        for k in plant.GetJointActuatorIndices():
            plant.get_joint_actuator(k).set_default_rotor_inertia(0)
    turned = {"quat", "euler", "axisangle", "xyaxes", "zaxis"}
    if any(len(body.findall("joint")) > 1 and turned & body.attrib.keys() for body in root.iter("body")):
        raise NotCompared("turned bodies with several joints, whose axes Drake turns back")
    world, option = root.find("world"), root.find("option[@gravity]")
    gravity = option.get("gravity") if option is not None else None
    if root.find("option/flag[@gravity='disable']") is not None:
        gravity = "0 0 0"
    if world is not None:
        gravity = world.findtext("gravity", "0 0 -9.8")
    if gravity is not None:
        plant.mutable_gravity_field().set_gravity_vector([float(x) for x in gravity.split()])
    return plant


def without_mass(inertial: ElementTree.Element) -> bool:
    """Whether something turns that has no mass."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None or float(mass.get("value", mass.text or 1)) != 0:
        return False
    return any(float(x) != 0 for x in [*inertia.attrib.values(), *(entry.text for entry in inertia)])


def without_place(error: Exception, path: pathlib.Path) -> str:
    """What is wrong, without file, line and names."""
    said = re.sub(r"^.*?error: (ERROR: )?|(?<= )/\S+", "", str(error).splitlines()[0])
    return re.sub(r"\s+", " ", re.sub(r"'[^']*'|\"[^\"]*\"|\[[^]]*\]|" + re.escape(str(path)), "…", said))[:90]


def drake_states(ours: Ours, path: pathlib.Path) -> Iterator[State]:
    from pydrake.math import RollPitchYaw, RotationMatrix
    from pydrake.multibody.tree import MultibodyForces

    plant = drake_plant(path)
    followers, moving = mimics(path), {}
    for j in plant.GetJointIndices():
        joint = plant.get_joint(j)
        if joint.num_velocities() and not joint.type_name().endswith("floating"):
            if joint.name() in moving:
                raise NotCompared("two joints of one name")
            moving[joint.name()] = joint
    bases = [plant.get_body(b) for b in plant.GetFloatingBaseBodies()]
    # ours and, of Drake, a joint and a coordinate of it, or a base
    found = []
    for _, _, name, kind in ours.joints:
        name = name.split("::")[-1]
        axis = re.fullmatch(r"(.+)_([12])", name)
        if kind == "floating":
            if len(bases) != 1:
                raise NotCompared("one base floats of ours, several of Drake's" if bases else "no base of Drake's floats")
            found.append((name, kind, bases[0], 0))
        elif name in moving:
            found.append((name, kind, moving[name], 0))
        elif axis and moving.get(axis[1]) is not None and moving[axis[1]].type_name() == "universal":
            found.append((name, kind, moving[axis[1]], int(axis[2]) - 1))
        else:
            raise NotCompared("joints have other names")
    if bases and not any(kind == "floating" for _, kind, _, _ in found):
        raise NotCompared("a base of Drake's floats")
    context, dice = plant.CreateDefaultContext(), np.random.default_rng(7)
    for _ in range(STATES):
        v, a = dice.normal(size=ours.nv), dice.normal(size=ours.nv)
        motion, convective = np.zeros((plant.num_velocities(), ours.nv)), np.zeros(plant.num_velocities())
        full, q, at, places, rows = np.zeros(plant.num_positions()), [], 0, {}, {}
        for name, kind, theirs, k in found:
            if kind == "floating":
                place, rate = theirs.floating_positions_start(), theirs.floating_velocities_start_in_v()
                origin, w = dice.normal(size=3), unit(dice)
                full[place : place + 4], full[place + 4 : place + 7] = w, origin
                turned = rotation(w)
                q += [*origin, *w[1:], w[0]]
                # velocities of the base along its own axes, Drake's along the world's, rotation first
                motion[rate : rate + 3, at + 3 : at + 6] = turned
                motion[rate + 3 : rate + 6, at : at + 3] = turned
                convective[rate + 3 : rate + 6] = turned @ np.cross(v[at + 3 : at + 6], v[at : at + 3])
                at += 6
            elif theirs.type_name() == "ball_rpy":
                place, rate, w = theirs.position_start(), theirs.velocity_start(), unit(dice)
                turned = rotation(w)
                full[place : place + 3] = RollPitchYaw(RotationMatrix(turned)).vector()
                q += [*w[1:], w[0]]
                # of Drake along axes of the parent
                motion[rate : rate + 3, at : at + 3] = turned
                at += 3
            else:
                x = dice.uniform(-1, 1)
                q.append(x)
                full[theirs.position_start() + k] = x
                motion[theirs.velocity_start() + k, at] = 1
                places[name], rows[name] = x, motion[theirs.velocity_start() + k].copy()
                at += 1
        if at != ours.nv or len(q) != ours.nq:
            raise NotCompared("joints of other kinds")

        def follow(name: str) -> tuple[float, np.ndarray]:
            if name not in places:
                if name not in followers:
                    raise NotCompared("joints of Drake's are not ours")
                source, ratio, offset = followers[name]
                x, row = follow(source)
                places[name], rows[name] = ratio * x + offset, ratio * row
            return places[name], rows[name]

        for name, theirs in moving.items():
            if not motion[theirs.velocity_start()].any():
                full[theirs.position_start()], motion[theirs.velocity_start()] = follow(name)
        plant.SetPositions(context, full)
        plant.SetVelocities(context, motion @ v)
        h = plant.CalcMassMatrix(context)
        forces = MultibodyForces(plant)
        # gravity and damping
        plant.CalcForceElementsContribution(context, forces)
        bias = plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)
        yield State(np.array(q), v, a, motion.T @ h @ motion, motion.T @ (bias + h @ convective))


def drawn(seed: int) -> str:
    """An SDF with what its readers may take otherwise: poses in any frame, models in models, axes in any frame, all kinds of joints."""
    dice = random.Random(seed)

    def number(size: float = 1) -> float:
        return round(dice.uniform(-size, size), 3)

    def pose(*frames: str) -> str:
        frame = dice.choice(["", *(f' relative_to="{name}"' for name in frames)])
        place = f"{number(0.5)} {number(0.5)} {number(0.5)}"
        kind = dice.choice(["degrees", "quaternion", "radians"])
        if kind == "degrees":
            return f'<pose{frame} degrees="true">{place} {dice.choice([0, 90, 180, 33.5])} {dice.choice([0, 90, 20])} {number(180)}</pose>'
        if kind == "quaternion":
            w = np.array([dice.gauss(0, 1) for _ in range(4)])
            return f'<pose{frame} rotation_format="quat_xyzw">{place} {" ".join(map(str, w / np.linalg.norm(w)))}</pose>'
        return f"<pose{frame}>{place} {number(3)} {number(1.5)} {number(3)}</pose>"

    def link(name: str, placed: str) -> str:
        # five points of equal mass, so that there is such a body
        mass, points = round(dice.uniform(0.3, 3), 3), np.array([[dice.uniform(-0.2, 0.2) for _ in range(3)] for _ in range(5)])
        inertia = mass / 5 * sum(x @ x * np.eye(3) - np.outer(x, x) for x in points)
        entries = "".join(f"<i{'xyz'[i]}{'xyz'[j]}>{inertia[i, j]:.9g}</i{'xyz'[i]}{'xyz'[j]}>" for i in range(3) for j in range(i, 3))
        return f'<link name="{name}">{placed}<inertial>{pose()}<mass>{mass}</mass><inertia>{entries}</inertia></inertial></link>'

    parts, links, frames, leaders = [link("l0", pose())], ["l0"], ["l0"], []
    if dice.random() < 0.6:
        parts.append('<joint name="root" type="fixed"><parent>world</parent><child>l0</child></joint>')
    for i in range(1, dice.randint(3, 8)):
        parent = carrier = dice.choice(links)
        child = moved = f"l{i}"
        if dice.random() < 0.25:
            inside = link("inner", pose()) + f'<frame name="grip" attached_to="inner">{pose()}</frame>'
            placement = dice.choice(["", ' placement_frame="inner"', ' placement_frame="grip"'])
            parts.append(f'<model name="m{i}"{placement}>{pose(*frames)}{inside}</model>')
            child, moved = f"m{i}::inner", dice.choice([f"m{i}::inner", f"m{i}::grip"])
        else:
            parts.append(link(child, pose(*frames)))
        if dice.random() < 0.3:
            carrier = f"f{i}"
            parts.append(f'<frame name="{carrier}" attached_to="{parent}">{pose()}</frame>')
            frames.append(carrier)
        kind = dice.choice(["revolute", "revolute", "continuous", "prismatic", "ball", "universal", "screw", "fixed"])
        about = dice.choice(["", *(f' expressed_in="{name}"' for name in (parent, "__model__", child))])
        damping = dice.choice(["", f"<dynamics><damping>{round(dice.uniform(0, 1), 2)}</damping></dynamics>"])
        follows = ""
        if leaders and kind in ("revolute", "continuous", "prismatic") and dice.random() < 0.3:
            told = f"<multiplier>{number(2)}</multiplier><offset>{number()}</offset><reference>{number()}</reference>"
            follows = f'<mimic joint="{dice.choice(leaders)}">{told}</mimic>'
        axes = f"<axis><xyz{about}>{number()} {number()} {dice.choice([0.5, 1, -1])}</xyz>{damping}{follows}</axis>"
        if kind == "universal":
            axes = "<axis><xyz>0 0.6 0.8</xyz></axis><axis2><xyz>1 0 0</xyz></axis2>"
        elif kind == "screw":
            axes += f"<screw_thread_pitch>{number(0.2)}</screw_thread_pitch>"
        elif kind in ("ball", "fixed"):
            axes = ""
        elif not follows:
            leaders.append(f"j{i}")
        placed = dice.choice(["", pose(carrier)])
        parts.append(f'<joint name="j{i}" type="{kind}">{placed}<parent>{carrier}</parent><child>{moved}</child>{axes}</joint>')
        links.append(child)
        frames += [child, f"j{i}"]
    dice.shuffle(parts)
    robot = f'<model name="robot">{"".join(parts)}</model>'
    if dice.random() < 0.5:
        robot = f'<world name="hall"><gravity>{number()} {number()} -9.7</gravity>{robot}</world>'
    return f'<?xml version="1.0"?><sdf version="1.11">{robot}</sdf>'


def both_formats(urdf: pathlib.Path, mjcf: pathlib.Path, straightline: str, folder: pathlib.Path) -> dict[str, float | str]:
    """One robot by URDF and by MJCF, ours of both; joints that only one has stand at 0, none follows another."""
    scene = INERTIAS_ONLY + "couplings = false\n"
    read = {}
    for path in (urdf, mjcf):
        read[path] = Ours(path, scene, straightline, folder / path.suffix[1:])
    floats = read[mjcf].joints[0][3] == "floating"
    names = [[name for _, _, name, kind in read[path].joints if kind != "floating"] for path in (urdf, mjcf)]
    both = {spelt(name) for name in names[0]} & {spelt(name) for name in names[1]}
    by_order = len(both) < len(names[0]) == len(names[1])
    if not both and not by_order:
        raise NotCompared("joints of other names")
    for path, own in zip((urdf, mjcf), names):
        held = [] if by_order else [name for name in own if spelt(name) not in both]
        text = scene + "[hold]\njoints = {" + ", ".join(f'"{name}" = 0' for name in held) + "}\n" if held else scene
        more = ["--floating-base"] if floats and path is urdf else []
        read[path] = Ours(path, text, straightline, folder / f"{path.suffix[1:]}-held", *more)
    first, second = read[urdf], read[mjcf]
    if (first.nq, first.nv) != (second.nq, second.nv):
        raise NotCompared(f"{first.nv} and {second.nv} velocities")
    # coordinates of the URDF in the order of those of the MJCF
    base = 6 if floats else 0
    at = {spelt(name): int(v) for _, v, name, kind in second.joints if kind != "floating"}
    order = [*range(base)]
    for _, v, name, kind in first.joints:
        if kind != "floating":
            order.append(int(v) if by_order else at[spelt(name)])
    dice = np.random.default_rng(7)

    def states() -> Iterator[dict[str, float]]:
        for _ in range(STATES):
            q = dice.uniform(-1, 1, size=second.nq)
            if floats:
                q[3:7] = unit(dice)
            v, a = dice.normal(size=second.nv), dice.normal(size=second.nv)
            places = [*range(base + 1 if floats else 0), *(k + (second.nq - second.nv) for k in order[base:])]
            qu, back = q[places], np.argsort(order)
            h = first.mass_matrix(qu)[np.ix_(back, back)]
            bias = first.of("bias_force", qu, v[order], size=first.nv)[back]
            yield errors(second, State(q, v, a, h, bias))

    return {"joints": second.nv, **greatest(states()), "differs": differs(first, second, by_order)}


def saved_by_mujoco(urdf: pathlib.Path, folder: pathlib.Path) -> pathlib.Path:
    """The robot as MuJoCo reads it and saves it as MJCF, without meshes, with 17 digits."""
    import mujoco

    root = ElementTree.parse(urdf).getroot()
    for link in root.iter("link"):
        for shape in [child for child in link if child.tag in ("visual", "collision")]:
            link.remove(shape)
    for other in root.findall("mujoco"):
        root.remove(other)
    try:
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        spec.compile()
    except ValueError as error:
        raise NotCompared(f"not read by MuJoCo: {first_line(error)}") from None
    # six digits else
    library = next(pathlib.Path(mujoco.__file__).parent.glob("libmujoco.*"))
    getattr(ctypes.CDLL(str(library)), "_mjPRIVATE__set_xml_precision")(17)
    saved = folder / "saved.xml"
    saved.write_text(spec.to_xml())
    return saved


def spelt(name: str) -> str:
    """A name as both files spell it."""
    return re.sub(r"(_leg)?_joint$|[^a-z0-9]", "", name.lower())


def differs(first: Ours, second: Ours, by_order: bool) -> str:
    """What the files say otherwise: per quantity the joint and the entry that differ most, all at q = 0 in the world's axes."""
    import pinocchio

    told = []
    for ours in (first, second):
        root = ElementTree.parse(write(ours.path, "urdf", ours.straightline, ours.folder)).getroot()
        for joint in root.iter("joint"):
            # urdfdom wants what it does not use here
            limit = joint.find("limit")
            limit = ElementTree.SubElement(joint, "limit") if limit is None else limit
            limit.attrib.update(effort="1", velocity="1")
        text = ElementTree.tostring(root, encoding="unicode")
        base = [pinocchio.JointModelFreeFlyer()] if ours.nq > ours.nv else []
        model = pinocchio.buildModelFromXML(text, *base)
        data = model.createData()
        columns = pinocchio.computeJointJacobians(model, data, pinocchio.neutral(model))
        joints = {}
        for j in range(1, model.njoints):
            moved = data.oMi[j].act(model.inertias[j])
            joint = {"mass": np.array([moved.mass]), "mass centre": moved.lever, "inertia": moved.inertia}
            if model.joints[j].nv == 1:
                joint["axis"] = columns[:, model.joints[j].idx_v]
            joints[spelt(model.names[j])] = joint
        told.append(joints)
    if by_order:
        # under the names of the second one
        named = {spelt(one[2]): spelt(other[2]) for one, other in zip(first.joints, second.joints)}
        told[0] = {named.get(name, name): joint for name, joint in told[0].items()}
    said = []
    for what in ("axis", "mass", "mass centre", "inertia"):
        found = []
        for name in told[0].keys() & told[1].keys():
            one, other = (joints[name].get(what, np.zeros(1)).ravel() for joints in told)
            k = abs(one - other).argmax()
            found.append((abs(one - other)[k] / max(abs(one).max(), abs(other).max(), 1e-300), name, one[k], other[k]))
        worst = max(found, default=(0, "", 0, 0))
        if worst[0] > 1e-9:
            said.append(f"{what} of {worst[1]}: {worst[2]:.9g} and {worst[3]:.9g}")
    return "; ".join(said) or "nothing"


def apart(function: Callable[[], dict], seconds: float = SECONDS) -> dict:
    """What a function says in a process of its own, as libraries may end it."""
    context = multiprocessing.get_context("fork")
    receives, sends = context.Pipe(duplex=False)

    def answer() -> None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        try:
            sends.send(dict(function()))
        except NotCompared as why:
            sends.send(why)
        except Exception as why:  # noqa: BLE001: one robot ends no table
            sends.send(NotCompared(f"fails: {type(why).__name__}: {why}"))

    process = context.Process(target=answer)
    process.start()
    sends.close()
    try:
        if not receives.poll(seconds):
            raise NotCompared("no answer in time")
        told = receives.recv()
    except EOFError:
        process.join()
        raise NotCompared("the other program aborts") from None
    finally:
        process.kill()
    if isinstance(told, NotCompared):
        raise told
    return told


def robots(kind: str, work: pathlib.Path) -> Iterator[tuple[str, list[pathlib.Path]]]:
    """Packages and their robots."""
    for package in PACKAGES[kind]:
        folder = unpacked(package, work)
        yield package, sorted(p for p in folder.rglob("*") if p.is_file() and is_robot(p, kind))


def of_repository(*endings: str, under: str = "") -> list[pathlib.Path]:
    listed = subprocess.run(["git", "-C", str(REPOSITORY), "ls-files"], capture_output=True, text=True, check=True).stdout
    return [REPOSITORY / name for name in listed.splitlines() if name.endswith(endings) and re.match(under, name)]


class Table:
    """Rows of Markdown: what was compared, how far it is off at most, and what was not."""

    def __init__(self, work: pathlib.Path, *columns: str):
        self.work, self.columns = work, columns
        print("| files | of | compared | " + " | ".join(columns) + " | not compared |")
        print("|---|---|---|" + "---|" * (len(columns) + 1))

    def row(self, kind: str, source: str, paths: list[pathlib.Path], beside: Callable[[pathlib.Path, pathlib.Path], dict]) -> int:
        """How many were compared."""
        worst, reasons, compared = collections.defaultdict(float), collections.Counter(), 0
        for path in paths:
            name = path.relative_to(self.work if path.is_relative_to(self.work) else REPOSITORY)
            with tempfile.TemporaryDirectory() as scratch:
                try:
                    found = apart(lambda: beside(path, pathlib.Path(scratch)))
                except NotCompared as why:
                    reasons[str(why)] += 1
                    print(f"{kind} {name}: {why}", file=sys.stderr, flush=True)
                    continue
            compared += 1
            for what, error in found.items():
                worst[what] = max(worst[what], error)
            print(f"{kind} {name}: " + ", ".join(f"{k} {x:.1e}" for k, x in found.items()), file=sys.stderr, flush=True)
        left = "; ".join(f"{count} × {why}" for why, count in sorted(reasons.items())) or "none"
        row = " | ".join(f"{worst[what]:.1e}" if what in worst else "–" for what in self.columns)
        print(f"| {kind} | {source} | {compared} | {row} | {left} |", flush=True)
        return compared


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="+", choices=["mjcf", "urdf", "mimic", "converted", "saved", "pairs", "drake", "drawn"])
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--straightline", required=True)
    parser.add_argument("--optimise", default=OPTIMISE, choices=["full", "quick"])
    given = parser.parse_args()
    globals()["OPTIMISE"] = given.optimise

    plain = ("H", "bias", "inverse")

    def read(path: pathlib.Path, scene: str, scratch: pathlib.Path, *more: str) -> Ours:
        return Ours(path, scene, given.straightline, scratch, *more)

    def all_errors(states: Callable, scene: str, path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        ours = read(path, scene, scratch)
        return greatest(errors(ours, at) for at in states(ours, path))

    def mjcf(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        found = all_errors(mujoco_states, NO_FRICTION, path, scratch)
        return {**masses(path, given.straightline, scratch), **found}

    def urdf(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        return all_errors(pinocchio_states, NO_DAMPING, path, scratch)

    def mimic(as_one: bool, path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        try:
            ours, forward = read(path, NO_DAMPING, scratch, "--function", "forward_dynamics"), True
        except NotCompared as why:
            if "no-forward-dynamics" not in str(why):
                raise
            ours, forward = read(path, NO_DAMPING, scratch), False
        states = pinocchio_states(ours, path, mimic=as_one)
        return greatest({**errors(ours, at), **({"forward": forward_error(ours, at)} if forward else {})} for at in states)

    def converted(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        ours = read(path, NO_FRICTION, scratch)
        return greatest(errors(ours, at) for at in mujoco_states(ours, write(path, "xml", given.straightline, scratch)))

    def urdf_converted(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        return urdf(write(path, "urdf", given.straightline, scratch), scratch)

    def saved(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        found = both_formats(path, saved_by_mujoco(path, scratch), given.straightline, scratch)
        return {what: found[what] for what in plain}

    def drake(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        return all_errors(drake_states, DAMPING_ALONE if path.suffix == ".xml" else NO_FRICTION, path, scratch)

    def drake_converted(path: pathlib.Path, scratch: pathlib.Path) -> dict[str, float]:
        return drake(write(path, "sdf", given.straightline, scratch), scratch)

    for what in given.what:
        if what == "mjcf":
            table = Table(given.work, "masses", *plain)
            for package, paths in robots("mjcf", given.work):
                table.row("MJCF", package, paths, mjcf)
        elif what in ("urdf", "converted"):
            table = Table(given.work, *plain)
            for package, paths in robots("urdf", given.work):
                table.row("URDF" if what == "urdf" else "MJCF by `convert`", package, paths, urdf if what == "urdf" else converted)
            for package, paths in robots("mjcf", given.work) if what == "converted" else []:
                table.row("URDF by `convert`", package, paths, urdf_converted)
        elif what == "saved":
            table = Table(given.work, *plain)
            for package, paths in robots("urdf", given.work):
                table.row("URDF and MJCF", package, paths, saved)
        elif what == "mimic":
            table = Table(given.work, *plain, "forward")
            for package, paths in robots("urdf", given.work):
                left = []
                for path in (p for p in paths if mimics(p)):
                    if not table.row(path.stem, package, [path], functools.partial(mimic, True)):
                        left.append(path)
                if left:
                    table.row("those, tau = G^T tau_full", package, left, functools.partial(mimic, False))
        elif what == "drawn":
            table = Table(given.work, *plain)
            (given.work / "drawn").mkdir(exist_ok=True)
            paths = [given.work / "drawn" / f"{seed}.sdf" for seed in range(DRAWN)]
            for seed, path in enumerate(paths):
                path.write_text(drawn(seed))
            table.row("SDF", "drawn at random", paths, drake)
        elif what == "drake":
            table = Table(given.work, *plain)
            table.row("SDF", "this repository", of_repository(".sdf"), drake)
            for kind in ("sdf", "urdf", "mjcf"):
                for package, paths in robots(kind, given.work):
                    table.row(kind.upper(), package, paths, drake)
            files = of_repository(".urdf", ".xml", ".toml", under="codegen/tests/files/|robots/descriptions/")
            table.row("SDF by `convert`", "this repository", files, drake_converted)
            for kind in ("urdf", "mjcf"):
                for package, paths in robots(kind, given.work):
                    table.row("SDF by `convert`", f"{kind.upper()} of {package}", paths, drake_converted)
        else:
            print("| URDF | MJCF | velocities | H | bias | inverse | differs most |\n|---|---|---|---|---|---|---|")
            for one, other in pairs(given.work):
                with tempfile.TemporaryDirectory() as scratch:
                    try:
                        found = apart(lambda: both_formats(one, other, given.straightline, pathlib.Path(scratch)), 10 * SECONDS)
                    except NotCompared as why:
                        print(f"| {one.stem} | {other.parent.name}/{other.stem} | – | – | – | – | {why} |", flush=True)
                        continue
                row = " | ".join(f"{found[w]:.1e}" for w in plain)
                print(f"| {one.stem} | {other.parent.name}/{other.stem} | {found['joints']} | {row} | {found['differs']} |", flush=True)


def pairs(work: pathlib.Path) -> Iterator[tuple[pathlib.Path, pathlib.Path]]:
    """URDFs and MJCFs of one robot."""
    files = {kind: [path for _, paths in robots(kind, work) for path in paths] for kind in ("urdf", "mjcf")}
    for one, other in PAIRS:
        yield next(p for p in files["urdf"] if str(p).endswith(one)), next(p for p in files["mjcf"] if str(p).endswith(other))
    for one in files["urdf"]:
        for other in files["mjcf"]:
            if one.stem == other.stem and "synriard" in str(one) and "synriard" in str(other):
                yield one, other


if __name__ == "__main__":
    main()

"""What tests have in common: robots of the repository, and states with a fixed seed."""

import functools
import json
import pathlib

import numpy as np
import straightline as sl

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOTS = ROOT / "robots" / "descriptions"

PENDULUM = """<robot name="pendulum">
    <link name="base"/>
    <joint name="hinge" type="continuous">
        <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
    </joint>
    <link name="rod"><inertial>
        <origin xyz="0 0 -0.5"/><mass value="2"/>
        <inertia ixx="0.2" iyy="0.3" izz="0.15" ixy="0" ixz="0" iyz="0"/>
    </inertial></link>
</robot>
"""

MOVING = """<robot name="satellite">
    <link name="hull"><inertial>
        <origin xyz="0.1 -0.05 0.02"/><mass value="3"/>
        <inertia ixx="0.2" iyy="0.3" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.03"/>
    </inertial></link>
</robot>
"""

# a ball joint between hinges; with a floating base there are two quaternions
HANGING = """<robot name="hanging">
    <link name="base"><inertial>
        <origin xyz="0.1 -0.05 0.02"/><mass value="5"/>
        <inertia ixx="0.3" iyy="0.4" izz="0.35" ixy="0.01" ixz="-0.02" iyz="0.03"/>
    </inertial></link>
    <joint name="shoulder" type="continuous">
        <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><origin xyz="0 0.1 0.2" rpy="0.1 0.2 0.3"/>
    </joint>
    <link name="upper"><inertial>
        <origin xyz="0.1 -0.05 0.02"/><mass value="3"/>
        <inertia ixx="0.2" iyy="0.3" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.03"/>
    </inertial></link>
    <joint name="ball" type="spherical">
        <parent link="upper"/><child link="lower"/><origin xyz="0.3 0.1 -0.2" rpy="0.4 -0.2 0.3"/>
    </joint>
    <link name="lower"><inertial>
        <origin xyz="0.05 -0.02 0.3"/><mass value="2"/>
        <inertia ixx="0.2" iyy="0.3" izz="0.15" ixy="0.01" ixz="-0.02" iyz="0.03"/>
    </inertial></link>
    <joint name="wrist" type="continuous">
        <parent link="lower"/><child link="hand"/><axis xyz="0.6 0 0.8"/><origin xyz="0.1 0.1 0.2" rpy="0.1 0.2 0.3"/>
    </joint>
    <link name="hand"><inertial>
        <origin xyz="0.1 -0.05 0.02"/><mass value="1"/>
        <inertia ixx="0.05" iyy="0.06" izz="0.04" ixy="0.001" ixz="-0.002" iyz="0.003"/>
    </inertial></link>
</robot>
"""


@functools.lru_cache(maxsize=None)
def hanging(floating_base=False):
    """A robot with a ball joint, whose q has one quaternion or two."""
    return sl.load(HANGING, floating_base=floating_base, optimise="quick")


@functools.lru_cache(maxsize=None)
def panda(dtype=np.float64):
    """The Panda, one for all tests: functions are compiled once."""
    return sl.load(ROBOTS / "panda.urdf", frames=["panda_hand_tcp"], dtype=dtype)


@functools.lru_cache(maxsize=None)
def ur5():
    return sl.load(ROBOTS / "ur5.urdf", allow=["warnings"])


def states(robot, count=None, seed=7):
    """Random q, qd, qdd."""
    random = np.random.default_rng(seed)
    lead = () if count is None else (count,)
    return tuple(random.uniform(-1, 1, (*lead, n)).astype(robot.dtype) for n in (robot.nq, robot.nv, robot.nv))


def reference(name):
    """States of the reference data of the repository."""
    path = ROOT / "generated_tests" / "reference" / "states" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))


def numbers(texts):
    """Numbers of the reference data, which are texts of 25 digits."""
    return np.array(texts, dtype=object).astype(float)

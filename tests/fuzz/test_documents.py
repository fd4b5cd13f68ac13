# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged descriptions, models, excitations and results: refused, or with finite numbers."""

import json

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import make_effect
from armid_ros.errors import RobotError
from armid_ros.excitation import Excitation, load_excitation, save_excitation
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.files import json_text
from armid_ros.identification.assess.compare import compare
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.robots import load_robot
from armid_ros.robots.load import shipped_path
from armid_ros.robots.xacro_expansion import expanded
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
import yaml

from tests.fuzz.mutants import (
    edited_text,
    edited_tree,
    edited_xml,
    TEXT_EDIT,
    to_json,
    to_yaml,
    TREE_EDIT,
    XML_EDIT,
)
from tests.fuzz.property import judge

ROBOT = 'two_link_elastic'
EFFECTS = ('viscous_friction', 'coulomb_friction', 'torque_offset', 'stribeck_friction', 'payload')
TEXT_EDITS = st.lists(TEXT_EDIT, min_size=1, max_size=3)
TREE_EDITS = st.lists(TREE_EDIT, min_size=1, max_size=3)
XML_EDITS = st.lists(XML_EDIT, min_size=1, max_size=4)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder to write mutants to."""
    return tmp_path_factory.mktemp('fuzz')


@pytest.fixture(scope='module')
def robot():
    """Return a robot of two joints."""
    return load_robot(ROBOT)


@pytest.fixture(scope='module')
def model(robot, folder):
    """Return a model.yaml as text."""
    arm = ArmModel(robot)
    for name in EFFECTS:
        arm = arm.with_effect(make_effect(name, robot))
    save_model(folder / 'whole.yaml', arm, ROBOT)
    return (folder / 'whole.yaml').read_text()


@pytest.fixture(scope='module')
def excitation(folder):
    """Return an excitation.yaml as a text."""
    series = FourierTrajectory(
        ('a', 'b'), 4.0, np.zeros(2), np.full((2, 3), 0.1), np.full((2, 3), 0.2)
    )
    run = Excitation(series, 2, 1.0)
    save_excitation(run, folder / 'whole_run.yaml')
    return (folder / 'whole_run.yaml').read_text()


def identification(more=0.0):
    """Return an identification.json as a document, with values that are larger by so much."""
    names = [('Izz1', 'a', 'kg m^2'), ('mx2', 'b', 'kg m')]
    names += [('viscous_coefficient', joint, 'N m s/rad') for joint in 'ab']
    values = [1.0, 0.2, 0.3, 0.4]
    covariance = 1e-4 * (np.eye(4) + 0.3)
    std = float(np.sqrt(covariance[0, 0]))
    return {
        'schema': 'armid/identification/1',
        'robot': 'r',
        'gravity': [0.0, 0.0, -9.81],
        'parameters': [
            {'name': n, 'joint': j, 'value': v + more, 'std': std, 'unit': u}
            for (n, j, u), v in zip(names, values, strict=True)
        ],
        'covariance': [row[: k + 1].tolist() for k, row in enumerate(covariance)],
        'grouping': [{name: 1.0} for name, _, _ in names],
        'condition_number': 3.0,
        'training': {'bags': ['x'], 'relative_error_percent': 5.0, 'rms': {'a': 0.1, 'b': 0.1}},
        'validation': [{'bag': 'y', 'relative_error_percent': 6.0, 'rms': {'a': 0.1, 'b': 0.1}}],
        'model': 'model.yaml',
    }


def finite(*arrays):
    """Say what is wrong with numbers; 'other' if nothing is, for a text has no checksum."""
    return 'other' if all(np.isfinite(array).all() for array in arrays) else 'not finite'


def sound_robot(robot, _):
    """Check a robot."""
    q = np.zeros(robot.n_joints)
    assert robot.n_joints > 0
    assert (robot.lower <= robot.upper).all()
    assert not np.isnan(np.concatenate([robot.lower, robot.upper, robot.torque_limit, q])).any()
    return finite(robot.rigid_parameters, robot.gravity, robot.urdf_damping, robot.urdf_friction)


EITHER_XML = st.one_of(
    XML_EDITS.map(lambda e: (edited_xml, e)), TEXT_EDITS.map(lambda e: (edited_text, e))
)
EITHER_TREE = st.one_of(
    TREE_EDITS.map(lambda e: (edited_tree, e)), TEXT_EDITS.map(lambda e: (edited_text, e))
)


@given(edits=EITHER_XML)
def test_urdf(folder, edits):
    path = folder / 'robot.urdf'
    edit, what = edits
    path.write_text(edit(shipped_path('humanoid_arm').read_text(), what), errors='replace')
    judge('URDF', load_robot, path, None, sound_robot)


XACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">
<xacro:arg name="mass" default="1.5"/>
<xacro:property name="m" value="$(arg mass)"/>
<xacro:property name="n" value="${2 * m}"/>
<xacro:macro name="link" params="name mass:=1 *origin">
<link name="${name}"><inertial><xacro:insert_block name="origin"/><mass value="${mass}"/>
<inertia ixx="${mass / 10}" iyy="${mass / 10}" izz="${mass * 0.1}"/></inertial></link>
</xacro:macro>
<link name="base"/>
<xacro:link name="one" mass="${n}"><origin xyz="0 0 ${0.1 + m}"/></xacro:link>
<xacro:if value="${n > 2}"><xacro:link name="two"><origin xyz="0 0 0.1"/></xacro:link></xacro:if>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="${radians(60)}" effort="10" velocity="1"/></joint>
<joint name="b" type="continuous"><parent link="one"/><child link="two"/><axis xyz="0 1 0"/>
</joint>
</robot>"""


def read_xacro(path):
    """Expand in this process, which is what the process of the package does."""
    answer = expanded({'path': str(path), 'arguments': {}})
    if 'text' not in answer:
        raise RobotError(f'{path}: {answer["error"]}')
    try:
        return load_robot(answer['text'])
    except RobotError as error:
        raise RobotError(f'{path}: {error}') from error


@given(edits=EITHER_XML)
def test_xacro(folder, edits):
    path = folder / 'robot.urdf.xacro'
    edit, what = edits
    path.write_text(edit(XACRO, what), errors='replace')
    judge('xacro', read_xacro, path, None, sound_robot)


def damaged(text, edits, load, write):
    """Return a document with edits of its tree or of its text."""
    edit, what = edits
    return write(edit(load(text), what)) if edit is edited_tree else edit(text, what)


@given(edits=EITHER_TREE)
def test_model(folder, robot, model, edits):
    path = folder / 'model.yaml'
    path.write_text(damaged(model, edits, yaml.safe_load, to_yaml), errors='replace')
    judge('model.yaml', lambda p: load_model(p, robot), path, None, sound_model)


def sound_model(arm, _):
    """Check an arm model."""
    return finite(arm.theta, arm.robot.gravity, *(e.shape_values for e in arm.effects if e.shapes))


@given(edits=EITHER_TREE)
def test_excitation(folder, excitation, edits):
    path = folder / 'excitation.yaml'
    path.write_text(damaged(excitation, edits, yaml.safe_load, to_yaml), errors='replace')
    judge('excitation.yaml', load_excitation, path, None, sound_excitation)


def sound_excitation(run, _):
    """Check an excitation at some of its times; what is beyond all numbers is for the limits."""
    with np.errstate(all='ignore'):
        motion = run.at(np.linspace(0.0, run.duration, 11))
    assert motion.q.shape == (11, len(run.joints))
    return finite(run.trajectory.q0, run.trajectory.a, run.trajectory.b, run.duration)


@given(edits=EITHER_TREE)
def test_identification(folder, edits):
    path = folder / 'identification.json'
    text = to_json(identification())
    path.write_text(damaged(text, edits, json.loads, to_json), errors='replace')
    judge('identification.json', compared, path, None, sound_comparison)


def compared(path):
    """Compare a mutant with another one that is whole."""
    whole = path.with_name('whole_identification.json')
    if not whole.exists():
        whole.write_text(to_json(identification(more=0.01)))
    return compare(read_parameters(whole), read_parameters(path)).document()


def sound_comparison(document, _):
    """Check what is written of a comparison."""
    assert json.loads(json_text(document))['schema'] == 'armid/comparison/1'
    try:
        json.dumps(document, allow_nan=False)
    except ValueError as error:
        return f'not finite: {error}'
    return 'other'

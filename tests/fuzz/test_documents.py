# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged descriptions, models, excitations and results: refused, or with finite numbers."""

import json

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.excitation import Excitation, load_excitation, save_excitation
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.files import json_text
from armid_ros.identification.assess.compare import compare
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.robots import load_robot
from armid_ros.robots.load import shipped_path
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
import yaml

from tests.cli.test_compare import identified
from tests.fuzz.mutants import (
    edited_text,
    edited_tree,
    edited_xml,
    TEXT_EDIT,
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
#: What the document of an identification has beside parameters and errors.
MORE = {
    'gravity': [0.0, 0.0, -9.81],
    'grouping': [{'viscous_coefficient elbow': 1.0}, {'Izz1': 1.0, 'Iyy2': 1.0}],
    'condition_number': 3.0,
    'validation': [
        {'bag': 'y', 'relative_error_percent': 6.0, 'rms': {'shoulder': 0.1, 'elbow': 0.1}}
    ],
    'model': 'model.yaml',
}


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder to write mutants to, with the undamaged documents."""
    folder = tmp_path_factory.mktemp('fuzz')
    (folder / 'whole').mkdir()
    arm = ArmModel.of(ROBOT, effects=EFFECTS)
    save_model(folder / 'whole' / 'model.yaml', arm, ROBOT)
    series = FourierTrajectory(
        ('a', 'b'), 4.0, np.zeros(2), np.full((2, 3), 0.1), np.full((2, 3), 0.2)
    )
    save_excitation(Excitation(series, 2, 1.0), folder / 'whole' / 'excitation.yaml')
    identified(folder / 'other', 0.3)
    document = identified(folder / 'whole', 0.31, **MORE) / 'identification.json'
    document.write_text(json.dumps(json.loads(document.read_text()), indent=1))
    return folder


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
    judge(load_robot, path, None, sound_robot)


def sound_model(arm, _):
    """Check an arm model."""
    return finite(arm.theta, arm.robot.gravity, *(e.shape_values for e in arm.effects if e.shapes))


def sound_excitation(run, _):
    """Check an excitation at some of its times; what is beyond all numbers is for the limits."""
    with np.errstate(all='ignore'):
        motion = run.at(np.linspace(0.0, run.duration, 11))
    assert motion.q.shape == (11, len(run.joints))
    return finite(run.trajectory.q0, run.trajectory.a, run.trajectory.b, run.duration)


def compared(path):
    """Compare a mutant with another one that is whole."""
    return compare(read_parameters(path.with_name('other')), read_parameters(path)).document()


def sound_comparison(document, _):
    """Check what is written of a comparison."""
    assert json.loads(json_text(document))['schema'] == 'armid/comparison/1'
    json.dumps(document, allow_nan=False)
    return 'other'


@pytest.mark.parametrize(
    ('name', 'read', 'sound'),
    [
        ('model.yaml', load_model, sound_model),
        ('excitation.yaml', load_excitation, sound_excitation),
        ('identification.json', compared, sound_comparison),
    ],
)
@given(edits=EITHER_TREE)
def test_documents(folder, name, read, sound, edits):
    path, text = folder / name, (folder / 'whole' / name).read_text()
    edit, what = edits
    if edit is edited_text:
        mutant = edit(text, what)
    elif name.endswith('.json'):
        mutant = json.dumps(edit(json.loads(text), what), indent=1)
    else:
        mutant = to_yaml(edit(yaml.safe_load(text), what))
    path.write_text(mutant, errors='replace')
    judge(read, path, None, sound)

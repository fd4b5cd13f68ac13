# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid export`: ranges, SDF, and what the command writes and refuses."""

from pathlib import Path
from xml.etree import ElementTree

import armid_ros as ar
from armid_ros.cli.export.command import KINDS
from armid_ros.cli.export.sdf import arm_sdf
import numpy as np
import pinocchio as pin
import pytest
import yaml

from tests.cli.conftest import armid

FRICTION = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
OTHERS = (
    'payload@elbow:payload_m=0.4,payload_mz=0.12,payload_Ixx=0.04,payload_Iyy=0.04',
    'torque_ripple@elbow:ripple_sine=0.2',
)
ROBOT = Path(__file__).parents[3] / 'examples' / 'arm.urdf'


@pytest.fixture
def carrying(tmp_path):
    """Return the file of a model with a payload and ripple, without standard deviations."""
    arm = ar.ArmModel.of(ROBOT, effects=FRICTION + OTHERS)
    ar.save_model(tmp_path / 'model.yaml', arm, str(ROBOT))
    return tmp_path / 'model.yaml'


def ranges(model, out, *options):
    armid('export', model, '--to', 'ranges', '--out', out, *options)
    rows = yaml.safe_load(out.read_text())['parameters']
    return {(row['name'], row['joint']): row for row in rows}


def test_ranges_are_those_of_the_identification_and_of_the_spread(tmp_path):
    """A mass on a vertical axis turns no motor; the centre of a link that turns is seen."""
    run_of_arm = ar.simulate(ar.ArmModel.of(ROBOT, effects=FRICTION), torque_noise=0.05, rng=0)
    found = ar.identify(ROBOT, run_of_arm)
    found.save(tmp_path / 'found')
    narrow, wide = (
        ranges(tmp_path / 'found', tmp_path / 'ranges.yaml', '--spread', spread)
        for spread in (0.1, 0.2)
    )
    row = narrow['viscous_coefficient', 'elbow']
    k = found.estimate.index('viscous_coefficient', 'elbow')
    assert row['mean'] == pytest.approx(found.estimate.values[k])
    assert row['std'] == pytest.approx(found.estimate.std[k], rel=0.05)
    assert row['high'] - row['mean'] == pytest.approx(1.96 * row['std'], rel=1e-3)
    unseen, seen = ('mass', 'waist'), ('center_x', 'elbow')
    assert (narrow[unseen]['from'], narrow[seen]['from']) == ('description', 'recordings')
    assert wide[unseen]['std'] == pytest.approx(2 * narrow[unseen]['std'], rel=0.05)
    assert wide[seen]['std'] == pytest.approx(narrow[seen]['std'], rel=0.2)
    assert 0.0 < narrow[unseen]['low'] < 2.0 < narrow[unseen]['high']


def test_a_value_without_standard_deviation_has_no_range(carrying, tmp_path):
    row = ranges(carrying, tmp_path / 'ranges.yaml')['payload_m', 'elbow']
    assert row['std'] is row['low'] is row['high'] is row['from'] is None
    assert row['mean'] == 0.4


def numbers(element, path):
    return np.array(element.findtext(path).split(), dtype=float)


def test_sdf_has_bodies_places_and_friction_of_the_model():
    arm = ar.ArmModel.of('humanoid_arm', effects=FRICTION)
    model = ElementTree.fromstring(arm_sdf(arm, 'model.yaml')[0]).find('model')
    placed = {arm.robot.base: pin.SE3.Identity()}
    data = arm.robot.model.createData()
    pin.forwardKinematics(arm.robot.model, data, np.zeros(arm.robot.n_joints))
    for k, (joint, link) in enumerate(zip(arm.robot.joints, arm.robot.links, strict=True)):
        element, inertial = model.find(f"joint[@name='{joint}']"), f"link[@name='{link}']/inertial"
        place = numbers(element, 'pose')
        pose = pin.SE3(pin.rpy.rpyToMatrix(place[3:]), place[:3])
        assert element.findtext('child') == link
        placed[link] = placed[element.findtext('parent')] * pose
        np.testing.assert_allclose(placed[link], data.oMi[k + 1], atol=1e-12)
        np.testing.assert_allclose(numbers(element, 'axis/xyz'), arm.robot.geometry[k].turn)
        assert [float(one.text) for one in element.find('axis/dynamics')] == [0.3, 0.2]
        mass, center = (numbers(model, f'{inertial}/{name}') for name in ('mass', 'pose'))
        xx, xy, xz, yy, yz, zz = (float(one.text) for one in model.find(f'{inertial}/inertia'))
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found = pin.Inertia(float(mass[0]), center[:3], tensor).toDynamicParameters()
        np.testing.assert_allclose(found, arm.robot.rigid_parameters[10 * k :][:10], atol=1e-12)


@pytest.mark.parametrize('kind', KINDS)
def test_every_kind_is_a_file_that_names_its_model(kind, carrying, tmp_path):
    printed = armid('export', carrying, '--to', kind, '--out', tmp_path / 'out').output
    text = (tmp_path / 'out').read_text()
    assert str(carrying) in text
    if kind in ('cpp', 'python', 'sdf'):
        assert 'ripple_sine of elbow = 0.2' in printed and 'ripple_sine of elbow = 0.2' in text


def test_what_cannot_be_written_is_an_error_with_the_answer(carrying, tmp_path):
    to_cpp = ('export', carrying, '--to', 'cpp', '--out', tmp_path / 'o')
    assert '--frame' in armid(*to_cpp, '--frame', 'forearm', code=2).stderr
    over_itself = ('export', carrying, '--to', 'ranges', '--out', carrying)
    assert '--out' in armid(*over_itself, code=2).stderr
    coupled = tmp_path / 'coupled.urdf'
    mimics = '<axis xyz="0 1 0"/><mimic joint="shoulder"/>'
    coupled.write_text(mimics.join(ROBOT.read_text().rsplit('<axis xyz="0 1 0"/>', 1)))
    robot = ar.load_robot(coupled, joints=('waist', 'shoulder'))
    ar.save_model(tmp_path / 'coupled.yaml', ar.ArmModel(robot), str(coupled))
    of_two = ('--robot', coupled, '--joints', 'waist,shoulder', '--to', 'cpp')
    asked = ('export', tmp_path / 'coupled.yaml', *of_two, '--out', tmp_path / 'o')
    assert 'coupled joints' in armid(*asked, code=2).stderr

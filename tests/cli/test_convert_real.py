# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real machines in the formats of their authors, as a person would type them."""

import json

import pytest

from .conftest import armid

pytestmark = pytest.mark.real_data

EMPS = """<robot name="emps"><link name="rail"/><link name="carriage"><inertial>
<mass value="100"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="carriage"/>
<axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5" effort="352" velocity="0.5"/></joint></robot>
"""


def identified(*arguments, out):
    """Identify and return the document."""
    armid('identify', *arguments, '--no-verify', '--out', out)
    return json.loads((out / 'identification.json').read_text())


def test_a_mat_file_of_controller_volts(real_data, tmp_path):
    """The published mass and friction of the EMPS; relative errors 4.08 and 5.98 %."""
    (tmp_path / 'emps.urdf').write_text(EMPS)
    files = [real_data / 'emps' / f'DATA_EMPS{name}.mat' for name in ('', '_PULSES')]
    document = identified(
        files[0], '--validate', files[1], '--robot', tmp_path / 'emps.urdf',
        '--position', 'qm', '--effort', 'vir', '--effort-scale', 35.15065, out=tmp_path / 'out',
    )  # fmt: skip
    values = {row['name']: row['value'] for row in document['parameters']}
    assert values['m1'] == pytest.approx(95.11, rel=0.005)
    assert values['coulomb_torque'] == pytest.approx(20.4, rel=0.01)
    assert document['training']['relative_error_percent'] < 4.1
    assert document['validation'][0]['relative_error_percent'] < 6.0


def test_two_files_of_motor_angles_and_currents_with_a_coupled_wrist(real_data, tmp_path):
    """Friction of the first joint of the TX40, published 8.087 and 7.014."""
    folder, bag = real_data / 'tx40_staubli', tmp_path / 'bag'
    robot = ('--robot', folder / 'tx40_mdh_modified.urdf')
    armid(
        'convert', folder / 'pos_read_data.csv', folder / 'curr_data.csv', *robot, '--rate', 5000,
        '--gear', '32,32,45,-48,45,32', '--coupling', '6,5=32', '--zero', '0,-pi/2,pi/2,0,0,0',
        '--out', bag,
    )  # fmt: skip
    effects = (
        'viscous_friction,coulomb_friction,torque_offset,rotor_inertia,coupled_joint_friction'
    )
    document = identified(
        bag, *robot, '--effects', effects, '--method', 'ols', '--decimation', 100,
        out=tmp_path / 'out',
    )  # fmt: skip
    rows = {(row['name'], row['joint']): row['value'] for row in document['parameters']}
    assert rows['viscous_coefficient', 'joint_1'] == pytest.approx(8.087, rel=0.02)
    assert rows['coulomb_torque', 'joint_1'] == pytest.approx(7.014, rel=0.05)
    assert document['training']['relative_error_percent'] < 5.3


def test_a_table_that_says_it_all_needs_no_word(real_data, tmp_path):
    """The authors' moments of the double pendulum: k 0.33 and h 0.116 kg m."""
    folder = real_data / 'dfki_double_pendulum'
    document = identified(
        folder / 'A0_sysid' / '20220812-061157-PM_measured.csv.gz',
        '--robot', folder / 'parameters' / 'design_A.0_model_2.1' / 'pendubot.urdf',
        '--cutoff', 5, out=tmp_path / 'out',
    )  # fmt: skip
    rows = {(row['name'], row['joint']): row['value'] for row in document['parameters']}
    assert -rows['mz1 - 0.3 m2', 'Joint1'] == pytest.approx(0.33, rel=0.02)
    assert rows['mz2', 'Joint2'] == pytest.approx(0.116, rel=0.02)
    assert document['training']['relative_error_percent'] < 10.0


def test_columns_of_an_array_without_names(real_data, tmp_path):
    """Counted by the authors' description; time in nanoseconds since 1970."""
    file = next((real_data / 'franka_fr3_teleop' / 'data').glob('*_162545.npy.gz'))
    text = armid(
        'convert', file, '--joints', ','.join(f'fr3_joint{k}' for k in range(1, 8)),
        '--time', '[0]', '--position', '[1..7]', '--velocity', '[8..14]', '--effort', '[15..21]',
        '--out', tmp_path / 'bag',
    ).stdout  # fmt: skip
    assert 'time      [0], in ns' in text
    assert '10384 samples from 10384 messages' in text
    assert '974' in text

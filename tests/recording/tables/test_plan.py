# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Columns are matched to joints by name, else by number; what is guessed is said to be."""

from armid_ros.errors import RecordingError
from armid_ros.recording.columns import ColumnSettings, numbers
from armid_ros.recording.reader import read_recording
from armid_ros.recording.tables import converted, open_table, plan, Table, TableColumn
import numpy as np
import pytest

from .conftest import JOINTS


def table(**columns):
    """Return a table of columns by name, with time where there is none."""
    columns = {'t': np.arange(50) * 0.01, **columns}
    return Table('run.csv', tuple(TableColumn(name, values) for name, values in columns.items()))


def ramps(*names):
    """Return a table with a ramp of its own in each column."""
    return table(**{name: np.linspace(0, k + 1, 50) for k, name in enumerate(names)})


def test_names_count_before_numbers():
    both = ramps('elbow_pos', 'shoulder_pos')
    assert [c.name for c in plan(both, ColumnSettings(), JOINTS).sources[0].columns] == [
        'shoulder_pos',
        'elbow_pos',
    ]


def test_numbers_are_in_order_even_beyond_nine():
    columns = ramps(*(f'q{k}' for k in range(12, 0, -1)))
    joints = tuple(f'j{k}' for k in range(1, 13))
    chosen = plan(columns, ColumnSettings(position='q{}'), joints).sources[0]
    assert [c.name for c in chosen.columns] == [f'q{k}' for k in range(1, 13)]


def test_spans_name_columns_of_a_larger_array():
    columns = tuple(TableColumn(f'[{k}]', np.linspace(0, k + 1, 50), '[]') for k in range(9))
    said = ColumnSettings(time='[0]', position='[1..2]', effort='[7..8]', velocity='none')
    recording = converted(plan(Table('run.npy', columns), said, JOINTS))
    np.testing.assert_allclose(recording.q[-1], [2, 3])
    np.testing.assert_allclose(recording.tau[-1], [8, 9])
    assert recording.dq is None


def test_the_plan_states_what_was_guessed_and_what_is_not_read():
    lines = plan(ramps('q1', 'q2', 'tau_meas1', 'tau_meas2', 'tau_con1', 'tau_con2'),
                 ColumnSettings(position='q{}'), JOINTS).lines()  # fmt: skip
    said = {line.split()[0]: line for line in lines}
    assert 'rad' in said['position'] and 'guessed' not in said['position']
    assert 'tau_meas2' in said['effort'] and 'guessed' in said['effort']
    assert 'none' in said['velocity']
    assert 'tau_con1' in said['not']


def test_currents_are_said_to_be_no_torques_until_a_gain_is_given():
    columns = ramps('q1', 'q2', 'current1', 'current2')
    notes = plan(columns, ColumnSettings(), JOINTS).notes
    assert any('--current-gain' in note for note in notes)
    said = ColumnSettings(effort_scale=(11.2, -5.0))
    settled = plan(columns, said, JOINTS)
    assert not settled.notes
    np.testing.assert_allclose(converted(settled).tau[-1], [3 * 11.2, -4 * 5.0])


def test_elements_of_a_state_vector_are_told_apart_by_their_endings():
    """As LeRobot names them; what was commanded stands beside what was measured."""
    names = [f'{joint}.{kind}' for joint in JOINTS for kind in ('pos', 'vel', 'torque')]
    columns = [
        TableColumn(f'observation.state[{name}]', np.linspace(0, k + 1, 50), 'observation.state')
        for k, name in enumerate(names)
    ]
    columns += [
        TableColumn(f'action[{joint}.pos]', np.linspace(0, 9, 50), 'action') for joint in JOINTS
    ]
    for joints in (JOINTS, None):
        settled = plan(Table('set', tuple(columns), rate_hz=50.0), ColumnSettings(), joints)
        assert settled.joints == JOINTS
        recording = converted(settled)
        np.testing.assert_allclose(recording.q[-1], [1, 4])
        np.testing.assert_allclose(recording.dq[-1], [2, 5])
        np.testing.assert_allclose(recording.tau[-1], [3, 6])


@pytest.mark.parametrize('names', [('q_deg_1', 'q_deg_2'), ('q1[deg]', 'q2[deg]')])
def test_a_unit_of_turns_in_the_header_is_none_of_a_joint_that_slides(names):
    columns = ramps(*names)
    settled = plan(columns, ColumnSettings(), JOINTS, [False, True])
    recording = converted(settled)
    np.testing.assert_allclose(recording.q[-1], [np.radians(1.0), 2.0])


def test_motor_side_becomes_joint_side_with_the_same_power():
    """With motor = G q, dq tau is conserved: what a coupled wrist needs."""
    said = ColumnSettings(gear=(32.0, -48.0), coupling=(('2', '1', 16.0),), zero=(0.0, 0.5))
    columns = ramps('q1', 'q2', 'dq1', 'dq2', 'tau1', 'tau2')
    motor = converted(plan(columns, ColumnSettings(), JOINTS))
    joint = converted(plan(columns, said, JOINTS))
    np.testing.assert_allclose(
        np.sum(joint.dq * joint.tau, axis=1), np.sum(motor.dq * motor.tau, axis=1)
    )
    np.testing.assert_allclose(32.0 * joint.q[:, 0], motor.q[:, 0])
    np.testing.assert_allclose(
        16.0 * joint.q[:, 0] - 48.0 * (joint.q[:, 1] - 0.5), motor.q[:, 1], atol=1e-12
    )


def test_joints_are_called_as_the_columns_where_no_robot_says_otherwise():
    assert plan(ramps('q1', 'q2'), ColumnSettings()).joints == ('joint_1', 'joint_2')
    columns = ramps('fer_a/position', 'fer_b/position', 'fer_a/effort', 'fer_b/effort')
    settled = plan(columns, ColumnSettings(rename=(('fer_', 'panda_'),)))
    assert settled.joints == ('panda_a', 'panda_b')
    assert [one.quantity for one in settled.sources][-1] == 'effort'


def test_ratios_are_written_as_people_do():
    np.testing.assert_allclose(
        numbers('1798/7,-pi/2, 2*pi ,3e-2'), [1798 / 7, -np.pi / 2, 2 * np.pi, 0.03]
    )
    with pytest.raises(RecordingError, match='x'):
        numbers('1,x')


@pytest.mark.parametrize(
    ('said', 'message'),
    [
        ({'position': 'a{}'}, r'a\{\}.*position.*q1'),
        ({'position': 'q{}'}, 'q1, q2, q3.*shoulder'),
        ({'position': 'q1,q7'}, 'q7.*q1'),
        ({'position': 'q1,q2', 'time': 'clock'}, 'clock'),
        ({'position': 'q1,q2', 'time': 'none'}, '--time'),
        (
            {'position': 'q1,q2', 'effort_scale': (1.0, 2.0, 3.0), 'effort': 'q2,q3'},
            '3.*shoulder, elbow',
        ),
        ({}, 'shoulder, elbow.*--position'),
    ],
)
def test_what_does_not_fit_is_refused_with_what_there_is(said, message):
    with pytest.raises(RecordingError, match=message):
        plan(ramps('q1', 'q2', 'q3'), ColumnSettings(**said), JOINTS)


def test_a_joint_or_a_header_that_is_missing_is_named(tmp_path):
    np.savetxt(tmp_path / 'run.csv', np.arange(20.0).reshape(5, 4), delimiter=',')
    with pytest.raises(RecordingError, match=r'header.*line 1'):
        plan(open_table(tmp_path / 'run.csv'), ColumnSettings(), JOINTS)
    with pytest.raises(RecordingError, match=r'elbow.*--joints'):
        plan(ramps('shoulder_pos', 'shoulder_tau', 'elbow_tau'), ColumnSettings(), JOINTS)


@pytest.mark.parametrize(
    'settings', [{'time_unit': 'h'}, {'rate_hz': 0.0}, {'coupling': (('1', '2', 3.0),)}]
)
def test_settings_without_meaning_are_refused(settings):
    with pytest.raises(RecordingError):
        ColumnSettings(**settings)


def test_where_columns_are_that_were_not_asked_for_is_kept_in_the_unit_of_the_others():
    columns = ramps('shoulder_pos', 'elbow_pos', 'wrist_pos', 'temperature')
    asked = ColumnSettings(position='{}_pos', degrees=True, rename=(('wrist', 'hand'),))
    (other,) = converted(plan(columns, asked, JOINTS)).others
    assert (other.joint, other.lowest) == ('hand', 0.0)
    assert other.highest == pytest.approx(np.deg2rad(3.0))


@pytest.mark.parametrize('said', [{}, {'time': 't'}])
def test_a_time_that_runs_backwards_is_refused_with_what_to_do(said):
    """Sorted, the motion would run backwards too, and its velocities would not."""
    backwards = table(t=np.arange(50)[::-1] / 100.0, q1=np.sin(np.arange(50.0)))
    with pytest.raises(RecordingError, match=r' t: time decreases.*0\.49.*--rate'):
        plan(backwards, ColumnSettings(position='q1', **said))


@pytest.mark.parametrize('value', [1e6, -1e6, 1e157, -np.inf])
def test_rows_with_times_that_are_rubbish_are_left_out_and_counted(value, recwarn):
    t, ramp = np.arange(50) * 0.01, np.linspace(0.0, 1.0, 50)
    t[[20, 40]] = value
    recorded = table(t=t, shoulder_pos=ramp, elbow_pos=2.0 * ramp)
    found = converted(plan(recorded, ColumnSettings(), JOINTS))
    assert (len(found), found.report.unstamped, found.report.restarted) == (48, 2, 0)
    assert not recwarn.list


def test_large_ways_of_a_joint_that_slides_are_doubted_apart():
    columns = table(q1=np.linspace(0, 1, 50), q2=np.linspace(0, 180, 50))
    assert any('--degrees' in note for note in plan(columns, ColumnSettings(), JOINTS).notes)
    (note,) = plan(columns, ColumnSettings(), JOINTS, [False, True]).notes
    assert '180 m' in note and '--position-scale' in note
    scaled = ColumnSettings(position_scale=(1.0, 0.001))
    assert not plan(columns, scaled, JOINTS, [False, True]).notes


def test_a_table_has_columns_of_temperatures(tmp_path):
    """As RTDE of Universal Robots names them; a slow sensor leaves cells empty."""
    rows = ['timestamp,actual_q_0,actual_q_1,joint_temperatures_0,joint_temperatures_1']
    for k, t in enumerate(np.arange(400) / 100.0):
        heat = ['', ''] if k % 50 else [f'{25 + t}', '31']
        rows.append(','.join([f'{t}', f'{np.sin(t)}', f'{np.cos(t)}', *heat]))
    (tmp_path / 'run.csv').write_text('\n'.join(rows))
    found = read_recording(tmp_path / 'run.csv')
    np.testing.assert_allclose(found.temperature.at([1.0]), [[26.0, 31.0]])
    (tmp_path / 'run.csv').write_text('\n'.join(rows).replace(',31', ',310'))
    with pytest.raises(RecordingError, match=r'run.csv: column joint_temperatures_1: .*310.*degC'):
        read_recording(tmp_path / 'run.csv')

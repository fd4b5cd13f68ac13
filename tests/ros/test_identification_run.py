# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the excitation to the report without anybody's help, and what fails is said."""

from itertools import pairwise
import json
from pathlib import Path

from armid_ros.errors import ArmidError
from armid_ros.nodes import identification_run
from armid_ros.nodes.identification_run import IdentificationRunNode
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.recording import read_recording
from diagnostic_msgs.msg import DiagnosticStatus
import pytest

from tests.ros.controller import Controller
from tests.ros.test_controller import HOME, publisher, ROBOT


class Programs:
    """Stand in for armid: write what it would, and end at once."""

    def __init__(self, codes=(0, 0), verdict='not_repeatable'):
        self.called, self._codes, self._verdict = [], list(codes), verdict

    def __call__(self, program):
        self.called.append(program)
        folder = Path(program[-1])
        folder.mkdir(parents=True, exist_ok=True)
        (folder / 'identification.json').write_text(json.dumps({'grade': 'good'}))
        document = {'verdict': self._verdict, 'summary': 'nothing to name'}
        (folder / 'diagnosis.json').write_text(json.dumps(document))
        return Ended(self._codes.pop(0))


class Ended:
    """A program that has ended."""

    def __init__(self, returncode):
        self.returncode = returncode

    def poll(self):
        return self.returncode


@pytest.fixture
def arm(bench):
    arm = Controller(bench, ROBOT, HOME, action=True)
    yield arm
    arm.leave()


def everything(bench, arm, excitation, folder, programs, **parameters):
    """Return the nodes that the launch file starts, with an arm in front of them."""
    node = publisher(bench, arm, excitation, rehearsal_speed=1.0)
    options = {'bag': str(folder / 'run'), 'record': False, 'topics': ['joint_states']}
    bench.add(RecorderNode, use_sim_time=True, **options)
    run = bench.add(
        IdentificationRunNode,
        programs,
        robot='humanoid_arm',
        save_to=str(folder),
        **parameters,
    )
    return node, run


def carry_on(bench, arm, node, run, fault=lambda: None):
    """Let time go on until the node has ended."""
    for step in range(1000):
        if run.finished:
            return
        node.publish_diagnostics()
        node.poll()
        run.poll()
        arm.run(arm.now + 0.2, step=0.2)
        if step == 15:
            fault()
    pytest.fail(f'still {run.condition()}')


def test_a_rehearsal_and_two_runs_are_identified_held_out_and_diagnosed(
    bench, arm, excitation, tmp_path
):
    programs = Programs()
    effects = ['viscous_friction', 'coulomb_friction']
    options = {'effects': effects, 'gravity': 'moon', 'rehearse': True}
    node, run = everything(bench, arm, excitation, tmp_path, programs, **options)
    carry_on(bench, arm, node, run)
    assert not run.failure
    assert arm.ends == ['succeed', 'succeed', 'succeed']
    first, second = tmp_path / 'run', tmp_path / 'run_1'
    for bag in (first, second):
        recording = read_recording(bag, joints=ROBOT.joints)
        assert recording.duration > excitation.duration
    identify, diagnose = programs.called
    assert identify[:4] == ('identify', str(first), '--validate', str(second))
    pairs = list(pairwise(identify))
    assert ('--effects', 'viscous_friction,coulomb_friction') in pairs
    assert ('--gravity', 'moon') in pairs
    assert identify[-2:] == ('--out', str(tmp_path / 'identification'))
    assert diagnose[0] == 'diagnose'
    assert ('--model', str(tmp_path / 'identification' / 'model.yaml')) == diagnose[-4:-2]
    results = run.condition()[1]['results']
    assert 'good' in results and 'repeatable' in results


def test_a_rehearsal_that_surprises_ends_it(bench, arm, excitation, tmp_path):
    programs = Programs()
    arm.faults.torque = 10.0
    node, run = everything(bench, arm, excitation, tmp_path, programs, rehearse=True)
    carry_on(bench, arm, node, run)
    assert 'N m' in run.failure
    assert not programs.called
    assert len(arm.goals) == 1


def test_a_run_that_is_stopped_ends_it_with_the_reason(bench, arm, excitation, tmp_path):
    def stick():
        arm.faults.stuck = 3

    programs = Programs()
    node, run = everything(bench, arm, excitation, tmp_path, programs)
    carry_on(bench, arm, node, run, fault=stick)
    assert '1 of' in run.failure and 'elbow_pitch' in run.failure
    assert not programs.called
    bench.settle()
    assert len(read_recording(tmp_path / 'run', joints=ROBOT.joints)) > 10


def test_a_publisher_that_is_gone_ends_it_and_the_recording(
    bench, arm, excitation, tmp_path, monkeypatch
):
    monkeypatch.setattr(identification_run, '_GONE', 0.0)
    node, run = everything(bench, arm, excitation, tmp_path, Programs())
    carry_on(bench, arm, node, run, fault=lambda: setattr(run, '_missing', lambda: ['/it']))
    assert 'run 1' in run.failure and '/it' in run.failure
    bench.settle()
    assert len(read_recording(tmp_path / 'run', joints=ROBOT.joints)) > 10


@pytest.mark.parametrize('verdict', ['bad_data', 'not_repeatable'])
def test_data_that_cannot_be_diagnosed_are_an_answer_and_other_failures_are_not(
    bench, arm, excitation, tmp_path, monkeypatch, verdict
):
    monkeypatch.setattr(IdentificationRunNode, '_run_excitation', lambda *_: iter(()))  # no motion
    programs = Programs(codes=(0, 2), verdict=verdict)
    node, run = everything(bench, arm, excitation, tmp_path, programs, runs=1)
    carry_on(bench, arm, node, run)
    assert '--validate' not in programs.called[0]
    if verdict == 'bad_data':
        assert not run.failure
        assert 'bad data' in run.condition()[1]['results']
        return
    for fact in ('armid diagnose', 'code 2', str(tmp_path / 'run')):
        assert fact in run.failure


def test_a_start_that_is_refused_is_in_log_and_status_at_once(bench, arm, excitation, tmp_path):
    rosout, diagnostics = bench.rosout(), bench.diagnostics()
    _, run = everything(bench, arm, excitation, tmp_path, Programs(), runs=1)
    bench.tick(round(1e9 * (arm.now + 10.0)))  # the last joint state is old by now
    bench.spin_until(lambda: run.complaints.counts.get('start', 0) > 1, 'two refusals')
    run.log_trouble()
    bench.settle()
    status = next(s for d in diagnostics for s in d.status if 'run 1' in s.message)
    assert status.level == DiagnosticStatus.WARN
    assert 's ago' in status.message
    assert sum(status.message in message.msg for message in rosout) == 1
    assert run.condition()[0] == status.message


def test_a_node_that_is_ended_stops_the_arm_and_the_recording(bench, arm, excitation, tmp_path):
    node, run = everything(bench, arm, excitation, tmp_path, Programs())

    def end():
        run.close()
        run._done = True

    carry_on(bench, arm, node, run, fault=end)
    arm.run(arm.now + 1.0, step=0.2)
    bench.settle()
    node.publish_diagnostics()
    assert arm.ends == ['abort', 'succeed']  # a goal that brings it to rest took the place
    assert len(read_recording(tmp_path / 'run', joints=ROBOT.joints)) > 10


@pytest.mark.parametrize(
    ('parameters', 'said'),
    [
        ({'robot': 'no.urdf'}, 'no.urdf'),
        ({'joints': ['knee']}, 'knee'),
        ({'effects': ['glue']}, 'glue'),
        ({'gravity': 'mars'}, 'mars'),
        ({'save_to': 'FILE/results'}, 'file/results'),
    ],
)
def test_what_armid_would_refuse_is_refused_before_the_arm_moves(
    bench, tmp_path, parameters, said
):
    (tmp_path / 'file').write_text('')
    given = {'save_to': str(tmp_path), **parameters}
    given['save_to'] = given['save_to'].replace('FILE', str(tmp_path / 'file'))
    with pytest.raises(ArmidError, match=said):
        bench.add(IdentificationRunNode, Programs(), **given)

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters and arguments of nodes are described, checked, and refused with what to do."""

import gc

from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.parameters.table import NodeParameter, ParameterError
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.running.process import _made, steady, unreadable
import pytest
import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.context import Context
from rclpy.parameter import Parameter
from threadpoolctl import threadpool_info, threadpool_limits

TABLE = (
    NodeParameter('rate', 100.0, 'How often.', 'Hz', limits=(1.0, 1000.0), read_only=False),
    NodeParameter('count', 3, 'How many.', limits=(1, 9), read_only=False),
    NodeParameter('kind', 'a', 'Which.', choices=('a', 'b'), read_only=False),
    NodeParameter('fixed', True, 'Whether.'),
    NodeParameter('names', ['b'], 'Who.', read_only=False),
    NodeParameter('gains', [1.0], 'How much.'),
    NodeParameter('text', '', 'What.'),
)


class Declared(ArmidNode):
    table = TABLE

    def __init__(self, **kwargs):
        super().__init__('declared', **kwargs)

    def condition(self):
        return '', {}


@pytest.mark.parametrize(
    ('name', 'value', 'advice'),
    [
        ('rate', 5000.0, r'5000\.0.*1000 Hz'),
        ('rate', float('nan'), 'nan'),
        ('rate', 'fast', r'100\.0'),
        ('count', 2.0, '3'),
        ('count', 10, '1 to 9'),
        ('kind', 'c', 'a, b'),
        ('kind', 7, 'quote'),
        ('fixed', 1, 'true'),
        ('gains', [], r'\[1\.0\]'),
        ('text', [], 'text'),
    ],
)
def test_a_wrong_override_is_refused_with_what_to_write(bench, name, value, advice):
    with pytest.raises(ParameterError, match=f"'{name}' .*{advice}") as error:
        bench.add(Declared, **{name: value})
    assert '\n' not in str(error.value)


def test_an_integer_is_taken_for_a_float_and_one_value_for_a_list(bench):
    node = bench.add(Declared, rate=50, gains=2, names='a')
    assert node.value('names') == ('a',)
    assert (node.value('rate'), list(node.value('gains'))) == (50.0, [2.0])
    assert node.set_parameters([Parameter('rate', value=60)])[0].successful
    assert node.value('rate') == 60.0


@pytest.mark.parametrize('given', [{'names': []}, {'cli_args': ['-p', 'names:=[]']}])
def test_an_empty_list_is_no_names(bench, given):
    if 'cli_args' in given:
        given = {'cli_args': ['--ros-args', *given['cli_args']]}
    node = bench.add(Declared, **given)
    assert node.value('names') == ()
    assert bench.add(Declared, namespace='other').value('names') == ('b',)


def test_parameters_that_a_node_does_not_have_are_named_once_but_not_those_of_ros(bench, tmp_path):
    said = bench.rosout()
    given = {'bag': str(tmp_path / 'bag'), 'record': False, 'use_sim_time': False}
    node = bench.add(RecorderNode, compresion='zstd', rte=200.0, **given)
    node.warn_of_unknown()
    bench.spin_until(lambda: any("'rte'" in log.msg for log in said), 'the warning')
    (text,) = [log.msg for log in said if "'rte'" in log.msg]
    assert "'compresion'" in text and "'compression'" in text
    assert not any(name in text for name in given)
    assert node.complaints.counts['parameter'] == 1


def test_descriptors_are_complete_and_only_a_valid_value_is_taken_while_running(bench):
    node = bench.add(Declared)
    rate, kind, fixed = (node.describe_parameter(name) for name in ('rate', 'kind', 'fixed'))
    assert '[Hz]' in rate.description and rate.floating_point_range[0].to_value == 1000.0
    assert 'a, b' in kind.description and fixed.read_only and not rate.read_only
    results = node.set_parameters(
        [
            Parameter('rate', value=50.0),
            Parameter('rate', value=0.5),
            Parameter('kind', value='c'),
            Parameter('fixed', value=False),
        ]
    )
    assert [r.successful for r in results] == [True, False, False, False]
    assert node.get_parameter('rate').value == 50.0
    assert all(r.reason for r in results[1:])


def test_a_refused_parameter_is_said_on_rosout_and_counted_on_diagnostics(bench, tmp_path):
    rosout, diagnostics = bench.rosout(), bench.diagnostics()
    node = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['nothing'])
    for _ in range(3):
        node.set_parameters([Parameter('chunk_age', value=100.0)])
    status = bench.diagnose(node, diagnostics)
    bench.spin_until(lambda: any('chunk_age' in m.msg for m in rosout), 'the complaint')
    values = {v.key: v.value for v in status.values}
    assert values['rejected parameter'] == '3'
    assert sum('chunk_age' in m.msg for m in rosout) == 1


@pytest.mark.parametrize(
    'arguments',
    [
        ['-p', 'bag'],
        ['-r', '__node:=not-a-name'],
        ['--params-file', 'nope.yaml'],
        ['--log-level', 'x'],
        ['--nonsense'],
    ],
)
def test_what_ros_cannot_read_is_named(arguments):
    with pytest.raises((RCLError, UnknownROSArgsError)) as error:
        Context().init(['--ros-args', *arguments])
    said = unreadable(error.value)
    assert ' '.join(arguments) in said and 'NAME:=VALUE' in said and ' at /' not in said


def test_a_file_that_is_none_of_parameters_is_named_with_the_line(tmp_path):
    path = tmp_path / 'run.yaml'
    path.write_text('recorder:\n  rate: 3\n')
    with pytest.raises(RCLError) as error:
        Context().init(['--ros-args', '--params-file', str(path)])
    assert str(path) in unreadable(error.value) and 'line 2' in unreadable(error.value)


def test_arguments_that_are_none_of_ros_are_named():
    try:
        with pytest.raises(ParameterError, match=r'robot:=my_arm\.urdf: .*NAME:=VALUE'):
            _made(RecorderNode, ['robot:=my_arm.urdf', '--ros-args', '-p', 'record:=false'])
    finally:
        rclpy.try_shutdown()


def test_linear_algebra_has_one_thread_and_old_objects_are_not_looked_through():
    def threads():
        return {library['num_threads'] for library in threadpool_info()}

    with threadpool_limits(limits=2):
        with steady():
            assert threads() == {1} and gc.get_freeze_count() > 0
        assert 2 in threads() and gc.get_freeze_count() == 0

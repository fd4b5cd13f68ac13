# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recorder keeps what is published, as it is published, and says what it cannot keep."""

import resource
import shutil

from armid_ros.errors import RecordingError
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.recording import read_recording, topics
from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rosidl_generator_py.import_type_support_impl import UnsupportedTypeSupport
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, String

from tests.recording.conftest import iter_raw
from tests.ros.controller import joint_state

SECOND = 10**9
JOINTS = ('a', 'b')


def state(k: int) -> JointState:
    return joint_state(100.0 + 1e-3 * k, JOINTS, [0.1 * k, 1.0], [0.0, 0.0], [2.0, k])


def record(bench, recorder, publisher, count):
    before = recorder.message_count
    for k in range(count):
        publisher.publish(state(k))
    bench.spin_until(lambda: recorder.message_count >= before + count, 'the messages')


@pytest.mark.parametrize(
    ('reliability', 'durability'),
    [
        (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL),
        (ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE),
    ],
)
def test_every_message_is_in_the_bag_with_its_stamp(bench, tmp_path, reliability, durability):
    qos = QoSProfile(depth=1000, reliability=reliability, durability=durability)
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'])
    publisher = bench.matched_publisher(JointState, 'joint_states', qos)
    record(bench, recorder, publisher, 500)
    recorder.close()
    recording = read_recording(tmp_path / 'bag', joints=JOINTS)
    assert recording.report.clean and len(recording) == 500
    assert recording.tau[499, 1] == 499.0
    (topic,) = topics(tmp_path / 'bag')
    assert topic.qos[0].durability.name == durability.name
    first = next(iter_raw(tmp_path / 'bag'))
    assert first.publish_time_ns == 100 * SECOND
    assert deserialize_message(first.cdr, JointState) == state(0)


def test_without_names_all_topics_are_recorded_those_that_come_later_too(bench, tmp_path):
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'))
    states = bench.matched_publisher(JointState, 'joint_states')
    texts = bench.matched_publisher(String, 'namespace/text')
    states.publish(state(1))
    texts.publish(String(data='late'))
    bench.settle()
    recorder.close()
    found = {topic.name: topic.count for topic in topics(tmp_path / 'bag')}
    assert found['/joint_states'] == 1 and found['/namespace/text'] == 1
    assert '/rosout' in found


@pytest.mark.parametrize(
    ('error', 'late'),
    [
        (None, False),
        (UnsupportedTypeSupport('std_msgs'), True),
        (OSError('libx.so: no such file'), False),
    ],
)
def test_a_type_that_cannot_be_loaded_costs_its_topic_alone(
    bench, tmp_path, monkeypatch, error, late
):
    """As the type support of a package that is built for another system."""

    def load():
        if error is not None:
            raise error

    publishers = [bench.probe.create_publisher(t, t.__name__, 10) for t in (Empty, String)]
    monkeypatch.setattr(type(Empty), '_TYPE_SUPPORT', None)
    monkeypatch.setattr(type(Empty), '__import_type_support__', load)
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), record=not late)
    if late:
        recorder.start()
    bench.spin_until(publishers[1].get_subscription_count, 'the recorder')
    for _ in range(3):
        recorder.poll()
    publishers[1].publish(String(data='there'))
    bench.settle()
    said = recorder.condition()[0]
    recorder.close()
    found = {topic.name: topic.count for topic in topics(tmp_path / 'bag')}
    assert found['/String'] == 1 and '/Empty' not in found
    assert recorder.complaints.counts['topic'] == 1
    assert '/Empty' in said and '/String' not in said


def test_start_and_stop_make_one_bag_each_time(bench, tmp_path):
    recorder = bench.add(
        RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'], record=False
    )
    publisher = bench.probe.create_publisher(JointState, 'joint_states', 1000)
    assert not recorder.recording
    refused = bench.call('recorder/stop')
    assert not refused.success and 'no recording' in refused.message
    for _ in range(2):
        assert bench.call('recorder/start').success
        bench.spin_until(lambda: publisher.get_subscription_count() == 1)
        record(bench, recorder, publisher, 10)
        stopped = bench.call('recorder/stop')
        assert stopped.success and '10 messages' in stopped.message
    for name in ('bag', 'bag_1'):
        assert len(read_recording(tmp_path / name, joints=JOINTS)) == 10


@pytest.mark.parametrize('clock', [150, 50])
def test_in_simulated_time_messages_are_logged_at_it_and_not_before_they_were_sent(
    bench, tmp_path, clock
):
    recorder = bench.add(
        RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'], use_sim_time=True
    )
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publisher.publish(state(0))  # before /clock begins: kept until it does
    bench.settle()
    bench.tick(clock * SECOND)
    publisher.publish(state(1))
    bench.spin_until(lambda: recorder.message_count == 2)
    recorder.close()
    logged = [m.log_time_ns for m in iter_raw(tmp_path / 'bag')]
    assert logged == [max(clock * SECOND, 100 * SECOND + k * 10**6) for k in range(2)]


def test_a_wanted_topic_that_nobody_publishes_is_reported(bench, tmp_path):
    diagnostics = bench.diagnostics()
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['nothing'])
    status = bench.diagnose(recorder, diagnostics)
    assert status.level == DiagnosticStatus.WARN and '/nothing' in status.message


def keep_publishing(bench, publisher):
    """Publish until the recorder ends with an error, and return that."""
    with pytest.raises(RecordingError) as refusal:
        for k in range(100_000):
            publisher.publish(state(k % 1000))
            bench.settle()
    return str(refusal.value)


@pytest.fixture
def file_size_limit():
    """Return a function that limits the size of files, as a disk that is full does."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, old)


def test_a_disk_that_is_full_ends_the_recording_with_all_that_was_written(
    bench, tmp_path, file_size_limit
):
    bag = tmp_path / 'bag'
    recorder = bench.add(
        RecorderNode, bag=str(bag), topics=['joint_states'], compression='none', chunk_age=0.01
    )
    publisher = bench.matched_publisher(JointState, 'joint_states')
    record(bench, recorder, publisher, 10)
    file_size_limit(20_000)
    reason = keep_publishing(bench, publisher)
    assert str(bag / 'bag_0.mcap') in reason and 'armid recover' in reason
    assert not recorder.recording
    recording = read_recording(bag / 'bag_0.mcap', joints=JOINTS)
    assert f'{recording.report.messages} messages' in reason
    assert recording.report.messages >= 10


def test_a_disk_that_is_almost_full_ends_the_recording_in_good_order(bench, tmp_path, monkeypatch):
    bag = tmp_path / 'bag'
    recorder = bench.add(RecorderNode, bag=str(bag), topics=['joint_states'], min_free=10.0)
    publisher = bench.matched_publisher(JointState, 'joint_states')
    record(bench, recorder, publisher, 100)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: usage._replace(free=10_000_100))
    recorder.watch()
    assert recorder.complaints.latest and recorder.recording
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: usage._replace(free=9_000_000))
    with pytest.raises(RecordingError, match=r'9 MB.*100'):
        recorder.watch()
    recording = read_recording(bag, joints=JOINTS)
    assert recording.report.clean and len(recording) == 100

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What real bags do to a reader: other orders, parts, repeats, gaps, and clocks that lie."""

from armid_ros.errors import RecordingError
from armid_ros.recording import read_recording, write_recording
from armid_ros.recording.message_types import JOINT_STATE, STRING
from armid_ros.recording.recording import TimeGap
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores

from .conftest import assert_same, JOINTS, messages_of, serialised, swing


@pytest.mark.parametrize('asked', [('elbow', 'wrist', 'shoulder'), ('wrist', 'elbow'), ('wrist',)])
def test_joints_come_in_the_order_asked_and_others_are_passed_over(
    swinging, stamps, write_bag, asked
):
    bag = write_bag(messages_of(swinging, stamps, ['wrist', 'shoulder', 'elbow']))
    assert_same(read_recording(bag, joints=asked), swinging, joints=asked)


def test_where_joints_are_that_were_not_asked_for_is_kept(swinging, stamps, write_bag):
    bag = write_bag(messages_of(swinging, stamps, ['wrist', 'shoulder', 'elbow']))
    others = read_recording(bag, joints=['elbow']).others
    assert [other.joint for other in others] == ['wrist', 'shoulder']
    for other in others:
        q = swinging.q[:, swinging.joints.index(other.joint)]
        assert (other.lowest, other.highest) == (q.min(), q.max())
    assert read_recording(bag, joints=JOINTS).others == ()


def test_an_order_and_a_layout_of_its_own_for_every_message_are_followed(
    swinging, stamps, write_bag
):
    messages = []
    for at, stamp in enumerate(stamps.tolist()):
        order = np.roll([0, 1, 2], at)
        names = [JOINTS[k] for k in order]
        values = [x[[at]][:, order] for x in (swinging.q, swinging.dq, swinging.tau)]
        (cdr,) = serialised(names, [stamp], *values, frame_id='f' * (at % 97))
        messages.append(('/joint_states', cdr, stamp))
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.clean


def test_big_endian_messages_are_read(swinging, stamps, write_bag):
    store = get_typestore(Stores.ROS2_JAZZY)
    little = serialised(JOINTS, stamps, swinging.q, swinging.dq, swinging.tau)
    messages = []
    for cdr, stamp in zip(little, stamps.tolist(), strict=True):
        message = store.deserialize_cdr(cdr, JOINT_STATE)
        big = bytes(store.serialize_cdr(message, JOINT_STATE, little_endian=False))
        messages.append(('/joint_states', big, stamp))
    assert_same(read_recording(write_bag(messages), joints=JOINTS), swinging)


def test_two_halves_with_equal_stamps_are_put_together_exactly(swinging, stamps, write_bag):
    upper = messages_of(swinging, stamps, ['shoulder'])
    lower = messages_of(swinging, stamps, ['wrist', 'elbow'], log=stamps + 5000)
    messages = [message for pair in zip(upper, lower, strict=True) for message in pair]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.merged == len(swinging)
    assert recording.report.interpolated == 0
    assert recording.report.duplicates == 0


def test_two_halves_with_other_stamps_are_interpolated(write_bag):
    fast = swing(2000, period_ns=1_000_000)
    slow = swing(400, period_ns=5_000_000)
    fast_stamps = fast.start_ns + 1_000_000 * np.arange(2000)
    slow_stamps = slow.start_ns + 5_000_000 * np.arange(400)
    messages = messages_of(fast, fast_stamps, ['shoulder', 'elbow'])
    messages += messages_of(slow, slow_stamps, ['wrist'])
    recording = read_recording(write_bag(messages), joints=JOINTS)
    # The slow half ends 4 ms before the fast one.
    assert len(recording) == 1996
    assert recording.report.incomplete == 4
    assert recording.report.interpolated == 1996 - 400
    np.testing.assert_array_equal(recording.q[:, :2], fast.q[:1996, :2])
    # Linear interpolation is off by at most h^2 / 8 times the second derivative.
    bound = (5e-3) ** 2 / 8 * 4.0**2
    assert abs(recording.q[:, 2] - fast.q[:1996, 2]).max() <= bound


def test_nothing_is_interpolated_over_a_gap_of_one_half(swinging, stamps, write_bag):
    upper = messages_of(swinging, stamps, ['shoulder', 'elbow'])
    lower = messages_of(swinging, stamps, ['wrist'])
    del lower[100:200]
    recording = read_recording(write_bag(upper + lower), joints=JOINTS)
    kept = np.r_[0:100, 200:500]
    assert_same(recording, swinging, kept)
    assert recording.report.incomplete == 100
    assert len(recording.report.gaps) == 1
    assert recording.report.gaps[0].t == pytest.approx(0.099)
    assert recording.report.gaps[0].length == pytest.approx(0.101)


def test_repeated_messages_count_once(swinging, stamps, write_bag):
    messages = messages_of(swinging, stamps)
    doubled = [message for message in messages for _ in range(2)]
    recording = read_recording(write_bag(doubled), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'header'
    assert recording.report.duplicates == len(swinging)


def test_gaps_are_reported_with_place_and_length(swinging, stamps, write_bag):
    messages = messages_of(swinging, stamps)
    del messages[300:400], messages[50:52]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging, np.r_[0:50, 52:300, 400:500])
    # Two samples missing are a hiccup, a hundred are a gap.
    assert recording.report.gaps == (TimeGap(pytest.approx(0.299), pytest.approx(0.101)),)
    assert '0.101' in recording.report.describe() and '0.299' in recording.report.describe()


@pytest.mark.parametrize('quantity', ['q', 'dq', 'tau'])
@pytest.mark.parametrize('value', [np.nan, np.inf])
def test_samples_that_are_not_finite_are_dropped(swinging, stamps, write_bag, quantity, value):
    array = getattr(swinging, quantity).copy()
    array[[0, 20, 21, 499], 1] = value
    bag = write_bag(messages_of(swinging, stamps, **{quantity: array}))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging, np.setdiff1d(np.arange(500), [0, 20, 21, 499]))
    assert recording.report.nan == 4
    (lacking,) = recording.report.not_finite
    assert {'q': 'position', 'dq': 'velocity', 'tau': 'effort'}[quantity] in lacking
    assert JOINTS[1] in lacking


def test_many_samples_that_are_not_finite_are_refused(swinging, stamps, write_bag):
    tau = swinging.tau.copy()
    tau[100:300, 2] = np.nan
    bag = write_bag(messages_of(swinging, stamps, tau=tau))
    with pytest.raises(RecordingError, match=r'200.*effort.*wrist'):
        read_recording(bag, joints=JOINTS)
    assert len(read_recording(bag, joints=['shoulder', 'elbow'])) == 500


def test_a_quantity_never_filled_in_is_absent(swinging, stamps, write_bag):
    dq = swinging.dq.copy()
    dq[:, 1] = np.nan
    bag = write_bag(messages_of(swinging, stamps, dq=dq, tau=None))
    recording = read_recording(bag, joints=JOINTS)
    assert recording.dq is None
    assert recording.tau is None
    assert read_recording(bag, joints=['wrist']).dq is not None
    for fact in ('velocity', 'elbow', 'effort'):
        assert fact in recording.report.describe()


@pytest.mark.parametrize(
    ('header', 'why'),
    [
        (lambda stamps: np.zeros_like(stamps), 'zero'),
        (lambda stamps: np.full_like(stamps, stamps[0]), 'advance'),
        (lambda stamps: np.where(np.arange(len(stamps)) % 3, stamps, 0), '167'),
        (lambda stamps: stamps[0] + (stamps - stamps[0]) * 100_000, 'span'),
        (lambda s: s + np.random.default_rng(0).integers(0, 10**9, len(s)), 'jump'),
    ],
)
def test_headers_without_a_believable_clock_give_way_to_the_time_of_reception(
    swinging, stamps, write_bag, header, why
):
    bag = write_bag(messages_of(swinging, header(stamps), log=stamps))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'receive'
    assert why in recording.report.clock_note


def test_simulated_time_faster_than_the_clock_on_the_wall_is_believed(swinging, stamps, write_bag):
    received = stamps[0] + (stamps - stamps[0]) // 20
    bag = write_bag(messages_of(swinging, stamps - stamps[0] + 10**9, log=received))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'header'


def test_malformed_messages_are_dropped_and_counted(swinging, stamps, write_bag):
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = messages_of(swinging, stamps)
    topic, good, _ = messages[0]
    short = store.deserialize_cdr(good, JOINT_STATE)
    short.velocity = short.velocity[:2]  # shorter than the names
    bad = [b'', good[:3], good[:40], good[:-1], good + bytes(16), bytes(len(good))]
    bad.append(bytes(store.serialize_cdr(short, JOINT_STATE)))
    bad.append(good.replace(b'elbow\0', b'elbow\2'))  # a name without its end
    places = 5 + 50 * np.arange(len(bad))
    for at, cdr in zip(places, bad, strict=True):
        messages[at] = (topic, cdr, messages[at][2])
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging, np.setdiff1d(np.arange(500), places))
    assert recording.report.malformed == len(bad)


def test_a_joint_the_topic_does_not_name_is_refused_with_those_it_names(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    with pytest.raises(RecordingError, match=r'/joint_states.*elbo.*hip.*wrist.*--joints elbow'):
        read_recording(tmp_path / 'bag', joints=['elbow', 'elbo', 'hip'])


def test_an_only_topic_needs_no_name_and_names_may_be_relative(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging, topic='/arm/states')
    for topic in (None, 'arm/states', '/arm/states'):
        assert_same(read_recording(tmp_path / 'bag', joints=JOINTS, topic=topic), swinging)


def test_of_several_topics_the_one_that_names_all_joints_is_read(swinging, stamps, write_bag):
    gripper = swing(joints=('finger', 'elbow'))
    messages = messages_of(swinging, stamps, topic='/arm')
    messages += messages_of(gripper, stamps, topic='/gripper')
    bag = write_bag(messages)
    assert read_recording(bag, joints=JOINTS).topic == '/arm'
    assert read_recording(bag, joints=['finger']).topic == '/gripper'
    for joints in (['finger', 'wrist'], ['elbow']):
        with pytest.raises(RecordingError, match=f'{joints[-1]}.*/arm'):
            read_recording(bag, joints=joints)
    assert_same(
        read_recording(bag, joints=['elbow'], topic='/gripper'), gripper, joints=('elbow',)
    )


def test_joint_states_is_preferred_to_what_is_computed_from_it(swinging, stamps, write_bag):
    topics = ('/online_identifier/residual', '/joint_states', '/online_identifier/predicted')
    bag = write_bag([m for topic in topics for m in messages_of(swinging, stamps, topic=topic)])
    assert read_recording(bag, joints=JOINTS).topic == '/joint_states'


def test_a_wrong_topic_is_refused_with_those_there_are(swinging, stamps, write_bag):
    bag = write_bag(messages_of(swinging, stamps))
    with pytest.raises(RecordingError, match=r'/joint,.*/joint_states.*500'):
        read_recording(bag, joints=JOINTS, topic='/joint')
    other = write_bag([('/chatter', b'\0\1\0\0\1\0\0\0\0', 5)], name='other', type_name=STRING)
    with pytest.raises(RecordingError, match=r'/chatter.*std_msgs/msg/String'):
        read_recording(other, joints=JOINTS, topic='/chatter')
    with pytest.raises(RecordingError, match=r'sensor_msgs/msg/JointState.*/chatter'):
        read_recording(other, joints=JOINTS)


@pytest.mark.parametrize(
    ('made', 'fact'),
    [
        (
            lambda run, stamps: [
                (topic, b'\x00\x07' + cdr[2:], at) for topic, cdr, at in messages_of(run, stamps)
            ],
            '/joint_states.*00 07',
        ),
        (lambda run, stamps: messages_of(run, stamps, q=None), '/joint_states.*position'),
        (lambda run, stamps: messages_of(run, 0 * stamps, log=0 * stamps), 'time.*zero'),
        (lambda run, stamps: messages_of(run, stamps)[:1], '1 samples'),
    ],
    ids=['another encapsulation', 'no positions', 'no clock', 'one message'],
)
def test_a_bag_without_motion_is_refused_with_what_it_lacks(
    swinging, stamps, write_bag, made, fact
):
    bag = write_bag(made(swinging, stamps))
    with pytest.raises(RecordingError, match=f'bag: .*{fact}'):
        read_recording(bag, joints=JOINTS)


def test_joints_asked_for_must_differ(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    for joints in ([], ['elbow', 'elbow']):
        with pytest.raises(RecordingError, match='joint'):
            read_recording(tmp_path / 'bag', joints=joints)


@pytest.mark.parametrize(
    ('at', 'back_ns', 'kept'),
    [
        (1800, 30_000_000, slice(0, 1800)),
        (1800, 999_000_000, slice(0, 1800)),
        (1200, 10**12, slice(1200, 3000)),  # a simulation that was reset
    ],
)
def test_of_a_recording_whose_clock_was_set_back_the_longest_run_is_read(
    write_bag, at, back_ns, kept
):
    """Sorted in, the arm would be in two places at once."""
    whole = swing(3000)
    log = 10**13 + 1_000_000 * np.arange(3000)
    header = log - np.where(np.arange(3000) < at, 0, back_ns)
    recording = read_recording(write_bag(messages_of(whole, header, log=log)), joints=JOINTS)
    assert (recording.report.restarted, recording.report.out_of_order) == (1200, 0)
    assert recording.clock == 'header'
    assert_same(recording, whole, kept)


def test_messages_that_a_queue_held_back_are_late_and_no_restart(swinging, stamps, write_bag):
    messages = messages_of(swinging, stamps)
    held = [*messages[:100], *messages[150:200], *messages[100:150], *messages[200:]]
    recording = read_recording(write_bag(held), joints=JOINTS)
    assert recording.report.restarted == 0
    assert recording.report.out_of_order > 0
    assert_same(recording, swinging)


@pytest.mark.parametrize('off', [-(10**18), 50 * 10**9])
@pytest.mark.parametrize('at', [[0], [200, 201], [499]])
def test_a_stamp_that_fits_no_other_costs_its_message_alone(swinging, stamps, write_bag, off, at):
    rubbish = stamps.copy()
    rubbish[at] += off
    bag = write_bag(messages_of(swinging, rubbish, log=rubbish))
    read = read_recording(bag, joints=JOINTS)
    kept = np.delete(np.arange(len(stamps)), at)
    np.testing.assert_array_equal(read.q, swinging.q[kept])
    assert read.report.unstamped == len(at) and read.report.restarted == 0

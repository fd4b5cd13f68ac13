# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What real bags do to a reader: other orders, parts, repeats, gaps, and clocks that lie."""

from armid_ros.errors import RecordingError
from armid_ros.recording import joint_state_cdr, read_recording, TimeGap, write_recording
from armid_ros.recording.message_types import JOINT_STATE, STRING
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores

from .conftest import JOINTS


def test_joints_come_in_the_order_asked_whatever_the_order_of_the_messages(
    swinging, stamps, write_bag, messages_of, assert_same
):
    bag = write_bag(messages_of(swinging, stamps, ['wrist', 'shoulder', 'elbow']))
    asked = ('elbow', 'wrist', 'shoulder')
    assert_same(read_recording(bag, joints=asked), swinging, joints=asked)


def test_joints_not_asked_for_are_passed_over(
    swinging, stamps, write_bag, messages_of, assert_same
):
    bag = write_bag(messages_of(swinging, stamps))
    assert_same(read_recording(bag, joints=['wrist']), swinging, joints=('wrist',))
    wide = ('wrist', 'shoulder')
    assert_same(read_recording(bag, joints=wide), swinging, joints=wide)


def test_where_joints_are_that_were_not_asked_for_is_kept(
    swinging, stamps, write_bag, messages_of
):
    bag = write_bag(messages_of(swinging, stamps, ['wrist', 'shoulder', 'elbow']))
    others = read_recording(bag, joints=['elbow']).others
    assert [other.joint for other in others] == ['wrist', 'shoulder']
    for other in others:
        q = swinging.q[:, swinging.joints.index(other.joint)]
        assert (other.lowest, other.highest) == (q.min(), q.max())
    assert read_recording(bag, joints=JOINTS).others == ()


def test_joints_with_messages_of_their_own_are_kept_as_far_as_they_have_positions(write_bag):
    stamps = 10**9 + 10_000_000 * np.arange(50)
    arm = np.sin(stamps[:, np.newaxis] * 1e-9)
    finger = np.where(np.arange(50) % 2, np.nan, np.linspace(0.0, 0.04, 50))[:, None]
    messages = [
        ('/joint_states', cdr, stamp)
        for names, q in ((('elbow',), arm), (('finger',), finger))
        for cdr, stamp in zip(joint_state_cdr(names, stamps, q), stamps.tolist(), strict=True)
    ]
    silent = joint_state_cdr(('elbow', 'camera'), stamps + 1, arm.repeat(2, axis=1) * np.nan)
    messages += [('/joint_states', cdr, 10**9 + 1) for cdr in silent[:1]]
    (other,) = read_recording(write_bag(messages), joints=['elbow']).others
    assert (other.joint, other.lowest) == ('finger', 0.0)
    assert other.highest == pytest.approx(0.04 * 48 / 49)


def test_an_order_that_changes_from_message_to_message_is_followed(
    swinging, stamps, write_bag, messages_of, assert_same
):
    orders = [['shoulder', 'elbow', 'wrist'], ['wrist', 'elbow', 'shoulder']]
    forms = [messages_of(swinging, stamps, order) for order in orders]
    mixed = [forms[at % 2][at] for at in range(len(stamps))]
    recording = read_recording(write_bag(mixed), joints=swinging.joints)
    assert_same(recording, swinging)
    assert recording.report.clean


def test_a_layout_of_its_own_for_every_message_is_followed(swinging, stamps, write_bag):
    cdr = [
        joint_state_cdr(
            JOINTS, [stamp], swinging.q[[at]], swinging.dq[[at]], frame_id='f' * (at % 97)
        )[0]
        for at, stamp in enumerate(stamps.tolist())
    ]
    messages = [('/joint_states', c, s) for c, s in zip(cdr, stamps.tolist(), strict=True)]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    np.testing.assert_array_equal(recording.q, swinging.q)
    assert recording.report.samples == len(swinging)
    assert recording.report.out_of_order == 0


def test_rubbish_in_the_padding_does_not_matter(swinging, stamps, write_bag):
    rng = np.random.default_rng(1)
    names = ('a', 'bc', 'def')
    # Behind the frame's name, the joints' names, and before values, which are aligned to 8.
    padding = [17, 18, 19, 30, 31, 39, 80, 81, 82, 83, 112, 113, 114, 115]
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = []
    clean = joint_state_cdr(names, stamps, swinging.q, swinging.dq, swinging.tau)
    for cdr, stamp in zip(clean, stamps.tolist(), strict=True):
        noisy = np.frombuffer(cdr, np.uint8).copy()
        noisy[padding] = rng.integers(1, 256, len(padding))
        assert repr(store.deserialize_cdr(noisy.tobytes(), JOINT_STATE)) == repr(
            store.deserialize_cdr(cdr, JOINT_STATE)
        )
        messages.append(('/joint_states', noisy.tobytes(), stamp))
    recording = read_recording(write_bag(messages), joints=names)
    np.testing.assert_array_equal(recording.q, swinging.q)
    np.testing.assert_array_equal(recording.dq, swinging.dq)
    np.testing.assert_array_equal(recording.tau, swinging.tau)
    assert recording.report.clean


def test_big_endian_messages_are_read(swinging, stamps, write_bag, assert_same):
    store = get_typestore(Stores.ROS2_JAZZY)
    little = joint_state_cdr(JOINTS, stamps, swinging.q, swinging.dq, swinging.tau)
    messages = []
    for cdr, stamp in zip(little, stamps.tolist(), strict=True):
        message = store.deserialize_cdr(cdr, JOINT_STATE)
        big = bytes(store.serialize_cdr(message, JOINT_STATE, little_endian=False))
        messages.append(('/joint_states', big, stamp))
    assert_same(read_recording(write_bag(messages), joints=JOINTS), swinging)


def test_another_encapsulation_is_refused_clearly(swinging, stamps, write_bag, messages_of):
    xcdr = [(topic, b'\x00\x07' + cdr[2:], at) for topic, cdr, at in messages_of(swinging, stamps)]
    with pytest.raises(RecordingError, match=r"bag: /joint_states.*encapsulation '00 07'"):
        read_recording(write_bag(xcdr), joints=JOINTS)


def test_two_halves_with_equal_stamps_are_put_together_exactly(
    swinging, stamps, write_bag, messages_of, assert_same
):
    upper = messages_of(swinging, stamps, ['shoulder'])
    lower = messages_of(swinging, stamps, ['wrist', 'elbow'], log=stamps + 5000)
    messages = [message for pair in zip(upper, lower, strict=True) for message in pair]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.merged == len(swinging)
    assert recording.report.interpolated == 0
    assert recording.report.duplicates == 0


def test_two_halves_with_other_stamps_are_interpolated(make_swing, write_bag, messages_of):
    fast = make_swing(2000, period_ns=1_000_000)
    slow = make_swing(400, period_ns=5_000_000)
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


def test_nothing_is_interpolated_over_a_gap_of_one_half(
    swinging, stamps, write_bag, messages_of, assert_same
):
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


def test_repeated_messages_count_once(swinging, stamps, write_bag, messages_of, assert_same):
    messages = messages_of(swinging, stamps)
    doubled = [message for message in messages for _ in range(2)]
    recording = read_recording(write_bag(doubled), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'header'
    assert recording.report.duplicates == len(swinging)
    assert '500 with a repeated stamp dropped' in recording.report.describe()


def test_late_messages_are_sorted_in(swinging, stamps, write_bag, messages_of, assert_same):
    messages = messages_of(swinging, stamps)
    for at in (10, 77, 300):
        messages[at], messages[at + 3] = messages[at + 3], messages[at]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.out_of_order == 9  # the moved one, and the two it was moved over


def test_gaps_are_reported_with_place_and_length(
    swinging, stamps, write_bag, messages_of, assert_same
):
    messages = messages_of(swinging, stamps)
    del messages[300:400], messages[50:52]
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert_same(recording, swinging, np.r_[0:50, 52:300, 400:500])
    # Two samples missing are a hiccup, a hundred are a gap.
    assert recording.report.gaps == (TimeGap(pytest.approx(0.299), pytest.approx(0.101)),)
    assert '1 gap, the longest 0.101 s at 0.299 s' in recording.report.describe()


@pytest.mark.parametrize('quantity', ['q', 'dq', 'tau'])
@pytest.mark.parametrize('value', [np.nan, np.inf])
def test_samples_that_are_not_finite_are_dropped(
    swinging, stamps, write_bag, messages_of, assert_same, quantity, value
):
    array = getattr(swinging, quantity).copy()
    array[[0, 20, 21, 499], 1] = value
    bag = write_bag(messages_of(swinging, stamps, **{quantity: array}))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging, np.setdiff1d(np.arange(500), [0, 20, 21, 499]))
    assert recording.report.nan == 4
    name = {'q': 'position', 'dq': 'velocity', 'tau': 'effort'}[quantity]
    assert f'not finite ({name} of {JOINTS[1]} in 4)' in recording.report.describe()


def test_many_samples_that_are_not_finite_are_refused(swinging, stamps, write_bag, messages_of):
    tau = swinging.tau.copy()
    tau[100:300, 2] = np.nan
    bag = write_bag(messages_of(swinging, stamps, tau=tau))
    with pytest.raises(RecordingError, match=r'200 of 500 samples.*effort of wrist'):
        read_recording(bag, joints=JOINTS)
    assert len(read_recording(bag, joints=['shoulder', 'elbow'])) == 500


def test_a_quantity_never_filled_in_is_absent(swinging, stamps, write_bag, messages_of):
    dq = swinging.dq.copy()
    dq[:, 1] = np.nan
    bag = write_bag(messages_of(swinging, stamps, dq=dq, tau=None))
    recording = read_recording(bag, joints=JOINTS)
    assert recording.dq is None
    assert recording.tau is None
    assert recording.report.absent == ('velocity of elbow', 'effort')
    assert 'Not recorded: velocity of elbow, effort.' in recording.report.describe()
    assert read_recording(bag, joints=['wrist']).dq is not None


def test_positions_are_needed(swinging, stamps, write_bag, messages_of):
    bag = write_bag(messages_of(swinging, stamps, q=None))
    with pytest.raises(RecordingError, match=r'bag: /joint_states has no position'):
        read_recording(bag, joints=JOINTS)


@pytest.mark.parametrize(
    ('header', 'why'),
    [
        (lambda stamps: np.zeros_like(stamps), 'are zero'),
        (lambda stamps: np.full_like(stamps, stamps[0]), 'do not advance'),
        (lambda stamps: np.where(np.arange(len(stamps)) % 3, stamps, 0), 'are zero in 167 of 500'),
        (lambda stamps: stamps[0] + (stamps - stamps[0]) * 100_000, 'span'),
        (
            lambda stamps: stamps + np.random.default_rng(0).integers(0, 10**9, len(stamps)),
            'jump back and forth',
        ),
    ],
)
def test_headers_without_a_believable_clock_give_way_to_the_time_of_reception(
    swinging, stamps, write_bag, messages_of, assert_same, header, why
):
    bag = write_bag(messages_of(swinging, header(stamps), log=stamps))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'receive'
    assert why in recording.report.clock_note
    assert 'Time is that of reception: header stamps' in recording.report.describe()


def test_simulated_time_faster_than_the_clock_on_the_wall_is_believed(
    swinging, stamps, write_bag, messages_of, assert_same
):
    received = stamps[0] + (stamps - stamps[0]) // 20
    bag = write_bag(messages_of(swinging, stamps - stamps[0] + 10**9, log=received))
    recording = read_recording(bag, joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.clock == 'header'


def test_single_messages_without_a_stamp_are_dropped(
    swinging, stamps, write_bag, messages_of, assert_same
):
    header = stamps.copy()
    header[0] = 0
    recording = read_recording(write_bag(messages_of(swinging, header, log=stamps)), joints=JOINTS)
    assert_same(recording, swinging, slice(1, None))
    assert recording.clock == 'header'
    assert recording.report.unstamped == 1


def test_no_clock_at_all_is_refused(swinging, stamps, write_bag, messages_of):
    bag = write_bag(messages_of(swinging, np.zeros_like(stamps), log=np.zeros_like(stamps)))
    with pytest.raises(RecordingError, match=r'no usable time: header stamps are zero, and rec'):
        read_recording(bag, joints=JOINTS)


def test_of_a_simulation_that_was_reset_the_longest_run_is_read(
    make_swing, write_bag, messages_of, assert_same
):
    whole = make_swing(3000)
    stamps = 10**9 + 1_000_000 * np.arange(3000)
    first = messages_of(whole, stamps, log=stamps)[:1500]
    again = messages_of(whole, stamps, log=stamps + 10**10)
    recording = read_recording(write_bag(first + again), joints=JOINTS)
    assert_same(recording, whole)
    assert recording.report.restarted == 1500
    assert recording.clock == 'header'


def test_malformed_messages_are_dropped_and_counted(
    swinging, stamps, write_bag, messages_of, assert_same
):
    messages = messages_of(swinging, stamps)
    topic, good, _ = messages[0]
    bad = [b'', good[:3], good[:40], good[:-1], good + bytes(16), bytes(len(good))]
    for at, cdr in zip((5, 50, 100, 150, 200, 250), bad, strict=True):
        messages[at] = (topic, cdr, messages[at][2])
    recording = read_recording(write_bag(messages), joints=JOINTS)
    kept = np.setdiff1d(np.arange(500), (5, 50, 100, 150, 200, 250))
    assert_same(recording, swinging, kept)
    assert recording.report.malformed == 6


def test_arrays_shorter_than_the_names_are_malformed(swinging, stamps, write_bag):
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = []
    for at, stamp in enumerate(stamps.tolist()):
        cdr = joint_state_cdr(JOINTS, [stamp], swinging.q[[at]], swinging.dq[[at]])[0]
        if at == 7:
            message = store.deserialize_cdr(cdr, JOINT_STATE)
            message.velocity = message.velocity[:2]
            cdr = bytes(store.serialize_cdr(message, JOINT_STATE))
        messages.append(('/joint_states', cdr, stamp))
    recording = read_recording(write_bag(messages), joints=JOINTS)
    assert recording.report.malformed == 1
    assert len(recording) == 499


def test_a_joint_the_topic_does_not_name_is_refused_with_those_it_names(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    with pytest.raises(RecordingError) as refusal:
        read_recording(tmp_path / 'bag', joints=['elbow', 'elbo', 'hip'])
    assert str(refusal.value) == (
        f"{tmp_path / 'bag'}: /joint_states does not name joints 'elbo', 'hip'; "
        'its joints are shoulder, elbow, wrist; --joints elbow reads the others'
    )


def test_an_only_topic_needs_no_name_and_names_may_be_relative(swinging, tmp_path, assert_same):
    write_recording(tmp_path / 'bag', swinging, topic='/arm/states')
    for topic in (None, 'arm/states', '/arm/states'):
        assert_same(read_recording(tmp_path / 'bag', joints=JOINTS, topic=topic), swinging)


def test_of_several_topics_the_one_that_names_all_joints_is_read(
    swinging, make_swing, stamps, write_bag, messages_of, assert_same
):
    gripper = make_swing(joints=('finger', 'elbow'))
    messages = messages_of(swinging, stamps, topic='/arm')
    messages += messages_of(gripper, stamps, topic='/gripper')
    bag = write_bag(messages)
    assert read_recording(bag, joints=JOINTS).topic == '/arm'
    assert read_recording(bag, joints=['finger']).topic == '/gripper'
    with pytest.raises(RecordingError, match=r'no topic names all of finger, wrist.*/arm names s'):
        read_recording(bag, joints=['finger', 'wrist'])
    with pytest.raises(RecordingError, match=r'several topics name all of elbow; say which'):
        read_recording(bag, joints=['elbow'])
    assert_same(
        read_recording(bag, joints=['elbow'], topic='/gripper'), gripper, joints=('elbow',)
    )


def test_joint_states_is_preferred_to_what_is_computed_from_it(
    swinging, stamps, write_bag, messages_of
):
    topics = ('/online_identifier/residual', '/joint_states', '/online_identifier/predicted')
    bag = write_bag([m for topic in topics for m in messages_of(swinging, stamps, topic=topic)])
    assert read_recording(bag, joints=JOINTS).topic == '/joint_states'


def test_a_wrong_topic_is_refused_with_those_there_are(swinging, stamps, write_bag, messages_of):
    bag = write_bag(messages_of(swinging, stamps))
    with pytest.raises(RecordingError, match=r'no topic /joint; .*/joint_states \(500 messages\)'):
        read_recording(bag, joints=JOINTS, topic='/joint')
    other = write_bag([('/chatter', b'\0\1\0\0\1\0\0\0\0', 5)], name='other', type_name=STRING)
    with pytest.raises(RecordingError, match=r'/chatter is a topic of std_msgs/msg/String'):
        read_recording(other, joints=JOINTS, topic='/chatter')
    with pytest.raises(RecordingError, match=r'no topic of sensor_msgs/msg/JointState; the bag h'):
        read_recording(other, joints=JOINTS)


def test_a_bag_of_one_message_is_too_short(swinging, stamps, write_bag, messages_of):
    bag = write_bag(messages_of(swinging, stamps)[:1])
    with pytest.raises(RecordingError, match=r'1 samples are left of 1 messages'):
        read_recording(bag, joints=JOINTS)


def test_joints_asked_for_must_differ(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    for joints in ([], ['elbow', 'elbow']):
        with pytest.raises(RecordingError, match='at least one joint'):
            read_recording(tmp_path / 'bag', joints=joints)


@pytest.mark.parametrize('back_ns', [30_000_000, 100_370_000, 500_000_000, 999_000_000])
def test_a_clock_set_back_by_less_than_a_second_is_a_restart(
    make_swing, write_bag, messages_of, assert_same, back_ns
):
    """Sorted in, the arm would be in two places at once."""
    whole = make_swing(3000)
    log = 10**12 + 1_000_000 * np.arange(3000)
    header = log - np.where(np.arange(3000) < 1800, 0, back_ns)
    recording = read_recording(write_bag(messages_of(whole, header, log=log)), joints=JOINTS)
    assert recording.report.restarted == 1200
    assert recording.report.out_of_order == 0
    assert_same(recording, whole, slice(0, 1800))


def test_messages_that_a_queue_held_back_are_late_and_no_restart(
    swinging, stamps, write_bag, messages_of, assert_same
):
    messages = messages_of(swinging, stamps)
    held = [*messages[:100], *messages[150:200], *messages[100:150], *messages[200:]]
    recording = read_recording(write_bag(held), joints=JOINTS)
    assert recording.report.restarted == 0
    assert_same(recording, swinging)


@pytest.mark.parametrize('off', [-(10**18), -(10**12), 50 * 10**9, 10**18])
@pytest.mark.parametrize('at', [[0], [200], [200, 201], [100, 300], [499]])
def test_a_stamp_that_fits_no_other_costs_its_message_alone(
    swinging, stamps, write_bag, messages_of, off, at
):
    rubbish = stamps.copy()
    rubbish[at] += off
    bag = write_bag(messages_of(swinging, rubbish, log=rubbish))
    read = read_recording(bag, joints=JOINTS)
    kept = np.delete(np.arange(len(stamps)), at)
    np.testing.assert_array_equal(read.q, swinging.q[kept])
    assert read.report.unstamped == len(at) and read.report.restarted == 0

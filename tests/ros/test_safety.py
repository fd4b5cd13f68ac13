# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever comes on joint_states, clocks and services, the commanded set point is safe."""

from itertools import count
import os

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    Excitation,
    Limits,
    plan_run,
    random_feasible,
    transfer_limits,
    TransferPlanner,
)
from armid_ros.nodes import excitation_publisher
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.robots import load_robot
from builtin_interfaces.msg import Time
import numpy as np
import pytest
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rclpy.time import Time as RosTime
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from tests.clearance import path_clearance
from tests.ros.controller import Controller, SECOND

ROBOT = load_robot('humanoid_arm')
SCENE = CollisionScene.of(ROBOT, 0.02)
HOME = (ROBOT.lower + ROBOT.upper) / 2.0
STEP = 0.02
EPOCH = 10_000
TOLERANCE = 0.1
HISTORIES = int(os.environ.get('ARMID_HISTORIES', '30'))


class FakeClock:
    """A clock that a test sets."""

    def __init__(self, seconds, kind):
        self.seconds, self.kind = seconds, kind
        self.ros_time_is_active = False

    def now(self):
        return RosTime(nanoseconds=round(self.seconds() * SECOND), clock_type=self.kind)


class Bed:
    """The real node in front of a controller, message by message, on clocks that a test sets."""

    def __init__(self, bench, excitation, step=STEP, **parameters):
        self.dt = step
        self.displaced = False  # whether the arm seems to stand a little off its path
        self.offset, self.changes, self.paths, self.violations = 0.0, [], [], []
        self.set_points = []
        self.arm = Controller(bench, ROBOT, HOME)
        bodies = ClearanceModel.of(SCENE.bodies, SCENE.clearance)
        limits = transfer_limits(ROBOT, 1.0)
        planner = TransferPlanner(ArmModel(ROBOT), limits, bodies)
        options = {'start': False, 'approach': 1.0, 'tracking_tolerance': TOLERANCE}
        self.node = node = bench.add(
            ExcitationPublisherNode, excitation, planner, **(options | parameters)
        )
        bench.spin_until(lambda: node.readers, 'a subscriber')
        bench.executor.remove_node(node)  # nothing is delivered but by the test
        steady = FakeClock(lambda: self.arm.now + 5.0, ClockType.STEADY_TIME)
        wall = FakeClock(lambda: self.arm.now + self.offset + EPOCH, ClockType.ROS_TIME)
        node._arm._steady, node._arm.stamps._clock, node._executor_of = steady, wall, None
        node.get_clock = lambda: wall
        node._controller._publisher.publish = self._command
        bench.probe.destroy_publisher(self.arm._publisher)
        self.arm._publisher = self
        self.accelerations = np.full(6, np.inf)
        self.limit = 1.01 * ROBOT.velocity_limit
        self._before = self.arm.state(self.arm.now).q[0]

    def _command(self, message):
        if message.header.stamp.sec:
            message.header.stamp.sec -= EPOCH
        self.arm._on_trajectory(message)

    def get_subscription_count(self):
        return 1

    def publish(self, message):
        """Deliver what the arm publishes, changed as the history has it."""
        message.header.stamp.sec += EPOCH
        messages = [message]
        for change in list(self.changes):
            messages = change(messages)
        for one in messages:
            self.node._arm._states.callback(serialize_message(one))

    def step(self):
        """Let a little time go by, and check the set point."""
        arm = self.arm
        arm.now = round(arm.now + self.dt, 6)
        arm._publish()
        if round(arm.now / self.dt) % round(0.05 / self.dt) == 0:
            self.node._timer.callback()
        state = arm.state(arm.now)
        q, dq = state.q[0], state.dq[0]
        if np.any(q < ROBOT.lower - 1e-6) or np.any(q > ROBOT.upper + 1e-6):
            self.violations.append(f'{arm.now:.2f} s: outside the limits: {q}')
        moved, ratio = np.abs(q - self._before), np.abs(state.ddq[0]) / self.accelerations
        if arm.faults.stuck is not None:
            # a controller begins where the arm is, not its set point
            moved[arm.faults.stuck] = ratio[arm.faults.stuck] = 0.0
        if np.any(np.abs(dq) > self.limit) or np.any(moved > self.limit * self.dt + 1e-4):
            self.violations.append(f'{arm.now:.2f} s: too fast: {dq}, {moved / self.dt}')
        if self.paths:
            if ratio.max() > 1.05:
                self.violations.append(f'{arm.now:.2f} s: {ratio.max():.2f} x the acceleration')
            away = min(np.abs(path - q).max(axis=1).min() for path in self.paths)
            allowed = 3.0 * TOLERANCE if self.displaced or arm.faults.stuck is not None else 0.02
            if away > allowed:
                self.violations.append(f'{arm.now:.2f} s: {away:.3f} from every planned path')
        self._before = q
        self.set_points.append(q)

    def run(self, seconds):
        for _ in range(round(seconds / self.dt)):
            self.step()

    def suspend(self, seconds):
        """Let time go by without the node, and without a check of the set point."""
        self.arm.now = round(self.arm.now + round(seconds / self.dt) * self.dt, 6)
        self._before = self.arm.state(self.arm.now).q[0]

    def call(self, name):
        """Call a service; what it refuses is no violation."""
        try:
            getattr(self.node, name)()
        except TrajectoryError as error:
            return str(error)
        if self.node._gate is not None and name != 'stop':
            self.paths.append(self.node._gate.run.motion().q)
            self.accelerations = self.node._gate.limits.acceleration
        return ''

    def close(self):
        """End the node as a signal does; the arm has to come to rest."""
        self.node._controller.settle = lambda patience: None
        self.node.close()
        self.run(2.0)
        if self.arm.faults.stuck is None:
            speed = np.abs(self.arm.state(self.arm.now).dq).max()
            if speed > 1e-3:
                self.violations.append(f'not at rest after the end: {speed}')
        nearest = path_clearance(SCENE.bodies, np.array(self.set_points)).min()
        if nearest <= 0.0:
            self.violations.append(f'bodies or the floor were met: {nearest:.4f} m')


@pytest.fixture(scope='module')
def excitation():
    rng = np.random.default_rng(3)
    limits = Limits.of(ROBOT, speed='fast')
    bodies = ClearanceModel.of(SCENE.bodies, SCENE.clearance)
    drawn = random_feasible(ArmModel(ROBOT), limits, 2.0, 3, rng, clearance=bodies)
    return Excitation(drawn, 1, 0.5)


def other(message, joint, value, *, add=False):
    """Return a copy of a message with another position of a joint."""
    copy = JointState(header=message.header, name=message.name, velocity=message.velocity)
    position = list(message.position)
    j = message.name.index(ROBOT.joints[joint])
    position[j] = position[j] + value if add else value
    copy.position = position
    return copy


def glitched(joint, value, count, *, add):
    """Return a change of so many messages."""
    left = [count]

    def change(messages):
        if left[0] <= 0:
            return messages
        left[0] -= 1
        return [other(m, joint, value, add=add) for m in messages]

    return change


def joined_by(joint, value):
    """Return a second sender, which has another pose."""
    return lambda messages: [x for m in messages for x in (m, other(m, joint, value, add=True))]


def repeated():
    """Return a driver that repeats two old messages for ever."""
    kept = []

    def change(messages):
        kept.extend(messages)
        return [kept[len(kept) % min(len(kept), 2)]] if kept else []

    return change


VALUES = {
    'elbow - 2 rad': (3, -2.0, True),
    'shoulder + 4 rad': (0, 4.0, True),
    'a wrapped encoder': (2, -2.0 * np.pi, True),
    'degrees': (3, 143.0, False),
    '1e6': (1, 1e6, False),
    '4e9': (1, 4e9, False),
    '1e300': (1, 1e300, False),
    'not a number': (0, np.nan, False),
    'infinite': (0, np.inf, False),
    'within limits, elsewhere': (0, 0.6, True),
    'just beyond the tolerance': (4, 0.15, True),
}


@pytest.mark.parametrize('count', [1, 8, 10**6])
@pytest.mark.parametrize('value', VALUES)
def test_wrong_positions_do_not_move_the_arm(bench, excitation, value, count):
    bed = Bed(bench, excitation)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.7)
    joint, number, add = VALUES[value]
    bed.displaced = value == 'just beyond the tolerance'
    bed.changes.append(glitched(joint, number, count, add=add))
    bed.run(2.0)
    assert not bed.violations
    if count > 4:
        assert bed.node.elapsed is None
        assert np.abs(bed.arm.state(bed.arm.now).dq).max() < 1e-3
    if count == 1 and value != 'just beyond the tolerance':
        assert bed.node.elapsed is not None


def test_a_second_sender_that_begins_at_the_same_pose_stops_the_arm(bench, excitation):
    bed, stands = Bed(bench, excitation), []

    def joined(messages):
        stands.extend(messages[:1] if not stands else ())
        (message,) = messages
        second = JointState(header=message.header, name=stands[0].name[::-1])
        second.position = stands[0].position[::-1]
        return [message, second]

    bed.changes.append(joined)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(3.0)
    assert bed.node.elapsed is None and 'publisher' in bed.node.condition()[0]
    assert np.abs(bed.arm.state(bed.arm.now).dq).max() < 1e-3
    assert not bed.violations


def with_gripper(messages):
    """Return messages beside those of another device."""
    return [
        x
        for m in messages
        for x in (JointState(header=m.header, name=['finger'], position=[0.0]), m)
    ]


def by_halves(messages):
    """Return messages of two drivers of one arm."""
    fields = ('name', 'position', 'velocity', 'effort')
    return [
        JointState(header=m.header, **{f: getattr(m, f)[half] for f in fields})
        for m in messages
        for half in (slice(3), slice(3, None))
    ]


@pytest.mark.parametrize('change', [with_gripper, by_halves])
@pytest.mark.parametrize('count', [1, 10**6])
def test_efforts_of_one_of_several_senders_are_compared(bench, excitation, change, count):
    bed, left = Bed(bench, excitation, effort_factor=2.0), [count]

    def loaded(messages):
        for message in messages if bed.node.elapsed and left[0] > 0 else ():
            message.effort = [50.0, *list(message.effort)[1:]]
            left[0] -= 1
        return messages

    bed.changes += [loaded, change]
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(0.5)
    assert (bed.node.elapsed is None) == (count > 1)


@pytest.mark.parametrize('tolerance', [0.002, 0.02])
def test_a_stuck_joint_is_not_pushed_after_the_stop(bench, excitation, tolerance):
    """The set point goes back by what it went on after the fault, however much that is."""
    bed = Bed(bench, excitation, step=0.005, tracking_tolerance=tolerance)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.6)
    joint = int(np.argmax(np.abs(bed.arm.state(bed.arm.now).dq)))
    bed.arm.faults.stuck = joint
    bed.run(3.0)
    pushes = np.abs(np.array(bed.set_points)[:, joint] - bed.arm.q[joint])[-600:]
    assert pushes.max() > 3.0 * tolerance and pushes[-1] < 1e-3
    assert not bed.violations


def test_frozen_positions_without_velocities_do_not_turn_the_arm_round(bench, excitation):
    bed, frozen = Bed(bench, excitation), []

    def freeze(messages):
        for message in messages:
            message.velocity = []
            if bed.node.elapsed and bed.node.elapsed > 1.5:
                frozen.append(message.position)
                message.position = frozen[0]
        return messages

    bed.changes.append(freeze)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(3.0)
    stop = np.array([point.positions for point in bed.arm.accepted[1].points])
    away = [np.abs(bed.paths[0] - q).max(axis=1).min() for q in stop]
    assert max(away) < 0.01 and not bed.violations


def test_an_arm_that_was_not_heard_of_while_it_was_planned_is_not_started(
    bench, excitation, monkeypatch
):
    bed = Bed(bench, excitation)
    bed.run(0.6)

    def planning(*args, **options):
        bed.arm.now += 0.6
        return plan_run(*args, **options)

    monkeypatch.setattr(excitation_publisher, 'plan_run', planning)
    assert 'no joint state' in bed.call('start')
    bed.run(0.6)
    bed.node.ends = lambda: True
    monkeypatch.undo()
    assert 'end' in bed.call('start')
    assert not bed.arm.accepted


@pytest.mark.parametrize('seconds', [1.0, 60.0])
def test_a_process_that_is_suspended_says_so(bench, excitation, seconds):
    """As by Ctrl-Z: the arm goes on, and the first message is heard before a timer is called."""
    bed = Bed(bench, excitation)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.0)
    bed.suspend(seconds)
    bed.run(1.0)
    assert bed.node.activity == 'stopped' and 'not supervised' in bed.node.condition()[0]
    assert not bed.violations


def test_without_joint_states_it_is_unknown_whether_the_arm_has_stopped(bench, excitation):
    bed = Bed(bench, excitation)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.5)
    bed.changes.append(lambda messages: [])
    bed.run(3.0)
    assert 'unknown' in bed.node.condition()[0] and not bed.violations
    assert len(bed.arm.accepted[1].points) > 40  # all of the way to rest, at 100 Hz


def test_the_clock_of_a_run_cannot_be_changed(bench, excitation):
    bed = Bed(bench, excitation)
    result = bed.node.set_parameters([Parameter('use_sim_time', value=True)])[0]
    assert not result.successful and 'clock' in result.reason


def stamped(message, seconds):
    """Return a stamp so much later."""
    stamp = message.header.stamp
    return Header(stamp=Time(sec=stamp.sec + seconds, nanosec=stamp.nanosec))


#: Fields of messages that no driver should send.
MALFORMED = {
    'renamed': lambda m: {'name': [f'other_{name}' for name in m.name]},
    'shorter': lambda m: {'position': m.position[:2]},
    'without positions': lambda m: {'position': []},
    'nameless': lambda m: {'name': []},
    'twice': lambda m: {'name': [m.name[0], *list(m.name)[:-1]]},
    'late': lambda m: {'header': stamped(m, 3600)},
    'early': lambda m: {'header': stamped(m, -3600)},
    'overflowing': lambda m: {'header': Header(stamp=Time(sec=2**31 - 1))},
    'infinite velocity': lambda m: {'velocity': [np.inf] * len(m.name)},
    'infinite effort': lambda m: {'effort': [-np.inf] * len(m.name)},
}


@pytest.mark.parametrize('count', [1, 10**6])
@pytest.mark.parametrize('spoil', MALFORMED)
def test_malformed_states_do_not_move_the_arm(bench, excitation, spoil, count):
    bed = Bed(bench, excitation)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.7)
    left = [count]

    def change(messages):
        for message in messages if left[0] > 0 else ():
            for field, value in MALFORMED[spoil](message).items():
                setattr(message, field, value)
        left[0] -= 1
        return messages

    bed.changes.append(change)
    bed.run(2.0)
    bed.changes.clear()
    bed.run(0.1)
    bed.close()
    assert not bed.violations
    assert not bed.node.complaints.defects


@pytest.mark.parametrize('offset', [3600.0, -3600.0, -0.6, -0.3, 0.45])
def test_a_step_of_the_clock_disables_nothing(bench, excitation, offset):
    bed = Bed(bench, excitation)
    bed.run(0.6)
    assert not bed.call('start')
    bed.run(1.5)
    bed.offset = offset
    bed.run(0.3)
    assert bed.node.elapsed == pytest.approx(1.8, abs=0.02)
    assert not bed.call('stop')
    bed.run(1.0)
    assert np.abs(bed.arm.state(bed.arm.now).dq).max() < 1e-3
    assert not bed.violations


def moved(way):
    """Return an arm of which a joint goes a way, a function of time."""
    times = count(STEP, STEP)
    return lambda messages: [other(m, 3, way(next(times)), add=True) for m in messages]


def said_to_move(messages):
    """Return messages with frozen positions and a velocity."""
    for message in messages:
        message.velocity = [2.0] * len(message.name)
    return messages


@pytest.mark.parametrize(
    ('change', 'seconds'),
    [
        (lambda messages: [], 0.6),
        (None, 0.01),
        (moved(lambda t: 0.1 * t), 0.6),
        (moved(lambda t: 0.1 * t), 0.09),
        (moved(lambda t: 0.01 * np.sin(2.0 * np.pi * 10.0 * t)), 0.6),
        (said_to_move, 0.6),
        (repeated(), 0.6),
        (joined_by(0, 1.0), 0.6),
        (glitched(0, 9.0, 10**6, add=False), 0.6),
    ],
    ids=[
        'silent', 'one', 'moving', 'moving for 90 ms', 'vibration', 'velocity', 'repeats',
        'two senders', 'beyond a limit',
    ],
)  # fmt: skip
def test_an_arm_that_is_not_known_to_be_at_rest_is_not_started(bench, excitation, change, seconds):
    bed = Bed(bench, excitation)
    if change is not None:
        bed.changes.append(change)
    bed.run(seconds)
    assert bed.call('start')
    assert not bed.arm.accepted


@pytest.mark.parametrize('offset', [3610.0, -0.45, 0.06])
@pytest.mark.parametrize('zero_stamp', [False, True])
def test_clocks_apart_are_refused_with_both_times_where_stamps_are_sent(
    bench, excitation, offset, zero_stamp
):
    bed = Bed(bench, excitation, zero_stamp=zero_stamp)
    bed.offset = offset
    bed.run(0.6)
    refusal = bed.call('start')
    for time in (EPOCH + bed.arm.now + offset, EPOCH + bed.arm.now):
        assert (f'{time:.3f} s' in refusal) is not zero_stamp


def test_a_callback_that_fails_stops_the_arm(bench, excitation, monkeypatch):
    bed = Bed(bench, excitation)
    bed.run(0.6)
    bed.call('start')
    bed.run(1.5)
    monkeypatch.setattr(bed.node._arm.monitor, 'update', lambda *_: 1 / 0)
    bed.run(1.0)
    assert len(bed.arm.accepted) == 2 and bed.node.elapsed is None
    assert np.abs(bed.arm.state(bed.arm.now).dq).max() < 1e-3
    assert not bed.violations
    assert bed.node.complaints.defects
    bed.node.complaints.defects = 0


@pytest.mark.parametrize('fault', ['stuck', 'elbow - 2 rad', 'effort'])
def test_at_1_khz_the_first_stop_comes_within_20_ms(bench, excitation, fault):
    bed = Bed(bench, excitation, step=0.001, effort_factor=2.0)
    bed.run(0.4)
    bed.call('start')
    bed.run(1.6)
    if fault == 'stuck':
        bed.node.set_parameters([Parameter('tracking_tolerance', value=0.001)])
        bed.arm.faults.stuck = int(np.argmax(np.abs(bed.arm.state(bed.arm.now).dq)))
    elif fault == 'effort':
        bed.arm.faults.torque = 50.0
    else:
        bed.changes.append(glitched(3, -2.0, 10**6, add=True))
    begun = bed.arm.now
    while len(bed.arm.accepted) < 2:
        bed.step()
    assert bed.arm.now - begun <= 0.02
    assert fault != 'effort' or 'N m' in bed.node.condition()[0]


def event(bed, rng):
    """Let something happen that nobody planned."""
    joint = int(rng.integers(6))
    kind = rng.integers(12)
    name = list(VALUES)[rng.integers(len(VALUES))]
    value, bed.displaced = VALUES[name], bed.displaced or name == 'just beyond the tolerance'
    if kind < 3:
        bed.changes.append(glitched(*value[:2], int(rng.integers(1, 30)), add=value[2]))
    elif kind == 3:
        bed.changes.append(joined_by(joint, rng.normal()))
    elif kind == 4:
        bed.changes.append(repeated())
    elif kind == 5:
        bed.changes.append(lambda messages: [])
    elif kind == 6:
        bed.offset += rng.choice([3600.0, -3600.0, -0.6, -0.3, 0.45, 0.03])
    elif kind == 7:
        bed.arm.faults.stuck = joint
    elif kind == 8:
        bed.changes.clear()
        bed.offset = 0.0
    elif kind == 9:
        bed.suspend(rng.uniform(0.1, 3.0))
    else:
        bed.call(rng.choice(['start', 'stop', 'rehearse']))


@pytest.mark.parametrize('first', range(0, HISTORIES, 10))
def test_random_histories(bench, excitation, first):
    for seed in range(first, min(first + 10, HISTORIES)):
        rng = np.random.default_rng(seed)
        bed = Bed(bench, excitation, zero_stamp=bool(seed % 2))
        bed.run(0.6)
        assert not bed.call('start')
        for _ in range(int(rng.integers(1, 7))):
            bed.run(rng.uniform(0.02, 1.2))
            event(bed, rng)
        bed.run(0.5)
        bed.close()
        bed.node.destroy_node()
        assert not bed.violations, f'history {seed}: {bed.violations[:3]}'
        assert not bed.node.complaints.defects, f'history {seed}: {bed.node.complaints.latest}'

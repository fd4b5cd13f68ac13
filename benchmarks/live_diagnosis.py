# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Effects that appear in a running arm: delay and correctness of the live diagnosis.

The simulated humanoid arm and the node `live_diagnosis` run in one process, in lock step. Joint
states at 200 Hz have torque noise of 0.05 N m and encoders of 18 bits. They are passed directly,
because topics would be late on a busy machine. The arm moves along random harmonics. In the first
16 s the node measures the misfit of the model. Then the parameter `effects` of the running arm
gets one effect of the catalogue.

A draw is right if the first name that the node proposes within 30 s is the effect on its joint. A
name before the effect appears, or another first name, is wrong. During a diagnosis the arm moves
on for its processor time, as with a separate process. An effect has a tenth of the torque of its
joint, or the largest typical size. Finally the arm moves for half an hour without a change.

    python -m benchmarks.live_diagnosis [--draws 40] [--seed 0] [--minutes 30]

"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, parse_effect
from armid_ros.motion import Motion
from armid_ros.nodes.live import LiveDiagnosis, LiveSettings, Worker
from armid_ros.nodes.live.assistant import Result
from armid_ros.nodes.live_diagnosis import LiveDiagnosisNode
from armid_ros.nodes.lockstep import EPOCH_NS, Stage
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.robots import load_robot
from armid_ros.simulation import Reference
import numpy as np
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from benchmarks.changes import working_motion

ROBOT = load_robot('humanoid_arm')
RATE = 200.0
KNOWN = (
    'viscous_friction:viscous_coefficient=0.3',
    'coulomb_friction:coulomb_torque=0.2',
    'torque_offset:torque_offset=0.05',
)
#: The arm with the effects that the diagnosis knows.
ARM = ArmModel.of(ROBOT, effects=KNOWN)
#: Time before the effect appears, and longest accepted time until it is named [s].
BEFORE, WANTED = 20.0, 30.0
#: Duration of the motion from which the node measures the misfit of the model [s].
LEARNING = 16.0
#: Rms torque of an effect over that of its joint.
SHARE = 0.1
#: Smallest part of `SHARE` for an effect of the largest typical size.
LEAST = 1.0 / 3.0
#: Number of tried joints to find one with a typical size.
_TRIES = 50
#: Effects that may appear, each with the quantity that is set.
KINDS = (
    ('viscous_friction', 'viscous_coefficient'),
    ('coulomb_friction', 'coulomb_torque'),
    ('torque_offset', 'torque_offset'),
    ('torque_gain', 'gain_error'),
    ('joint_spring', 'spring_stiffness'),
    ('rotor_inertia', 'rotor_inertia'),
    ('encoder_offset', 'encoder_offset'),
    ('quadratic_friction', 'quadratic_coefficient'),
)


class Unhurried:
    """
    Executor of diagnoses in this process, which delays answers by their processor time.

    Attributes
    ----------
    now : float
        Time of the arm [s].

    """

    def __init__(self) -> None:
        self._worker, self._result = Worker(), None
        self._due = self.now = 0.0

    @property
    def busy(self) -> bool:
        """Return whether an answer is pending."""
        return self._result is not None

    def ask(self, task: str, argument: object) -> None:
        """Run a diagnosis, and set the time at which its answer is available."""
        begun = time.process_time()
        self._result = self._worker.run(task, argument)
        self._due = self.now + time.process_time() - begun

    def poll(self) -> Result | None:
        """Return the answer once it is available, and None before that time."""
        if self.now < self._due:
            return None
        result, self._result = self._result, None
        return result

    def close(self) -> None:
        """Do nothing, because this executor has no process to end."""


def drawn(along: Motion, kind: tuple[str, str], rng: np.random.Generator) -> str:
    """Return an effect as text, with the share `SHARE` of the rms torque of a random joint."""
    name, quantity = kind
    largest = next(own.typical[1] for own in CATALOGUE[name].quantities if own.name == quantity)
    torque, unit = ARM.torque(along), 1e-3
    for _ in range(_TRIES):
        joint = str(rng.choice(ROBOT.joints))
        more = ARM.with_effect(*parse_effect(f'{name}@{joint}:{quantity}={unit}', ROBOT))
        column = ROBOT.joints.index(joint)
        of_joint = np.sqrt(np.mean(torque[:, column] ** 2))
        of_unit = np.sqrt(np.mean((more.torque(along) - torque)[:, column] ** 2)) / unit
        size = float(SHARE * of_joint / of_unit)
        if size <= largest / LEAST:
            break
    return f'{name}@{joint}:{quantity}={min(size, largest):.6g}'


class Bench:
    """Simulated arm and live diagnosis as nodes in lock step."""

    def __init__(self, stage: Stage, along: Motion) -> None:
        self.plant = stage.add(
            SimulatedArmNode,
            None,
            EPOCH_NS,
            rate=RATE,
            real_time_factor=0.0,
            use_sim_time=False,
            effects=list(KNOWN),
            torque_noise=[0.05],
            resolution=[2.4e-5],
            start=','.join(repr(float(q)) for q in along.q[0]),
        )
        self.live = LiveDiagnosis(ARM, LiveSettings(learning=LEARNING))
        self.helper = Unhurried()
        self.node = stage.add(LiveDiagnosisNode, self.live, self.helper)
        self._stage = stage
        stage.spin_until(self._connected, 'discovery')
        self.plant._arm.set_trajectory(Reference.of(along))

    def _connected(self) -> bool:
        """Publish the time, and return whether both nodes have found each other."""
        self.plant.publish_clock()
        self.node.joint_states.match()
        return bool(self.plant.readers and self.node.get_clock().now().nanoseconds)

    def run(self, seconds: float) -> Iterator[float]:
        """Run both nodes for some seconds, and yield the time of each diagnosis [s]."""
        for count in range(round(seconds * RATE)):
            stamp = self.plant.step()
            self.helper.now += 1.0 / RATE
            self.node.take_joint_states(serialize_message(self.plant.joint_state))
            self._stage.spin_until(
                lambda stamp=stamp: self.node.last_stamp_ns == stamp, 'joint_states'
            )
            if self.node.take_answer():
                yield count / RATE

    @property
    def proposed(self) -> list[list[str]]:
        """Names and joints of the effects that the node proposes."""
        return [[name, *joints] for name, joints in self.live.named]


def draw(number: int, seed: int) -> tuple[bool, str]:
    """Add an effect to a running arm; return whether it is named, and a line of text."""
    rng = np.random.default_rng(number + 1000 * seed)
    along = working_motion(BEFORE + WANTED + 6.0, rng.uniform(1.0, 2.0), rng)
    effect = drawn(along, KINDS[number % len(KINDS)], rng)
    name, _, place = effect.partition(':')[0].partition('@')
    with Stage() as stage:
        nodes = Bench(stage, along)
        early = any(nodes.proposed for _ in nodes.run(BEFORE))
        (done,) = nodes.plant.set_parameters([Parameter('effects', value=[*KNOWN, effect])])
        assert done.successful, done.reason
        delay = next((t for t in nodes.run(WANTED) if nodes.proposed), np.nan)
        right = not early and nodes.proposed[:1] == [[name, place]]
        verdict = 'right' if right else 'WRONG'
        return right, f'{number:3} {verdict} {delay:5.1f} s  {effect}  {nodes.proposed}'


def quiet(minutes: float, seed: int) -> tuple[int, int, list[list[list[str]]]]:
    """Return numbers of diagnoses and of false names, and proposals, without a change."""
    rng = np.random.default_rng([1000, seed])
    asked, named, proposed = 0, 0, []
    for _ in range(max(1, round(minutes / 5.0))):
        with Stage() as stage:
            nodes = Bench(stage, working_motion(304.0, rng.uniform(1.0, 2.0), rng))
            for _ in nodes.run(min(300.0, 60.0 * minutes)):
                latest = nodes.live.latest
                named += bool(latest is not None and latest.named)
                if nodes.proposed:
                    proposed.append(nodes.proposed)
            asked += nodes.live.asked
    return asked, named, proposed


def main() -> None:
    """Print the result of each drawn effect, and the false names without a change."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--draws', type=int, default=40)
    parser.add_argument('--seed', type=int, default=0, help='other draws of the same kinds')
    parser.add_argument('--minutes', type=float, default=30.0)
    chosen = parser.parse_args()
    begun, right = time.process_time(), 0
    for number in range(chosen.draws):
        ok, line = draw(number, chosen.seed)
        right += ok
        print(line, flush=True)
    print(f'named rightly within {WANTED:g} s: {right} of {chosen.draws}')
    if chosen.minutes:
        asked, named, proposed = quiet(chosen.minutes, chosen.seed)
        print(
            f'{chosen.minutes:g} min without a change: {asked} diagnoses, {named} with a name, '
            f'proposed: {proposed}'
        )
    print(f'{time.process_time() - begun:.0f} s of processor time')


if __name__ == '__main__':
    main()

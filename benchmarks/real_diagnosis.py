# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Effects that the diagnosis names in recordings of real machines.

There are three questions with known answers. Which effects are named from the rigid body alone? Is
an effect named that was removed from the model? Is an effect named that was added to the measured
torque, with its noise, friction and errors? The recordings are in the folder of the environment
variable ARMID_DATA.

    python -m benchmarks.real_diagnosis [TEXT ...]    # only the rows that have one of the texts

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
import sys
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, Diagnosis
from armid_ros.effects import CATALOGUE
from armid_ros.identification import identify
from armid_ros.motion import FloatArray
from armid_ros.recording import read_recording, Recording
from armid_ros.robots import load_robot
import numpy as np
from scipy import signal

from benchmarks import real_recordings

#: Known effects of each machine, with their joints (empty: all joints).
KNOWN: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    'emps': (
        ('viscous_friction', ()),
        ('coulomb_friction', ()),
        ('torque_offset', ()),
        ('asymmetric_friction', ()),
    ),
    'tx40': (
        ('viscous_friction', ()),
        ('coulomb_friction', ()),
        ('torque_offset', ()),
        ('rotor_inertia', ()),
        ('coupled_joint_friction', ('joint_5', 'joint_6')),
    ),
    'ur10': (('viscous_friction', ()), ('coulomb_friction', ()), ('torque_offset', ())),
}
#: Cut-off of the positions from which an added effect is computed [Hz].
_BAND = {'emps': 40.0, 'tx40': 20.0, 'ur10': 6.0}

#: Function from position, velocity, acceleration and load of a joint to a torque, all (N,).
Law = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

LAWS: dict[str, Law] = {
    'quadratic_friction': lambda q, dq, ddq, load: dq * np.abs(dq),
    'torque_ripple': lambda q, dq, ddq, load: np.sin(12.0 * q),
    'joint_spring': lambda q, dq, ddq, load: q - q.mean(),
    'torque_offset': lambda q, dq, ddq, load: np.ones_like(q),
    'rotor_inertia': lambda q, dq, ddq, load: ddq,
    'load_dependent_friction': lambda q, dq, ddq, load: np.abs(load) * np.sign(dq),
}


@dataclass(frozen=True)
class Question:
    """
    A question to the diagnosis whose answer is known.

    Attributes
    ----------
    machine : str
        emps, tx40 or ur10.
    what : str
        'from rigid', 'without NAME' or 'with NAME'.
    name : str
        Effect that has to be named; empty for 'from rigid'.
    joint : str
        Joint of the effect; empty for all joints that have it.
    size : float
        Rms of the added torque that a fit of the known model does not absorb, over the rms
        residual without it, or over the noise if that is larger.

    """

    machine: str
    what: str
    name: str = ''
    joint: str = ''
    size: float = 0.0

    @property
    def label(self) -> str:
        """Question in a few words."""
        where = f' in {self.joint}' if self.joint else ''
        return f'{self.machine} {self.what} {self.name}{where}'.strip()


def questions(machines: Machines) -> Iterator[Question]:
    """Yield all questions; an added effect acts on the joint in which it is most visible."""
    for machine in KNOWN:
        yield Question(machine, 'from rigid')
    for machine, terms in KNOWN.items():
        for name, _ in terms:
            if name != 'torque_offset' or machine != 'emps':  # part of the asymmetry there
                yield Question(machine, 'without', name)
    for machine, joints in (
        ('ur10', ('shoulder_lift_joint', 'elbow_joint', 'wrist_2_joint')),
        ('tx40', ('joint_1', 'joint_3', 'joint_5')),
    ):
        for name in LAWS:
            if name not in {known for known, _ in KNOWN[machine]}:
                asked = [Question(machine, 'with', name, joint, 3.0) for joint in joints]
                yield max(asked, key=machines.visible)


class Machines:
    """Cache of the recordings and models of all machines."""

    def __init__(self, data: Path, out: Path) -> None:
        self._data, self._out = data, out
        self._read: dict[str, tuple[ArmModel, Recording]] = {}
        self._left: dict[str, FloatArray] = {}

    def bare(self, machine: str) -> tuple[ArmModel, Recording]:
        """Return the rigid-body model and the recording of a machine."""
        if machine not in self._read:
            maker = getattr(real_recordings, machine)
            bags = maker(self._data) if machine == 'ur10' else maker(self._data, self._out)
            robot = load_robot(str(bags.robot))
            recording = read_recording(bags.bags[0], joints=robot.joints)
            self._read[machine] = ArmModel(robot), recording
        return self._read[machine]

    def ask(self, question: Question) -> Diagnosis:
        """Return the diagnosis of a question."""
        bare, recording = self.bare(question.machine)
        without = question.name if question.what == 'without' else None
        arm = bare if question.what == 'from rigid' else known_arm(bare, question.machine, without)
        if question.what == 'with':
            recording = self.with_effect(question)
        return diagnose(arm, [recording], rng=np.random.default_rng(0))

    def with_effect(self, question: Question) -> Recording:
        """Return the recording with the torque of an effect added to the measured torque."""
        _, recording = self.bare(question.machine)
        size = question.size / self.visible(question)
        return replace(recording, tau=recording.tau + size * self._added(question))

    def visible(self, question: Question) -> float:
        """Return the rms share of an added torque that stays in the residual of a refit."""
        bare, recording = self.bare(question.machine)
        known = known_arm(bare, question.machine, None)
        with_it = replace(recording, tau=recording.tau + self._added(question))
        without, fitted = (
            identify(known, [one], rng=np.random.default_rng(0)).training[0]
            for one in (recording, with_it)
        )
        rest = fitted.residual - without.residual
        seen = np.sqrt(np.mean(rest**2, axis=0, where=without.informative))
        joint = bare.robot.joints.index(question.joint)
        return float(seen[joint] / self.left(question.machine)[joint])

    def _added(self, question: Question) -> FloatArray:
        """Return torque of an effect, (N, n) [N m], scaled to the rms residual of its joint."""
        arm, recording = self.bare(question.machine)
        joint = arm.robot.joints.index(question.joint)
        rate = 1.0 / float(np.median(np.diff(recording.t)))
        low = signal.butter(4, _BAND[question.machine], fs=rate)
        q, tau = (signal.filtfilt(*low, x[:, joint]) for x in (recording.q, recording.tau))
        dq = np.gradient(q, recording.t)
        friction = np.column_stack([dq, np.sign(dq)])
        load = tau - friction @ np.linalg.lstsq(friction, tau, rcond=None)[0]
        shape = LAWS[question.name](q, dq, np.gradient(dq, recording.t), load)
        added = np.zeros_like(recording.tau)
        added[:, joint] = shape * self.left(question.machine)[joint] / np.sqrt(np.mean(shape**2))
        return added

    def left(self, machine: str) -> FloatArray:
        """Return the rms residual or, if larger, the noise of each joint, (n,) [N m]."""
        if machine not in self._left:
            bare, recording = self.bare(machine)
            found = diagnose(
                known_arm(bare, machine, None), [recording], rng=np.random.default_rng(0)
            )
            assert found.gap is not None
            self._left[machine] = np.maximum(found.gap.after, found.gap.floor)
        return self._left[machine]


def known_arm(bare: ArmModel, machine: str, without: str | None) -> ArmModel:
    """Return the model of a machine with all known effects, except a given effect."""
    arm = bare
    for name, joints in KNOWN[machine]:
        if name != without:
            arm = arm.with_effect(CATALOGUE[name].on(arm.robot, joints or None))
    return arm


def answered(question: Question, found: Diagnosis) -> str:
    """Return 'first', 'named', 'among' (rivals) or 'NOT': the rank of the right effect."""
    if not question.name:
        return ''
    wanted = {question.joint} if question.joint else set()
    places = [k for k, f in enumerate(found.findings) if wanted <= set(f.joints) or not f.joints]
    if any(found.findings[k].name == question.name for k in places):
        return 'first' if found.findings[0].name == question.name else 'named'
    if any(question.name in found.findings[k].ambiguous_with for k in places):
        return 'among'
    return 'NOT'


def error_percent(found: Diagnosis) -> float:
    """Return the relative torque error with the named effects, over informative samples [%]."""
    assert found.gap is not None
    squares = np.zeros(2)
    for one in found.gap.overlays:
        used = one.trajectory.informative
        squares += [np.sum(x**2, where=used) for x in (one.measured - one.after, one.measured)]
    return float(100.0 * np.sqrt(squares[0] / squares[1]))


def main() -> None:
    """Print question and answer for each machine."""
    texts = sys.argv[1:]
    with tempfile.TemporaryDirectory() as out:
        machines = Machines(real_recordings.folder(), Path(out))
        for question in questions(machines):
            if texts and not any(text in question.label for text in texts):
                continue
            begin = time.process_time()
            found = machines.ask(question)
            named = '; '.join(
                '|'.join((f.name, *f.ambiguous_with))
                + (f'@{",".join(f.joints)}' if len(f.joints) < 4 else f' in {len(f.joints)}')
                for f in found.findings
            )
            print(
                f'{question.label:52s} {answered(question, found):6s} {found.verdict:10s} '
                f'{error_percent(found):5.2f} % {time.process_time() - begin:5.1f} s  {named}',
                flush=True,
            )


if __name__ == '__main__':
    main()

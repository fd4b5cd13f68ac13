# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Changes of real machines between two days, and their diagnoses.

A model is identified on day 1; the recordings of day 2 are diagnosed, and those of day 1 again.
The changes are known: two builds of a double pendulum; recorded pushes on it by its own motors;
two bobs of a simple pendulum; a hand that guides it; and none, for free motions of a Franka FR3.
The recordings are in the folder of the environment variable ARMID_DATA; its README files give
sources and licences.

    python -m benchmarks.real_changes [TEXT ...]    # only the questions that have one of the texts

"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import gzip
import io
from pathlib import Path
import sys
import tempfile
from types import MappingProxyType

from armid_ros.errors import ArmidError
from armid_ros.recording import Recording
from armid_ros.robots import load_robot, Robot
import numpy as np

from benchmarks.real_recordings import example_robot, folder
from benchmarks.two_days import ask, identification_of

_C0 = tuple(f'C0_sysid/trajectory_0{k}' for k in range(5))
_C1 = tuple(
    f'C1_sysid/20230629-{time}' for time in ('143339', '143524', '143601', '143704', '143747')
)
#: Duration of the swing-up of the simple pendulum [s].
_SWING_UP = 8.0


@dataclass(frozen=True)
class RealDays:
    """
    Recordings and description of a real machine on two days.

    Attributes
    ----------
    name : str
        Name of the case.
    robot : Robot
        Description by the authors of the data.
    day_1, day_2 : tuple of Recording
        Recordings before and after the change.
    held_out : tuple of Recording
        Held-out recordings of day 2; empty if there are too few.
    wanted : str
        The right answer, in words.

    """

    name: str
    robot: Robot
    day_1: tuple[Recording, ...]
    day_2: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    wanted: str


def builds(data: Path, out: Path) -> RealDays:
    """Return builds C.0 and C.1 of the double pendulum as days 1 and 2, with equal commands."""
    before, after = ([_pendulum(data, name, 'tau_meas') for name in names] for names in (_C0, _C1))
    return RealDays(
        'double pendulum, builds C.0 and C.1',
        _double_pendulum(data, out, 'design_C.0_model_3.1'),
        tuple(before),
        tuple(after[:-1]),
        tuple(after[-1:]),
        'Coulomb friction of both joints doubled (0.068 -> 0.154, 0.075 -> 0.129 N m); '
        'the tip 12 % lighter',
    )


def pushes(data: Path, out: Path, task: str = 'acrobot') -> RealDays:
    """Return the double pendulum without (day 1) and with pushes from outside (day 2)."""
    before, after = {
        'acrobot': (('experiment01', 'experiment02'), ('experiment01', 'experiment04')),
        'pendubot': (('experiment02',), ('experiment02',)),
    }[task]
    return RealDays(
        f'double pendulum, {task} pushed',
        _double_pendulum(data, out, 'design_C.1_model_1.1'),
        tuple(_pendulum(data, f'C1_{task}_unperturbed/{run}', 'tau_con') for run in before),
        tuple(_pendulum(data, f'C1_{task}_perturbed/{run}', 'tau_con') for run in after),
        (),
        'pushes from outside, twice a joint; or unknown',
    )


def payload(data: Path, out: Path) -> RealDays:
    """Return the simple pendulum with its plain bob (day 1) and with a bob of 1 kg (day 2)."""
    return _swings(
        data,
        'plain bob and 1 kg',
        _swing(data, 'payload_1kg/energy_shaping', _SWING_UP),
        'payload at the same length (m g l 4.08 -> 8.49 N m), or refused: its torque is '
        'collinear with Coulomb friction',
    )


def hand_guided(data: Path, out: Path) -> RealDays:
    """Return the simple pendulum, moving freely (day 1) and guided by a hand (day 2)."""
    return _swings(
        data,
        'guided by a hand',
        _swing(data, 'other_runs/gravity_compensation_hand_guided'),
        'a push from outside at all times, or unknown',
    )


def _swings(data: Path, what: str, after: Recording, wanted: str) -> RealDays:
    """Return the simple pendulum with its plain bob as day 1, and a recording as day 2."""
    robot = data / 'dfki_simple_pendulum' / 'parameters' / 'dfki_simple_pendulum.urdf'
    before = (
        _swing(data, 'payload_0p5kg/energy_shaping', _SWING_UP),
        _swing(data, 'other_runs/ddp_swingup'),
        _swing(data, 'other_runs/dircol_swingup'),
    )
    name = f'simple pendulum, {what}'
    return RealDays(name, load_robot(str(robot), gravity='earth'), before, (after,), (), wanted)


def fr3(data: Path, out: Path, first: Sequence[int] = (0, 1)) -> RealDays:
    """Return an unchanged Franka FR3; day 1 has the motions `first`, day 2 all other motions."""
    files = sorted((data / 'franka_fr3_teleop' / 'data').glob('*.npy.gz'))
    robot = load_robot(str(example_robot('panda_description/urdf/panda.urdf')), gravity='earth')
    runs = [_franka(path, robot.joints) for path in files]
    rest = [k for k in range(len(runs)) if k not in first]
    return RealDays(
        f'FR3, motions {first[0] + 1} and {first[1] + 1}, and the others',
        robot,
        tuple(runs[k] for k in first),
        tuple(runs[k] for k in rest),
        (),
        'nothing',
    )


#: All cases, by name.
DAYS: Mapping[str, Callable[[Path, Path], RealDays]] = MappingProxyType(
    {
        'builds': builds,
        'pushes': pushes,
        'pendubot pushes': lambda data, out: pushes(data, out, 'pendubot'),
        'payload': payload,
        'hand': hand_guided,
        'fr3 12-34': fr3,
        'fr3 13-24': lambda data, out: fr3(data, out, (0, 2)),
        'fr3 14-23': lambda data, out: fr3(data, out, (0, 3)),
    }
)


def main() -> None:
    """Print the true change and the answer of the diagnosis for each machine."""
    texts = sys.argv[1:]
    with tempfile.TemporaryDirectory() as out:
        for name, load in DAYS.items():
            if texts and not any(text in name for text in texts):
                continue
            days = load(folder(), Path(out))
            print(f'\n{days.name}\n    wanted   {days.wanted}')
            for what, recordings, validate in (
                ('day 2', days.day_2, days.held_out),
                ('day 1', days.day_1, ()),
            ):
                try:
                    arm = identification_of(days.robot, days.day_1).arm
                    answer = ask(arm, recordings, validate=validate, baseline=days.day_1)
                except ArmidError as error:
                    print(f'    {what}    refused: {error}')
                    continue
                names = '; '.join(map(str, answer.headline))
                print(
                    f'    {what}    {answer.verdict:14s} {names} [{answer.seconds:.1f} s]',
                    flush=True,
                )


def _pendulum(data: Path, name: str, torque: str) -> Recording:
    path = data / 'dfki_double_pendulum' / f'{name}.csv.gz'
    columns = np.genfromtxt(path, delimiter=',', names=True)
    q, dq, tau = (
        np.column_stack([columns[f'{quantity}{k}'] for k in (1, 2)])
        for quantity in ('pos_meas', 'vel_meas', torque)
    )
    return _recording(('Joint1', 'Joint2'), columns['time'], q, dq, tau)


def _swing(data: Path, name: str, end: float = np.inf) -> Recording:
    path = data / 'dfki_simple_pendulum' / f'{name}.csv'
    path = path if path.exists() else path.with_suffix('.csv.gz')
    values = np.loadtxt(path, delimiter=',', skiprows=1)  # headers differ, the order does not
    t, q, dq, tau = values[values[:, 0] - values[0, 0] <= end, :4].T
    return _recording(('Joint_1',), t, q[:, None], dq[:, None], tau[:, None])


def _franka(path: Path, joints: tuple[str, ...]) -> Recording:
    table = np.load(io.BytesIO(gzip.decompress(path.read_bytes())))
    return _recording(
        joints, 1e-9 * (table[:, 0] - table[0, 0]), table[:, 1:8], table[:, 8:15], table[:, 15:22]
    )


def _recording(
    joints: tuple[str, ...], t: np.ndarray, q: np.ndarray, dq: np.ndarray, tau: np.ndarray
) -> Recording:
    """Return a recording that begins at time zero, without repeated time stamps."""
    later = np.concatenate([[True], np.diff(np.maximum.accumulate(t)) > 0.0])
    t, q, dq, tau = (x[later] for x in (t, q, dq, tau))
    return Recording(joints=joints, t=t - t[0], q=q, dq=dq, tau=tau)


def _double_pendulum(data: Path, out: Path, design: str) -> Robot:
    """
    Return the description of a double pendulum, corrected for the recorded motion.

    The link 'world', which the description lacks, is added. The joints are made continuous, as
    swing-ups exceed the described limits of half a turn.

    """
    path = data / 'dfki_double_pendulum' / 'parameters' / design / 'acrobot.urdf'
    text = path.read_text(encoding='utf-8')
    begin = text.index('>', text.index('<robot')) + 1
    text = f'{text[:begin]}\n  <link name="world"/>{text[begin:]}'
    whole = out / f'{design}.urdf'
    whole.write_text(text.replace('"revolute"', '"continuous"'), encoding='utf-8')
    return load_robot(str(whole), gravity='earth')


if __name__ == '__main__':
    main()

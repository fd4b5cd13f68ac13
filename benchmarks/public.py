# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A public benchmark of diagnosis: recordings of arms on two days, and a score of the answers.

    python -m benchmarks.public make FOLDER --seed 7 [--cases 24]
    python -m benchmarks.public answer FOLDER answers.json [--method diagnosis|bic|parameters]
    python -m benchmarks.public score FOLDER.truth.json answers.json

A case is a folder with `arm.urdf` (its masses are up to 6 % wrong), three bags of day 1, three of
day 2, and one more of day 2 that may be used for validation. Between the days one thing changed,
or nothing did. `answers.json` has an object for each folder, with the keys of `diagnosis.json`:

    {"case_00": {"verdict": "named", "effects": [{"name": "payload", "joints": ["joint_6"]}]}}

Rules: an answer uses only the folder; the method is fixed before the cases are made; a seed is
scored once. The maker of the cases keeps seed and truth secret until the answers are given.

"""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
import json
from pathlib import Path
from typing import Any
from zlib import crc32

from armid_ros.api.arguments import read_recording
from armid_ros.diagnosis import diagnose, diagnosis_document, DiagnosisSettings
from armid_ros.recording import Recording, write_recording
from armid_ros.robots import load_robot, Robot
import numpy as np

from benchmarks.bic_selection import bic_selection
from benchmarks.lived_scoring import LivedJudged, LivedTruth, score
from benchmarks.metrics import table
from benchmarks.two_days import Answer, answer_of, identification_of
from tests.hidden.lived.cases import case_of
from tests.hidden.lived.specification import LivedSpec, specify

#: Number of standard errors from which a difference of two values is a change.
SIGNIFICANT = 4.0
#: Effects that correspond to one parameter of an identified model; others are link errors.
EFFECT_OF = {
    'viscous_coefficient': 'viscous_friction',
    'coulomb_torque': 'coulomb_friction',
    'torque_offset': 'torque_offset',
}


def specification(seed: int, index: int) -> LivedSpec:
    """Return the specification of a case, on an arm that the seed draws."""
    own, shared = (crc32(f'public {seed} {what} {index}'.encode()) for what in ('case', 'shared'))
    arm = f'drawn-{3 + own % 5}-{1000 + seed}'
    return replace(specify('development', index), arm=arm, seed=own, shared_seed=shared)


def make(folder: Path, seed: int, count: int) -> None:
    """Write cases in random order, and their truth to a file beside the folder."""
    truth, order = {}, np.random.default_rng(seed).permutation(count).tolist()
    for number, index in enumerate(order):
        try:
            case = case_of(specification(seed, index))
        except RuntimeError as error:  # the cause cannot be made large enough in this arm
            print(f'case {number} left out: {error}')
            continue
        name = f'case_{number:02d}'
        (folder / name).mkdir(parents=True)
        (folder / name / 'arm.urdf').write_text(case.robot.urdf, encoding='utf-8')
        days = {'day_1': case.day_1, 'day_2': case.day_2, 'held_out': (case.held_out,)}
        for day, runs in days.items():
            for k, run in enumerate(runs):
                write_recording(folder / name / f'{day}_{k}', run.recording)
        truth[name] = asdict(replace(LivedTruth.of(case), key=name))
    text = json.dumps(truth, indent=1, default=np.ndarray.tolist)
    folder.with_name(f'{folder.name}.truth.json').write_text(text + '\n', encoding='utf-8')


def answer(case: Path, method: str) -> dict[str, Any]:
    """Return the answer of a method to one case."""
    robot = load_robot(str(case / 'arm.urdf'))
    day_1, day_2, held_out = (
        [read_recording(path, robot) for path in sorted(case.glob(f'{day}_*'))]
        for day in ('day_1', 'day_2', 'held_out')
    )
    if method == 'parameters':
        return changed_parameters(robot, day_1, [*day_2, *held_out])
    arm, rng = identification_of(robot, day_1).arm, np.random.default_rng(0)
    if method == 'bic':
        causes = bic_selection(arm, [*day_2, *held_out], DiagnosisSettings(), rng)
        named = [{'name': one.effect.name, 'joints': one.effect.joints} for one in causes]
        return {'verdict': 'named' if named else 'consistent', 'effects': named}
    return diagnosis_document(diagnose(arm, day_2, validate=held_out, baseline=day_1, rng=rng))


def changed_parameters(
    robot: Robot, before: list[Recording], after: list[Recording]
) -> dict[str, Any]:
    """Identify both days; name the parameter with the most significant difference."""
    first, second = (identification_of(robot, day).estimate for day in (before, after))
    shared = [one for one in first.parameters if one in second.parameters]
    k, j = ([day.parameters.index(one) for one in shared] for day in (first, second))
    spread = np.sqrt(first.std[k] ** 2 + second.std[j] ** 2)
    z = np.abs(second.values[j] - first.values[k]) / np.where(spread > 0.0, spread, np.inf)
    if z.max() < SIGNIFICANT:
        return {'verdict': 'consistent', 'effects': []}
    one = shared[int(np.argmax(z))]
    name = EFFECT_OF.get(one.name, 'link_inertia')
    return {'verdict': 'named', 'effects': [{'name': name, 'joints': [one.joint]}]}


def judged(truth: Path, answers: Path) -> list[LivedJudged]:
    """Read the truth and the answers to it; a case without an answer has failed."""
    given = json.loads(answers.read_text(encoding='utf-8'))
    found = []
    for name, facts in json.loads(truth.read_text(encoding='utf-8')).items():
        for key in ('gravity', 'described', 'felt'):
            facts[key] = np.array(facts[key])
        facts['joints'] = tuple(facts['joints'])
        facts['parameters'] = tuple(map(tuple, facts['parameters']))
        own = Answer('failed', error='no answer')
        if name in given:
            own = answer_of(given[name], float('nan'))
        found.append(LivedJudged(LivedTruth(**facts), own))
    return found


def main() -> None:
    """Make cases, answer them or score answers."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.public', description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    commands = parser.add_subparsers(dest='command', required=True)
    command = commands.add_parser('make', help='write cases and their truth')
    command.add_argument('folder', type=Path)
    command.add_argument('--seed', type=int, required=True)
    command.add_argument('--cases', type=int, default=24)
    command = commands.add_parser('answer', help='answer all cases by a method')
    command.add_argument('folder', type=Path)
    command.add_argument('answers', type=Path)
    methods = ('diagnosis', 'bic', 'parameters')
    command.add_argument('--method', choices=methods, default='diagnosis')
    command = commands.add_parser('score', help='compare answers with the truth')
    command.add_argument('truth', type=Path)
    command.add_argument('answers', type=Path)
    options = parser.parse_args()
    if options.command == 'make':
        make(options.folder, options.seed, options.cases)
    elif options.command == 'answer':
        cases = sorted(options.folder.glob('case_*'))
        found = {case.name: answer(case, options.method) for case in cases}
        options.answers.write_text(json.dumps(found, indent=1) + '\n', encoding='utf-8')
    else:
        cases = judged(options.truth, options.answers)
        print('\n'.join(one.line for one in cases))
        print(table(score(cases)))


if __name__ == '__main__':
    main()

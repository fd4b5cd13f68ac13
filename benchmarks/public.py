# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A public benchmark of diagnosis: recordings of arms on two days, and a score of the answers.

The generators are tests, so `armid bench` exists only in a clone, after `make armid-bench`.

A case is a folder with `arm.urdf` (its masses are up to 6 % wrong), three bags of day 1, three of
day 2, and one more of day 2 that may be used for validation. Between the days one thing changed,
or nothing did. `answers.json` has an object for each folder, with the keys of `diagnosis.json`:

    {"case_00": {"verdict": "named", "effects": [{"name": "payload", "joints": ["joint_6"]}]}}

Methods: `diagnosis` is this tool; `bic` is a plain ranking of the same causes; `parameters`,
`figaroh` and `sysid` identify both days and name the parameter with the most significant
difference.

Rules: an answer uses the folder alone; the method is fixed before the cases are made; one seed is
scored once, from committed code. Whoever makes the cases keeps the seed, which is the truth, until
the answers are given. `--keep` adds the score to results/public.json; `python -m benchmarks.rates`
shows it on public.md.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
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
from benchmarks.lived_scoring import LivedJudged, score, VISIBLE
from benchmarks.metrics import Metric, rate
from benchmarks.other_ways import Estimates, figaroh_estimates, sysid_days
from benchmarks.two_days import Answer, answer_of, identification_of
from tests.hidden.lived.cases import case_of, LivedCase
from tests.hidden.lived.specification import specify

#: Number of standard errors from which a difference of two values is a change.
SIGNIFICANT = 4.0
#: Effects that correspond to one parameter of an identified model; others are link errors.
EFFECT_OF = {
    'viscous_coefficient': 'viscous_friction',
    'coulomb_torque': 'coulomb_friction',
    'torque_offset': 'torque_offset',
    'rotor_inertia': 'rotor_inertia',
}
#: Scores of the methods.
RESULTS = Path(__file__).parent / 'results' / 'public.json'


def cases(seed: int, count: int) -> Iterator[tuple[str, LivedCase]]:
    """Yield folder name and case in random order, for arms that the seed determines."""
    order = np.random.default_rng(seed).permutation(count).tolist()
    for number, index in enumerate(order):
        own, shared = (
            crc32(f'public {seed} {what} {index}'.encode()) for what in ('case', 'shared')
        )
        arm = f'drawn-{3 + own % 5}-{1000 + seed}'
        spec = replace(specify('development', index), arm=arm, seed=own, shared_seed=shared)
        try:
            yield f'case_{number:02d}', case_of(spec)
        except RuntimeError as error:  # the cause cannot be made large enough in this arm
            print(f'case {number} left out: {error}')


def make(folder: Path, seed: int, count: int) -> None:
    """Write descriptions and recordings of all cases, without the true causes."""
    for name, case in cases(seed, count):
        (folder / name).mkdir(parents=True)
        (folder / name / 'arm.urdf').write_text(case.robot.urdf, encoding='utf-8')
        days = {'day_1': case.day_1, 'day_2': case.day_2, 'held_out': (case.held_out,)}
        for day, runs in days.items():
            for k, run in enumerate(runs):
                write_recording(folder / name / f'{day}_{k}', run.recording)


def answer(case: Path, method: str) -> dict[str, Any]:
    """Return the answer of a diagnosis method to one case."""
    robot = load_robot(str(case / 'arm.urdf'))
    day_1, day_2, held_out = (
        [read_recording(path, robot) for path in sorted(case.glob(f'{day}_*'))]
        for day in ('day_1', 'day_2', 'held_out')
    )
    if method in DAYS:
        return changed_parameter(*DAYS[method](robot, day_1, [*day_2, *held_out]))
    arm, rng = identification_of(robot, day_1).arm, np.random.default_rng(0)
    if method == 'bic':
        causes = bic_selection(arm, [*day_2, *held_out], DiagnosisSettings(), rng)
        named = [{'name': one.effect.name, 'joints': one.effect.joints} for one in causes]
        return {'verdict': 'named' if named else 'consistent', 'effects': named}
    return diagnosis_document(diagnose(arm, day_2, validate=held_out, baseline=day_1, rng=rng))


def own_days(robot: Robot, *days: list[Recording]) -> list[Estimates]:
    """Return value and standard deviation of each parameter and day, by this tool."""
    found = [identification_of(robot, day).estimate for day in days]
    return [
        {
            (name.name, name.joint): (value, std)
            for name, value, std in zip(one.parameters, one.values, one.std, strict=True)
        }
        for one in found
    ]


#: Methods that identify both days: from robot and recordings to estimates.
DAYS: dict[str, Callable[..., list[Estimates]]] = {
    'parameters': own_days,
    'figaroh': lambda robot, *days: [figaroh_estimates(robot, day) for day in days],
    'sysid': sysid_days,
}


def changed_parameter(before: Estimates, after: Estimates) -> dict[str, Any]:
    """Return an answer that names the parameter with the most significant difference."""
    most, found = SIGNIFICANT, {'verdict': 'consistent', 'effects': []}
    for (name, joint), (value, std) in before.items():
        other, spread = after.get((name, joint), (value, 0.0))
        error = float(np.hypot(std, spread))
        z = abs(other - value) / error if error > 0.0 else 0.0
        if z > most:
            effect = {'name': EFFECT_OF.get(name, 'link_inertia'), 'joints': [joint]}
            most, found = z, {'verdict': 'named', 'effects': [effect]}
    return found


def judged(seed: int, count: int, answers: Path) -> list[LivedJudged]:
    """Create the cases again, and judge the answers; a missing answer has failed."""
    given = json.loads(answers.read_text(encoding='utf-8'))
    missing = Answer('failed', error='no answer')
    return [
        LivedJudged.of(case, answer_of(given[name], np.nan) if name in given else missing)
        for name, case in cases(seed, count)
    ]


def scored(found: Sequence[LivedJudged]) -> list[Metric]:
    """Return the rates of judged cases: of all, and of those that change one parameter."""
    own = {*EFFECT_OF.values(), 'payload', 'link_inertia'}
    simple = [one for one in found if one.cause and one.gap >= VISIBLE and one.cause.name in own]
    return [*score(found), rate('simple cause named first', simple, lambda one: one.first)]


def keep(method: str, metrics: Sequence[Metric]) -> None:
    """Add the score of a method to the results."""
    kept = json.loads(RESULTS.read_text(encoding='utf-8')) if RESULTS.exists() else {}
    kept[method] = {
        one.name.strip(): [round(one.value * one.count), one.count]
        for one in metrics
        if np.isfinite(one.value) and np.isfinite(one.low)
    }
    rows = (f' {json.dumps(name)}: {json.dumps(one)}' for name, one in kept.items())
    RESULTS.write_text('{\n' + ',\n'.join(rows) + '\n}\n', encoding='utf-8')

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of the diagnosis for effects hidden in recordings of MuJoCo arms.

The cases are those of tests/hidden, whose data come from code that is independent of the
diagnosis; rates have 95 % intervals (Wilson). For scope and rules see tests/hidden/README.md. The
sizes of hidden effects are multiples of the noise, so every size is material (`material` is zero).

    python -m benchmarks.hidden_effects [SET] [--slice] [--only TEXT]
        [--single] [--out FOLDER]

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, replace
import json
import multiprocessing
import os
from pathlib import Path
import time
import traceback

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.diagnosis.verdict.finding import Overlay
from armid_ros.effects import CATALOGUE
import numpy as np

from benchmarks.laboratory_scoring import Judged, score, Truth
from benchmarks.looks import look, results_of
from benchmarks.metrics import table
from benchmarks.two_days import Answer, answer_of, known_arm
from tests.hidden.cases import Case, make_case, VISIBLE
from tests.hidden.specification import case_list, CaseSpec, SETS

#: Interval of the cases of a kind that are in the slice.
SLICE = {'single': 9, 'free': 20, 'pair': 8, 'outside': 5, 'removed': 10}


def true_arm(case: Case) -> ArmModel:
    """Return the true arm, with those hidden effects that the catalogue has."""
    arm = ArmModel(case.true_robot)
    for name, values in case.true_known.items():
        joints = tuple(j for j, value in zip(arm.robot.joints, values, strict=True) if value)
        if joints:
            effect = CATALOGUE[name].on(arm.robot, joints)
            arm = arm.with_effect(effect, values[values != 0.0])
    for hidden in case.effects:
        told = {(p.name, p.joint): p.value for p in hidden.parameters}
        effect = CATALOGUE[hidden.name].on(arm.robot, hidden.joints)
        shape = [
            told.get((name.name, name.joint), value)
            for name, value in zip(effect.shape_parameters(arm.robot), effect.shape, strict=True)
        ]
        effect = effect.with_shape(np.reshape(shape, (len(effect.owners), -1)))
        names = effect.parameters(arm.robot)
        arm = arm.with_effect(effect, [told.get((n.name, n.joint), 0.0) for n in names])
    return arm


def run_diagnosis(case: Case) -> tuple[Answer, float]:
    """Diagnose a case; return the answer, and the share of the gap that is closed."""
    from armid_ros.diagnosis import diagnose, diagnosis_document

    library = tuple(name for name in CATALOGUE if name not in case.removed)
    begin = time.process_time()
    diagnosis = diagnose(
        known_arm(case.robot, case.known),
        [bag.recording for bag in case.bags],
        validate=[bag.recording for bag in case.validation],
        settings=DiagnosisSettings(library=library, material=0.0),
        rng=np.random.default_rng(0),
    )
    seconds = time.process_time() - begin
    known = all(effect.name in CATALOGUE for effect in case.effects)
    closed = np.nan
    if known and diagnosis.gap is not None:
        closed = share_closed(case, diagnosis.gap.overlays)
    return answer_of(diagnosis_document(diagnosis), seconds), closed


def share_closed(case: Case, overlays: Sequence[Overlay]) -> float:
    """
    Return the share of the explainable gap that is closed in held-out motions.

    The share is (e0 - e1) / (e0 - e_true), with the losses of the model without the named effects,
    with them, and of the true arm. It is nan if these motions hardly excite the effect.

    """
    truth = true_arm(case)
    e0, e1, e_true = np.zeros((3, truth.robot.n_joints))
    for one in overlays:
        told = one.trajectory.informative / one.sigma / np.sqrt(one.trajectory.informative.sum())
        left = one.measured - one.before, one.measured - one.after, one.trajectory.residual(truth)
        for total, part in zip((e0, e1, e_true), left, strict=True):
            total += np.sum((part * told) ** 2, axis=0)
    explainable = e0 - e_true
    if truth.robot.n_joints * explainable.max() < VISIBLE:
        return float('nan')
    return float(np.clip(np.sum(e0 - e1) / np.sum(explainable), 0.0, 1.0))


def judge(spec: CaseSpec) -> Judged:
    """Make a case and diagnose it; an exception counts as an outcome."""
    return _judged(make_case(spec))


def judge_single(spec: CaseSpec) -> Judged:
    """Make a case and diagnose one period of its fastest recording: its noise is assumed."""
    case = make_case(spec)
    fastest = case.bags[-1]
    end = int(np.searchsorted(fastest.recording.t, fastest.periods[0][1]))
    alone = replace(fastest, recording=fastest.recording.select(slice(0, end)))
    return _judged(replace(case, bags=(alone,), validation=()))


def _judged(case: Case) -> Judged:
    try:
        answer, closed = run_diagnosis(case)
    except Exception:
        answer, closed = Answer(verdict='failed', error=traceback.format_exc(limit=-3)), np.nan
    return Judged(Truth.of(case), answer, closed)


def run(
    specs: Sequence[CaseSpec], processes: int = 2, judge: Callable[[CaseSpec], Judged] = judge
) -> list[Judged]:
    """Judge cases in several processes, with a line of progress each."""
    judged = []
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        for count, one in enumerate(pool.map(judge, specs), start=1):
            judged.append(one)
            names = ' + '.join(map(str, one.outcome.headline))
            print(
                f'{count}/{len(specs)} {one.truth.key} (gap {one.truth.size:.2g}): '
                f'{one.outcome.verdict} {names} [{one.outcome.seconds:.1f} s]'
                + one.outcome.error.replace('\n', ' / '),
                flush=True,
            )
    return judged


def select(name: str, only: Iterable[str] = (), part: bool = False) -> list[CaseSpec]:
    """Return the cases of a set or of its slice, whose key contains any of the given texts."""
    specs = list(case_list(name))
    if part:
        chosen = []
        for kind, every in SLICE.items():
            chosen += [spec for spec in specs if spec.kind == kind][::every]
        specs = chosen
    texts = list(only)
    return [spec for spec in specs if not texts or any(text in spec.key for text in texts)]


def main() -> None:
    """Run a set of cases, print the table and write the requested files."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.hidden_effects')
    parser.add_argument('set', nargs='?', choices=SETS)
    parser.add_argument('--slice', action='store_true', help='a few cases of every kind')
    parser.add_argument('--only', nargs='+', default=[], metavar='TEXT', help='keys that have it')
    parser.add_argument('--single', action='store_true', help='one period of one recording each')
    parser.add_argument('--out', type=Path, help='folder for outcomes.json')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')  # the processes share the cores as it is
    part = options.slice or options.set is None
    specs = select(options.set or 'development', options.only, part)
    with ExitStack() as stack:
        record = stack.enter_context(look(_part(options))) if options.set == 'locked' else None
        judged = run(specs, options.processes, judge_single if options.single else judge)
        print(f'\n{table(score(judged))}')
        if record is not None:
            record['results'] = results_of(score(judged))
    if options.out:
        rows = [{'truth': asdict(j.truth), 'outcome': asdict(j.outcome)} for j in judged]
        options.out.mkdir(parents=True, exist_ok=True)
        text = json.dumps(rows, indent=1, default=float)
        (options.out / 'outcomes.json').write_text(text, encoding='utf-8')


def _part(options: argparse.Namespace) -> str:
    """Return the name of the selected part of a set."""
    parts = [f'laboratory, {options.set}']
    parts += ['a slice'] if options.slice else []
    parts += ['one period of one recording each'] if options.single else []
    parts += [f'only {" ".join(options.only)}'] if options.only else []
    return ', '.join(parts)


if __name__ == '__main__':
    main()

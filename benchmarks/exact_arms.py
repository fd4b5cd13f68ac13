# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether an arm that is exactly as described is called consistent.

Arms of two kinds, each with viscous and dry friction that the model has: simulated by this package
along motions that it designed at three speeds; and arms of tests/hidden/lived, whose code is
another, in motions of two equal periods.

    python -m benchmarks.exact_arms [--draws N] [--processes N]

"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
import multiprocessing
import os

from armid_ros.api.excitation import design_excitation
from armid_ros.api.simulation import simulate
from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
import numpy as np

from benchmarks.hidden_effects import table
from benchmarks.lived import known_arm
from benchmarks.two_days import Answer, ask
from tests.hidden.lived.adapter import recording_of
from tests.hidden.lived.arms import ARMS, load_arm
from tests.hidden.lived.cases import case_of
from tests.hidden.lived.specification import specify
from tests.hidden.scoring import rate

SPEEDS = ('slow', 'medium', 'fast')
#: Torque noise of a joint, as a share of what it may do; noise of its position [rad].
TORQUE_NOISE, POSITION_NOISE = 1e-3, 2e-5


def own_chain(draw: int) -> tuple[str, Answer]:
    """Design, simulate and diagnose; the last of three speeds once more, not to be fitted."""
    rng = np.random.default_rng([2, draw])
    names = ARMS['development']
    name = names[draw % len(names)]
    robot = load_arm(name)
    strength = robot.torque_limit
    arm = ArmModel(robot)
    for effect, share in (('viscous_friction', 0.01), ('coulomb_friction', 0.02)):
        values = share * strength * rng.uniform(0.3, 1.0, robot.n_joints)
        arm = arm.with_effect(make_effect(effect, robot), values)
    plans = [
        design_excitation(
            arm, duration=16.0, rng=rng, speed=speed, starts=1, candidates=10, iterations=1
        )
        for speed in SPEEDS
    ]
    runs = [
        simulate(
            arm,
            plan,
            torque_noise=TORQUE_NOISE * float(np.median(strength)),
            position_noise=POSITION_NOISE,
            rng=rng,
        )
        for plan in (*plans, plans[-1])
    ]
    return name, ask(arm, runs[:3], validate=runs[3:])


def other_code(draw: int) -> tuple[str, Answer]:
    """Diagnose an arm of the generator of lived arms of which everything is known."""
    spec = specify('development/exact', 6 * draw + 2)  # nothing happened, friction by values
    spec = replace(spec, styles=dict.fromkeys(spec.styles, 'periodic'))
    case = case_of(spec)
    answer = ask(
        known_arm(case),
        [recording_of(run) for run in case.day_2],
        validate=[recording_of(case.held_out)],
    )
    return spec.arm, answer


def judged(what: str, draws: int, question: Callable[[int], tuple[str, Answer]], pool) -> str:
    """Ask about so many arms and return the rate as a table."""
    said = []
    for draw, (name, answer) in enumerate(pool.map(question, range(draws))):
        headline = '; '.join(map(str, answer.headline)) or 'nothing'
        print(f'{what}, {draw} {name}: {answer.verdict} {headline} [{answer.seconds:.1f} s]')
        said.append(answer)
    return table([rate(what, said, lambda a: a.verdict == 'consistent', least=0.95)])


def main() -> None:
    """Print the verdicts and how many are right."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.exact_arms')
    parser.add_argument('--draws', type=int, default=20)
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(options.processes, mp_context=context) as pool:
        rows = [
            judged('exact arms, own chain', options.draws, own_chain, pool),
            judged('exact arms, other code', options.draws, other_code, pool),
        ]
    print('\n' + '\n'.join(rows))


if __name__ == '__main__':
    main()

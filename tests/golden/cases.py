# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands whose answers are held, and the arms that have lived."""

from __future__ import annotations

from dataclasses import asdict, dataclass
import json
import os
from pathlib import Path
from typing import Any

from armid_ros.cli import main
from armid_ros.recording import read_recording
from click.testing import CliRunner
import numpy as np

from benchmarks.lived import judge
from benchmarks.two_days import Answer
from tests.golden.facts import facts

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).with_name('results')
#: Data of real machines that may be absent.
DATA = Path(os.environ.get('ARMID_DATA') or 'missing')


@dataclass(frozen=True)
class Case:
    """
    Commands, the last of which answers.

    Attributes
    ----------
    commands : tuple of str
        Words without `armid`; {root}, {data}, {inputs} and {out} are folders.
    bag : str
        Bag of the arm of the examples that the last command writes, where it prints no JSON.
    long : bool
        Whether it takes more than some seconds.

    """

    commands: tuple[str, ...]
    bag: str = ''
    long: bool = False

    @property
    def real(self) -> bool:
        """Whether it needs recordings of real machines."""
        return '{data}' in ' '.join(self.commands)


_ROBOT = '--robot {inputs}/my_arm.urdf'
_MONDAY = f'identify {{inputs}}/monday {_ROBOT} --no-physical --no-verify --out {{out}}/monday'
_SINCE = f'--baseline {{inputs}}/monday --model {{out}}/monday/model.yaml {_ROBOT}'
_MOON = '{root}/bags/humanoid_arm_moon --robot - --gravity moon'
_VOLTS = '--position qm --effort vir --effort-scale 35.15065 --robot {inputs}/emps.urdf'
_EMPS = f'{{data}}/emps/DATA_EMPS.mat {_VOLTS}'
_TX40 = '--robot {data}/tx40_staubli/tx40_mdh_modified.urdf'
_WRIST = 'viscous_friction,coulomb_friction,torque_offset,rotor_inertia,coupled_joint_friction'

CASES = {
    'inspect_bag': Case((f'inspect {_MOON} --json',)),
    'inspect_table': Case(
        (f'inspect {{inputs}}/log.csv {_ROBOT} --degrees --current-gain 4 --json',)
    ),
    'convert_table': Case(
        (f'convert {{inputs}}/log.csv {_ROBOT} --degrees --current-gain 4 --out {{out}}/bag',),
        bag='bag',
    ),
    'simulate': Case(
        (
            f'simulate {_ROBOT} --trajectory {{root}}/tests/golden/plan.yaml --rate 200'
            ' --effect viscous_friction:viscous_coefficient=0.3 --out {out}/bag',
        ),
        bag='bag',
    ),
    'excite': Case(
        (
            f'excite {_ROBOT} --duration 12 --starts 1 --iterations 8 --time-budget 1000'
            ' --out {out}/plan --json',
        )
    ),
    'identify_bag': Case((f'identify {_MOON} --out {{out}}/result --json',)),
    'identify_held_out': Case(
        (
            f'identify {{inputs}}/monday --validate {{inputs}}/tuesday {_ROBOT} --no-physical'
            ' --out {out}/r --json',
        )
    ),
    'identify_robust': Case(
        (
            f'identify {{inputs}}/monday {_ROBOT} --method irls --no-physical --no-verify'
            ' --out {out}/r --json',
        )
    ),
    'identify_physical': Case(
        (
            f'identify {{inputs}}/monday {_ROBOT} --physical --total-mass 5 --no-verify'
            ' --out {out}/r --json',
        )
    ),
    'compare': Case(
        (
            _MONDAY,
            f'identify {{inputs}}/friday {_ROBOT} --no-physical --no-verify --out {{out}}/friday',
            'compare {out}/monday {out}/friday --out {out}/changes --json',
        )
    ),
    'diagnose_spring': Case(
        (
            _MONDAY,
            f'diagnose {{inputs}}/today_1 --validate {{inputs}}/today_2 {_SINCE}'
            ' --out {out}/found --json',
        )
    ),
    'diagnose_payload': Case(
        (_MONDAY, f'diagnose {{inputs}}/friday {_SINCE} --out {{out}}/found --json')
    ),
    'diagnose_nothing': Case(
        (_MONDAY, f'diagnose {{inputs}}/tuesday {_SINCE} --out {{out}}/found --json')
    ),
    'lunar': Case(('lunar --out {out}/lunar --json',), long=True),
    'elastic': Case(('elastic --demo --experiments 3 --out {out}/elastic --json',), long=True),
    'exo': Case(('exo --duration 4 --out {out}/exo --json',), long=True),
    'fleet_identify': Case(
        (
            'fleet identify {inputs}/fleet/*/* --robot {root}/examples/arm.urdf --workers 1'
            ' --out {out}/fleet --json',
        )
    ),
    'emps_identify': Case(
        (
            f'identify {_EMPS} --validate {{data}}/emps/DATA_EMPS_PULSES.mat --no-physical'
            ' --no-verify --out {out}/r --json',
        )
    ),
    'emps_inspect': Case((f'inspect {_EMPS} --json',)),
    'ur10_inspect': Case(('inspect {data}/ur10_ros2bag/ur10_exciting_trajectory.db3 --json',)),
    'tx40_identify': Case(
        (
            f'convert {{data}}/tx40_staubli/pos_read_data.csv {{data}}/tx40_staubli/curr_data.csv'
            f' {_TX40} --rate 5000 --gear 32,32,45,-48,45,32 --coupling 6,5=32'
            ' --zero 0,-pi/2,pi/2,0,0,0 --out {out}/bag',
            f'identify {{out}}/bag {_TX40} --effects {_WRIST} --method ols --decimation 100'
            ' --no-physical --no-verify --out {out}/r --json',
        )
    ),
    'pendulum_identify': Case(
        (
            'identify {data}/dfki_simple_pendulum/payload_1kg/energy_shaping.csv'
            ' --robot {data}/dfki_simple_pendulum/parameters/dfki_simple_pendulum.urdf'
            ' --no-physical --no-verify --out {out}/r --json',
        )
    ),
}  # fmt: skip

#: Cases of tests/hidden/lived of both kinds: day 1 with recordings, and an exact description.
LIVED = [('development', n) for n in range(28)] + [('development/exact', n) for n in range(12)]


def answer(name: str, inputs: Path, out: Path) -> Any:
    """
    Run the commands of a case.

    Parameters
    ----------
    name : str
        Key of `CASES`.
    inputs, out : Path
        Folder that `lay_out` filled, and an empty one.

    Returns
    -------
    dict
        Facts of the answer.

    """
    case = CASES[name]
    folders = {'root': ROOT, 'data': DATA, 'inputs': inputs, 'out': out}
    for command in case.commands:
        done = CliRunner().invoke(main, command.format(**folders).split())
        if done.exit_code != 0:
            raise RuntimeError(f'armid {command}: {done.output}') from done.exception
    return facts(_of_bag(out / case.bag) if case.bag else json.loads(done.stdout))


def _of_bag(path: Path) -> dict[str, Any]:
    """Return number of samples, duration, and the root mean square of each joint."""
    run = read_recording(path, joints=('waist', 'shoulder', 'elbow'))
    return {
        'samples': len(run.t),
        'duration': float(run.t[-1] - run.t[0]),
        **{
            name: np.sqrt(np.mean(values**2, axis=0)).tolist()
            for name, values in (('q', run.q), ('dq', run.dq), ('tau', run.tau))
            if values is not None
        },
    }


def lived_answer(kind: str, index: int) -> Any:
    """Return the diagnosis of an arm of tests/hidden/lived, and that of the day before."""
    judged = judge(kind, index)
    if judged is None:
        return {}
    pair = {'answer': judged.answer, 'day_before': judged.again}
    answers = {key: _of_answer(value) for key, value in pair.items() if value is not None}
    return facts(json.loads(json.dumps(answers)))  # tuples are lists, as in the stored results


def _of_answer(answer: Answer) -> dict[str, Any]:
    """Return verdict and headline, with the parameters as records of a value and its deviation."""
    return {
        'verdict': answer.verdict,
        'headline': [
            {
                **asdict(named),
                'parameters': [
                    dict(zip(('name', 'joint', 'value', 'std'), row, strict=True))
                    for row in named.parameters
                ],
            }
            for named in answer.headline
        ],
    }

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid diagnose writes: the verdict, and a motion to run where names are in doubt."""

from __future__ import annotations

import json
import re
import shutil

from armid_ros.arm import load_model, save_model
from armid_ros.cli.diagnose import share_of_percent
from armid_ros.diagnosis import Diagnosis
from armid_ros.model import inverse_dynamics
from armid_ros.recording import write_recording
import click
import pytest

from tests.diagnosis.conftest import Bench, URDF
from tests.hidden.leg_pair import description, Straps, walks, write_walk

from .conftest import armid

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return a URDF, a model of the drives, and bags of the arm with a lower link too heavy."""
    bench = Bench()
    folder = tmp_path_factory.mktemp('bench')
    urdf = folder / 'arm.urdf'
    urdf.write_text(URDF, encoding='utf-8')
    robot = bench.robot
    heavy = robot.rigid_parameters.copy()
    heavy[10:14] += [0.1, 0.0, 0.0, 0.01]
    true = robot.with_inertias(heavy)
    weight = bench.recordings(lambda m, _: inverse_dynamics(true, m) - inverse_dynamics(robot, m))
    bags = [folder / f'bag_{k}' for k in range(len(weight))]
    for path, recording in zip(bags, weight, strict=True):
        write_recording(path, recording)
    save_model(folder / 'known.yaml', bench.arm, str(urdf))
    return urdf, folder / 'known.yaml', bags


def test_an_extra_that_fails_costs_no_result(files, tmp_path, monkeypatch):
    urdf, model, bags = files
    out = tmp_path / 'out'

    def broken(*arguments, **options):
        assert {path.name for path in out.iterdir()} >= {
            'diagnosis.json',
            'model.yaml',
            'report.html',
        }
        raise ZeroDivisionError('motionless')

    monkeypatch.setattr('armid_ros.api.diagnosis.next_run', broken)
    monkeypatch.setattr('armid_ros.api.diagnosis.simulate_held_out', broken)
    asked = ('--robot', urdf, '--model', model, '--validate', bags[-1])
    result = armid('diagnose', *bags[:-1], *asked, '--out', out)
    assert result.output.count('motionless') == 2
    document = json.loads((out / 'diagnosis.json').read_text())
    assert (document['next_run'], document['forward']) == (None, [])
    first, *lines = result.stdout.splitlines()
    assert first == f'{document["verdict"].upper()}: {document["summary"]}'
    name = document['effects'][0]['name'].replace('_', ' ')
    assert any(name in line and '%' in line for line in lines)


def test_a_baseline_that_was_written_over_is_refused(files, tmp_path):
    urdf, _, (before, now, other) = files
    day, result = tmp_path / 'day', tmp_path / 'result'
    shutil.copytree(before, day)
    armid('identify', day, '--robot', urdf, '--no-physical', '--no-verify', '--out', result)
    shutil.rmtree(day)
    shutil.copytree(other, day)
    asked = ('--robot', urdf, '--model', result / 'model.yaml', '--out', tmp_path / 'out')
    refused = armid('diagnose', now, *asked, code=2).stderr
    assert f'{day}: ' in refused and '--no-baseline' in refused


@pytest.mark.parametrize(
    ('verdict', 'code', 'strict_code'),
    [
        ('consistent', 0, 0),
        ('named', 0, 0),
        ('ambiguous', 0, 0),
        ('partial', 0, 0),
        ('unknown', 0, 3),
        ('not_repeatable', 0, 3),
        ('bad_data', 2, 2),
    ],
)
def test_a_script_learns_from_the_code_whether_to_go_on(
    files, tmp_path, monkeypatch, verdict, code, strict_code
):
    """Whatever the code is, the folder has the result."""
    urdf, model, bags = files
    said = Diagnosis(verdict, 'Said.', load_model(model), (), ())
    monkeypatch.setattr('armid_ros.api.diagnosis.run', lambda *_, **__: said)
    asked = ('diagnose', *bags, '--robot', urdf, '--model', model, '--no-baseline')
    for more, expected in (((), code), (('--strict',), strict_code), (('--json',), code)):
        armid(*asked, '--out', tmp_path / 'out', *more, code=expected)
        document = json.loads((tmp_path / 'out' / 'diagnosis.json').read_text())
        assert document['verdict'] == verdict


def test_what_matters_is_a_percentage():
    for text, share in (('2%', 0.02), ('0.5', 0.005), ('0 %', 0.0)):
        assert share_of_percent(None, None, text) == pytest.approx(share)
    for text in ('much', '-1%', '100%', 'nan'):
        with pytest.raises(click.BadParameter, match=text):
            share_of_percent(None, None, text)


def test_a_model_of_another_arm_is_refused(files, tmp_path):
    """The same names of joints, and another length: every number would be of no arm at all."""
    urdf, known, bags = files
    longer = tmp_path / 'longer.urdf'
    text = urdf.read_text(encoding='utf-8')
    longer.write_text(text.replace(' 0.35"', ' 0.45"'), encoding='utf-8')
    assert longer.read_text(encoding='utf-8') != text
    asked = ('--robot', longer, '--model', known, '--out', tmp_path / 'x')
    result = armid('diagnose', *bags, *asked, code=2)
    assert 'joints' in result.output
    assert not (tmp_path / 'x').exists()


def test_a_gravity_other_than_that_of_the_model_is_refused(files, tmp_path):
    """Nobody is told one thing by the command and another by the file without a word."""
    urdf, model, bags = files
    asked = ('diagnose', bags[0], '--robot', urdf, '--model', model, '--out', tmp_path / 'x')
    said = armid(*asked, '--gravity', 'moon', code=2).output
    assert str(model) in said and '0,0,-9.81' in said and '0,0,-1.62' in said
    assert said.strip().count('\n') == 0


def test_a_folder_for_a_model_is_the_file_in_it(files, tmp_path):
    urdf, model, bags = files
    (tmp_path / 'monday').mkdir()
    inside = tmp_path / 'monday' / 'model.yaml'
    asked = ('diagnose', bags[0], '--robot', urdf, '--model', tmp_path / 'monday')
    asked += ('--no-baseline', '--out', tmp_path / 'x')
    assert str(inside) in armid(*asked, code=2).output
    inside.write_text(model.read_text())
    armid(*asked)


def test_a_description_without_masses_is_no_model_to_compare_with(files, tmp_path):
    urdf, _, bags = files
    bare = tmp_path / 'bare.urdf'
    text = urdf.read_text(encoding='utf-8')
    bare.write_text(re.sub(r'<inertial>.*?</inertial>', '', text, flags=re.DOTALL))
    said = armid('diagnose', bags[0], '--robot', bare, '--out', tmp_path / 'x', code=2).stderr
    assert f'{bare}: ' in said and '--model' in said
    assert said.strip().count('\n') == 0
    assert not (tmp_path / 'x').exists()


#: Quick steps tell most in a short time; each fits twice into a recording [s].
SECONDS, PERIODS = 4.5, (1.6, 1.3, 1.1)


@pytest.mark.long
def test_springs_on_one_leg_are_named_there(tmp_path) -> None:
    """Recorded at three speeds, beside masses that are wrong."""
    straps = Straps(('swing_shank', 'swing_thigh'), 1e4)
    recorded = walks(straps, 0, seconds=SECONDS, periods=PERIODS, wrong_masses=0.1)
    bags = [tmp_path / f'run_{number}' for number in range(len(PERIODS))]
    for path, walk in zip(bags, recorded, strict=True):
        write_walk(path, walk)
    robot, partner = (description(name) for name in ('exoskeleton_legs', 'human_legs'))
    out = tmp_path / 'found'
    asked = ('--robot', robot, '--partner', partner, '--out', out, '--json')
    document = json.loads(armid('diagnose', *bags, *asked).stdout)
    assert document['verdict'] == 'named'
    (effect,) = document['effects']
    assert (effect['name'], effect['ambiguous_with']) == ('human_interaction', [])
    assert {tie['segment'] for tie in effect['ties']} == set(straps.segments)
    for tie in effect['ties']:
        assert tie['stiffness'] == pytest.approx(1e4, rel=0.005)
        assert tie['interval'][0] < 1e4 < tie['interval'][1]
        assert tie['partner_joint'] == tie['joint'].replace('exo', 'human')
    page = (out / 'report.html').read_text(encoding='utf-8')
    assert 'swing_thigh' in page
    arm = load_model(out / document['model'])
    assert sorted(tie.name for one in arm.effects for tie in one.ties) == sorted(straps.segments)


def test_ties_without_a_partner_are_refused(tmp_path) -> None:
    asked = ('diagnose', 'bag', '--robot', 'exoskeleton_legs', '--out', tmp_path, '--tie', 'a=b')
    assert 'also needs --partner' in armid(*asked, code=2).output

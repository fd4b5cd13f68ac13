# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An effect of a package installed by pip works in all commands like a shipped effect."""

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

PACKAGE = Path(__file__).with_name('plug_in')
#: Program that runs armid commands in one process; each is a JSON list of arguments.
RUN = """
import json, sys
from armid_ros.cli import main
for arguments in json.loads(sys.argv[1]):
    main(arguments, standalone_mode=False)
"""


@pytest.fixture(scope='module')
def installed(tmp_path_factory):
    """Install the package with pip, without a network; return the folder."""
    folder = tmp_path_factory.mktemp('plug_in')
    shutil.copytree(PACKAGE, folder / 'source')
    pip = [sys.executable, '-m', 'pip', 'install', '--quiet', '--disable-pip-version-check']
    offline = ['--no-index', '--no-deps', '--no-build-isolation']
    subprocess.run([*pip, *offline, '--target', folder / 'site', folder / 'source'], check=True)
    return folder / 'site'


def run(root, path, *commands, folder, check=True):
    """Run `armid` commands with a package on the path; return their output."""
    paths = os.pathsep.join([str(root), str(path)])
    return subprocess.run(
        [sys.executable, '-c', RUN, json.dumps([[str(part) for part in c] for c in commands])],
        env={**os.environ, 'PYTHONPATH': paths},
        cwd=folder,
        check=check,
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope='module')
def results(root, installed, tmp_path_factory):
    """Simulate, identify, diagnose, and simulate the found model; return folder and output."""
    folder = tmp_path_factory.mktemp('results')
    robot = ('--robot', root / 'examples' / 'arm.urdf')
    arm = ('--effect', 'viscous_friction:viscous_coefficient=0.3')
    hose = ('--effect', 'hose@elbow:hose_stiffness=4')
    noise = ('--torque-noise', '0.05', '--rate', '200')
    known = ('--effects', 'viscous_friction')
    both = ('--effects', 'viscous_friction,hose')
    done = run(
        root,
        installed,
        *(
            ['simulate', *robot, *arm, *hose, *noise, '--seed', seed, '--out', f'run_{seed}']
            for seed in (1, 2)
        ),
        ['identify', 'run_1', *robot, *both, '--no-physical', '--no-verify', '--out', 'with'],
        ['diagnose', 'run_1', '--validate', 'run_2', *robot, *known, '--out', 'found'],
        ['simulate', *robot, '--model', 'found/model.yaml', '--rate', 200, '--out', 'again'],
        ['effects'],
        folder=folder,
    )
    return folder, done.stdout


def test_it_is_listed(results):
    assert 'hose_stiffness' in results[1]


def test_it_is_simulated_and_identified(results):
    document = json.loads((results[0] / 'with' / 'identification.json').read_text())
    (found,) = (
        p for p in document['parameters'] if (p['name'], p['joint']) == ('hose_stiffness', 'elbow')
    )
    assert abs(found['value'] - 4.0) < 4.0 * found['std'] < 0.1


def test_it_is_named_by_the_diagnosis(results):
    document = json.loads((results[0] / 'found' / 'diagnosis.json').read_text())
    assert document['verdict'] == 'named'
    assert [(e['name'], e['joints']) for e in document['effects']] == [('hose', ['elbow'])]
    assert 'stiffens as' in (results[0] / 'found' / 'report.html').read_text()


def test_it_is_saved_and_loaded(results):
    assert 'name: hose\n' in (results[0] / 'found' / 'model.yaml').read_text()
    assert (results[0] / 'again' / 'metadata.yaml').exists()


def test_its_author_can_check_it(root, installed):
    lines = 'import armid_hose as m, armid_ros.arm.testing as t; t.check_effect(m.Hose)'
    paths = os.pathsep.join([str(root), str(installed)])
    subprocess.run(
        [sys.executable, '-c', lines], env={**os.environ, 'PYTHONPATH': paths}, check=True
    )


def test_without_the_package_the_model_says_what_is_missing(root, results, tmp_path):
    model = results[0] / 'found' / 'model.yaml'
    arguments = ['simulate', '--robot', root / 'examples' / 'arm.urdf', '--model', model]
    done = run(root, tmp_path, [*arguments, '--out', 'x'], folder=tmp_path, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f'armid: {model}: ') and "'hose'" in done.stderr
    assert 'install' in done.stderr


def test_a_package_that_cannot_be_loaded_is_named_and_harms_nothing(root, tmp_path):
    info = tmp_path / 'armid_torn-1.0.dist-info'
    info.mkdir()
    (info / 'METADATA').write_text('Metadata-Version: 2.1\nName: armid-torn\nVersion: 1.0\n')
    (info / 'entry_points.txt').write_text('[armid_ros.effects]\ntorn = armid_torn:Torn\n')
    done = run(root, tmp_path, ['effects'], folder=tmp_path)
    assert 'viscous_friction:' in done.stdout
    assert done.stderr.count('\n') == 1
    assert 'armid-torn' in done.stderr and 'ModuleNotFoundError' in done.stderr

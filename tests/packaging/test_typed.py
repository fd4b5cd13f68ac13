# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""mypy checks user code against the types of this package."""

import subprocess
import sys

import pytest

RIGHT = """
import armid_ros as ar
import numpy as np

arm = ar.ArmModel.of('ur10.urdf', effects='viscous_friction', gravity=(0.0, 0.0, -1.6))
model = ar.identify(arm, ['monday.mcap', 'tuesday.csv'], validate='wednesday.mcap', rng=3)
error: float = model.error_percent
found = ar.diagnose(model.arm, 'today.mcap')
names: tuple[str, ...] = found.names
text: str = found.urdf()
changed: bool = ar.compare('monday', model).anything


@ar.register
class Hose(ar.Effect):
    name = 'hose'
    summary = 'hose that stiffens as it bends'
    quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3'),)


hose = Hose.on(arm.robot, ('elbow',))
tau: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = arm.with_effect(hose, [1.5]).theta
"""
WRONG = """
import armid_ros as ar

arm = ar.ArmModel.of(7)
arm.grade
ar.identify(arm, 'run', cutof=3.0)
ar.diagnose(arm, 'run').names.keys()
"""


def checked(root, folder, source):
    """Return the lines that mypy prints."""
    (folder / 'user.py').write_text(source)
    command = [sys.executable, '-m', 'mypy', '--strict', '--no-error-summary']
    settings = ['--config-file', root / 'pyproject.toml', '--cache-dir', root / '.mypy_cache']
    done = subprocess.run(
        [*command, *settings, folder / 'user.py'], cwd=root, capture_output=True, text=True
    )
    return [line for line in done.stdout.splitlines() if 'user.py' in line and 'error:' in line]


@pytest.mark.long
def test_code_of_a_user_passes_and_mistakes_are_found(root, tmp_path):
    assert checked(root, tmp_path, RIGHT) == []
    lines = checked(root, tmp_path, WRONG)
    assert [line.split(':')[1] for line in lines] == ['4', '5', '6', '7']
    assert (root / 'armid_ros' / 'py.typed').is_file()

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scripts as people write them: without a guard, with classes of their own."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

PLAIN = """
import armid_ros as ar
arm = ar.ArmModel.of('two_link_elastic')
"""
OWN = (
    PLAIN
    + """
from dataclasses import dataclass
from armid_ros.effects.friction import ViscousFriction

@dataclass(frozen=True)
class Own(ViscousFriction):
    name = 'own'

arm = arm.with_effect(Own.on(arm.robot))
"""
)
DESIGN = """
print('once')
plan = ar.design_excitation(arm, duration=6.0, starts=2, processes=2, iterations=1, candidates=4)
print(plan)
"""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('script', [PLAIN, OWN], ids=['plain', 'own effect'])
def test_a_search_in_processes_does_not_run_the_script_again(script, tmp_path):
    path = tmp_path / 'script.py'
    path.write_text(script + DESIGN)
    done = subprocess.run(
        [sys.executable, path],
        env={**os.environ, 'PYTHONPATH': str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count('once') == 1

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``armid diagnose --partner`` on bags that MuJoCo made of an exoskeleton and its wearer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from armid_ros.arm import load_model
from armid_ros.cli import main
from click.testing import CliRunner
import pytest

from tests.hidden.leg_pair import description, SEGMENTS, Straps, walks, write_walk

pytestmark = pytest.mark.slow

#: Quick steps tell most in a short time; each fits twice into a recording [s].
SECONDS, PERIODS = 4.5, (1.6, 1.3, 1.1)


def diagnosed(folder: Path, straps: Straps, seed: int, wrong_masses: float = 0.0) -> Any:
    """Record what is hidden at three speeds, and let the command line look for it."""
    bags = []
    recorded = walks(straps, seed, seconds=SECONDS, periods=PERIODS, wrong_masses=wrong_masses)
    for number, walk in enumerate(recorded):
        bags.append(str(folder / f'run_{number}'))
        write_walk(Path(bags[-1]), walk)
    robot, partner = (str(description(name)) for name in ('exoskeleton_legs', 'human_legs'))
    out = str(folder / 'found')
    asked = ['diagnose', *bags, '--robot', robot, '--partner', partner, '--out', out, '--json']
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.long
def test_springs_on_one_leg_are_named_there(tmp_path) -> None:
    straps = Straps(('swing_shank', 'swing_thigh'), 1e4)
    document = diagnosed(tmp_path, straps, 0, wrong_masses=0.1)
    assert document['verdict'] == 'named'
    (effect,) = document['effects']
    assert (effect['name'], effect['ambiguous_with']) == ('human_interaction', [])
    assert {tie['segment'] for tie in effect['ties']} == set(straps.segments)
    for tie in effect['ties']:
        assert tie['stiffness'] == pytest.approx(1e4, rel=0.005)
        assert tie['interval'][0] < 1e4 < tie['interval'][1]
        assert tie['partner_joint'] == tie['joint'].replace('exo', 'human')
    page = (tmp_path / 'found' / 'report.html').read_text(encoding='utf-8')
    assert 'swing_thigh' in page
    arm = load_model(tmp_path / 'found' / document['model'])
    assert sorted(tie.name for one in arm.effects for tie in one.ties) == sorted(straps.segments)


@pytest.mark.long
def test_loose_straps_on_both_legs_are_slack(tmp_path) -> None:
    document = diagnosed(tmp_path, Straps(SEGMENTS, 1e4, 0.003), 4)
    assert document['verdict'] == 'named'
    (effect,) = document['effects']
    assert effect['name'] == 'interface_slack'
    assert {tie['segment'] for tie in effect['ties']} == set(SEGMENTS)
    slacks = [p['value'] for p in effect['parameters'] if p['name'] == 'slack']
    assert slacks == pytest.approx([0.003] * 4, rel=0.2)


@pytest.mark.long
def test_a_pair_that_is_not_tied_gets_no_name(tmp_path) -> None:
    document = diagnosed(tmp_path, Straps(), 1)
    assert document['verdict'] == 'consistent'
    assert document['effects'] == []


def test_ties_without_a_partner_are_refused(tmp_path) -> None:
    done = CliRunner().invoke(
        main,
        ['diagnose', 'bag', '--robot', 'exoskeleton_legs', '--out', str(tmp_path), '--tie', 'a=b'],
    )
    assert done.exit_code == 2
    assert 'give both' in done.output

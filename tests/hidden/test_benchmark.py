# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benchmark reads outcomes as diagnosis.json has them, and writes what it saw."""

from armid_ros.diagnosis.data.evidence import noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.verdict.finding import Overlay
from armid_ros.effects import CATALOGUE
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning
import pytest

from benchmarks import hidden_effects
from tests.hidden.cases import make_case
from tests.hidden.catalogue import CATALOGUED
from tests.hidden.scoring import Judged, Truth
from tests.hidden.specification import find_case

pytestmark = pytest.mark.long

DOCUMENT = {
    'schema': 'armid/diagnosis/1',
    'verdict': 'ambiguous',
    'effects': [
        {
            'name': 'torque_offset',
            'joints': ['elbow'],
            'parameters': [
                {
                    'name': 'torque_offset',
                    'joint': 'elbow',
                    'value': 0.2,
                    'std': 0.01,
                    'unit': 'N m',
                }
            ],
            'ambiguous_with': ['asymmetric_friction'],
        }
    ],
}


@pytest.fixture(scope='module')
def judged():
    """Return a payload that was called an offset."""
    outcome = hidden_effects.outcome_of(DOCUMENT, 1.0, 2.5)
    return Judged(Truth.of(make_case(find_case('development/payload/3-0'))), outcome)


def test_every_effect_of_the_catalogue_is_hidden():
    assert set(CATALOGUED) == {name for name, kind in CATALOGUE.items() if not kind.learned}


def test_outcome_is_what_the_document_says(judged):
    outcome = judged.outcome
    assert outcome.verdict == 'ambiguous'
    assert outcome.findings[0].names == {'torque_offset', 'asymmetric_friction'}
    assert outcome.findings[0].parameters == (('torque_offset', 'elbow', 0.2, 0.01),)
    assert (outcome.closed, outcome.seconds) == (1.0, 2.5)


@pytest.mark.parametrize(('found', 'share'), [(0.0, 0.0), (1.0, 1.0)])
def test_the_true_arm_closes_the_gap_and_the_old_one_nothing(found, share):
    case = make_case(find_case('development/quadratic_friction/20-0'))
    before, after = hidden_effects.nominal_arm(case), hidden_effects.true_arm(case)
    recordings = [bag.recording for bag in case.validation]
    used = conditioning(recordings, SignalSettings())
    overlays = []
    for part in trajectories(recordings, used):
        sigma = noise_floor(part, after).sigma
        measured = part.reduce(part.motion.tau)
        ends = [measured - part.residual(arm) for arm in (before, after)]
        patched = (1.0 - found) * ends[0] + found * ends[1]
        overlays.append(Overlay(part.source, part, measured, ends[0], patched, sigma))
    assert hidden_effects.share_closed(case, overlays) == pytest.approx(share)

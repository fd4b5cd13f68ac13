# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benchmark measures which share of a hidden gap is closed."""

from armid_ros.diagnosis.data.evidence import noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.verdict.finding import Overlay
from armid_ros.effects import CATALOGUE
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning
import pytest

from benchmarks import hidden_effects
from benchmarks.two_days import known_arm
from tests.hidden.cases import make_case
from tests.hidden.catalogue import CATALOGUED
from tests.hidden.specification import find_case

pytestmark = pytest.mark.long


def test_every_effect_of_the_catalogue_is_hidden():
    assert set(CATALOGUED) == {name for name, kind in CATALOGUE.items() if not kind.learned}


@pytest.mark.parametrize(('found', 'share'), [(0.0, 0.0), (1.0, 1.0)])
def test_the_true_arm_closes_the_gap_and_the_old_one_nothing(found, share):
    case = make_case(find_case('development/quadratic_friction/20-0'))
    before, after = known_arm(case.robot, case.known), hidden_effects.true_arm(case)
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

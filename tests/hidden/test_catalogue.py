# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue means by its names and parameters what is hidden under them.

With the true values, the package's own arm model predicts what perfect instruments recorded in
MuJoCo: two codes of one definition.

"""

from dataclasses import replace

from armid_ros.effects import CATALOGUE
from armid_ros.motion import Motion
import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d
from scipy.signal import butter, sosfiltfilt

from benchmarks.hidden_effects import true_arm
from tests.hidden.cases import Case, draw, simulate
from tests.hidden.specification import CaseSpec, CATALOGUED, HIDDEN

pytestmark = pytest.mark.long

#: How much may be left of what was there before, where it is not a tenth.
LEFT = {'backlash': 0.35, 'joint_elasticity': 0.05, 'time_delay': 0.05, 'torque_lag': 0.05}

RATE = 200.0


def make(name):
    """Hide an effect of ordinary size in one recording of a Panda."""
    bare = set(HIDDEN[name].needs) <= {'rotor_inertia'}
    spec = CaseSpec(f'test/{name}', 'single', 'panda', (name,), (1.0,), True, bare, 1.0, 11)
    draft = draw(spec)
    draft = replace(draft, effects=tuple(effect.scaled(2.0) for effect in draft.effects))
    bags = simulate(draft, ['fast' if name == 'actuator_saturation' else 'medium'])
    return Case(spec, draft.robot, (), bags, (), draft.effects, draft.robot, draft.known, 1.0)


def smooth(values):
    """Take away what is above 10 Hz."""
    return sosfiltfilt(butter(4, 10.0, fs=RATE, output='sos'), values, axis=0)


def glides(speed):
    """Return where something moves, and does so for 0.15 s around, so that nothing holds it."""
    slow = np.abs(speed) < 0.05 * np.abs(speed).max(axis=0)
    return ~maximum_filter1d(slow, 61, axis=0)


def test_every_effect_of_the_catalogue_is_hidden():
    """Friction over measured temperature is that of warm_arm, as it needs a channel."""
    every = {name for name, kind in CATALOGUE.items() if not (kind.learned or kind.lasting)}
    assert set(CATALOGUED) == every


@pytest.mark.parametrize('name', CATALOGUED)
def test_true_parameters_predict_the_recorded_torque(name):
    case = make(name)
    clean = case.bags[0].clean
    q, tau = smooth(clean.q), smooth(clean.tau)
    dq = np.gradient(q, 1.0 / RATE, axis=0)
    motion = Motion(clean.joints, clean.t, q, dq, np.gradient(dq, 1.0 / RATE, axis=0), tau)
    plain, whole = true_arm(replace(case, effects=())), true_arm(case)
    moving = glides(dq)
    if name == 'coupled_joint_friction':
        moving &= glides(dq[:, -2:].sum(axis=1, keepdims=True))
    rows = slice(400, len(tau) - 300)
    before, after = (
        np.linalg.norm(np.where(moving, smooth(tau - arm.torque(motion)), 0.0)[rows])
        for arm in (plain, whole)
    )
    assert before > 0.3
    assert after < LEFT.get(name, 0.1) * before

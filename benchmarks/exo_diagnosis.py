# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of the diagnosis for straps hidden between an exoskeleton and its wearer in MuJoCo.

    python -m benchmarks.exo_diagnosis [--sets 24] [--first-seed 0]

"""

from __future__ import annotations

import argparse

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings
from armid_ros.effects.tied import Partner
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.identification.ties.recorded import (
    band_of_motion,
    stacked,
    together_interaction_problem,
)
from armid_ros.identification.ties.stiffness import identify_interaction
from armid_ros.papers.exo.plant.leg_pair import leg_pair
from armid_ros.recording import recorded_together, Recording
from armid_ros.robots import load_robot
from armid_ros.robots.ties import SEGMENTS
import numpy as np

from tests.hidden.leg_pair import Straps, walks

SECONDS = 6.0
#: Expected z-score from which a spring has to be named; names need four standard deviations.
_VISIBLE = 6.0
#: Segments with hidden springs, combined with each stiffness.
HIDDEN = (
    SEGMENTS,
    ('swing_shank',),
    ('swing_thigh',),
    ('stance_thigh',),
    ('swing_shank', 'stance_shank'),
    ('swing_thigh', 'stance_thigh'),
)
STIFFNESSES = (1e3, 3e3, 1e4, 5e4)


def diagnosed(sets: int, first: int = 0) -> None:
    """Diagnose MuJoCo bags with hidden straps, and print the rates of right and false names."""
    ties = leg_pair()
    partner = Partner(ties.other, ties.ties, 'human_legs')
    right = alarms = 0
    closed, inside = [], []
    cases = [(k, segments) for k in STIFFNESSES for segments in HIDDEN]
    for number, (k, segments) in enumerate(cases[:sets]):
        recordings = recorded_pair(partner, Straps(segments, k), first + number)
        found = diagnosis_of(partner, recordings)
        named = {tie.name for finding in found.findings for tie in finding.ties}
        z = expected_z(recordings, k)
        visible = {name for name in segments if z[name] >= _VISIBLE}
        ok = visible <= named <= set(segments) and found.verdict == 'named'
        ok &= [f.name for f in found.findings] == ['human_interaction']
        right += ok
        closed.append(found.gap.closed if found.gap else 0.0)
        inside += [
            abs(value - k) <= 1.96 * std
            for finding in found.findings
            for value, std in zip(finding.values, finding.std, strict=True)
        ]
        if not ok:
            print(f'  {k:g} N/m at {", ".join(segments)}: {found.verdict} {_headline(found)}')
    for number in range(sets):
        found = diagnosis_of(partner, recorded_pair(partner, Straps(), first + 1000 + number))
        body = number % 2 == 1 and [f.name for f in found.findings] == ['link_inertia']
        alarms += bool(found.findings) and not body
        if found.findings or found.verdict != 'consistent':
            what = ', a body whose mass is off' if body else ''
            print(f'  nothing: {found.verdict} {_headline(found)}{what}')
    print(f'right name, and segments where visible   {right} of {sets}')
    print(f'named where there is nothing             {alarms} of {sets}')
    print(f'held-out gap closed, least and median    {min(closed):.3f}, {np.median(closed):.3f}')
    held = 100.0 * np.mean(inside)
    print(f'95 % intervals that hold the stiffness   {held:.0f} % of {len(inside)}')


def expected_z(recordings: list[Recording], stiffness: float) -> dict[str, float]:
    """Return the expected z-score of each segment's strap stiffness, if all may have a strap."""
    exo = load_robot('exoskeleton_legs')
    settings = SignalSettings()
    used = band_of_motion(recordings, conditioning(recordings, settings), settings)
    problem = stacked(
        [
            together_interaction_problem(exo, recording, used, inertias='free', separate=True)
            for recording in recordings
        ]
    )
    found = identify_interaction(problem)
    return dict(zip(found.segments, stiffness / found.std, strict=True))


def recorded_pair(partner: Partner, straps: Straps, seed: int) -> list[Recording]:
    """Record exoskeleton and wearer three times, with mass errors up to 10 % for odd seeds."""
    exo = load_robot('exoskeleton_legs')
    recordings = []
    for walk in walks(straps, seed, seconds=SECONDS, wrong_masses=0.1 * (seed % 2)):
        own = Recording(joints=exo.joints, t=walk.t, q=walk.exo, tau=walk.tau)
        other = Recording(joints=partner.robot.joints, t=walk.t, q=walk.human)
        recordings.append(recorded_together(own, other, partner.robot, partner.ties))
    return recordings


def diagnosis_of(partner: Partner, recordings: list[Recording]) -> Diagnosis:
    """Return the diagnosis of the exoskeleton with the wearer as its partner."""
    arm, rng = ArmModel(load_robot('exoskeleton_legs')), np.random.default_rng(0)
    return diagnose(arm, recordings, settings=DiagnosisSettings(partner=partner), rng=rng)


def _headline(found: Diagnosis) -> str:
    """Return the named effects and their places as a line of text."""
    places = (
        (f.name, ', '.join(t.name for t in f.ties) or ', '.join(f.joints)) for f in found.findings
    )
    return '; '.join(f'{name} at {place}' for name, place in places)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--sets', type=int, default=24, help='recordings with hidden springs')
    parser.add_argument('--first-seed', type=int, default=0, help='of fit, masses and noise')
    asked = parser.parse_args()
    diagnosed(asked.sets, asked.first_seed)

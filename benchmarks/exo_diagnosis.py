# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Straps hidden between an exoskeleton and its wearer in MuJoCo, found by the whole diagnosis.

    python -m benchmarks.exo_diagnosis [--sets 24]

"""

from __future__ import annotations

import argparse

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings
from armid_ros.effects.tied import Partner
from armid_ros.recording import recorded_together, Recording
from armid_ros.robots import load_robot
from armid_ros.simulation.leg_pair import leg_pair, SEGMENTS
import numpy as np

from tests.hidden.leg_pair import Straps, walks

SECONDS = 6.0
#: Hidden springs: which segments, at each of the stiffnesses.
HIDDEN = (
    SEGMENTS,
    ('swing_shank',),
    ('swing_thigh',),
    ('stance_thigh',),
    ('swing_shank', 'stance_shank'),
    ('swing_thigh', 'stance_thigh'),
)
STIFFNESSES = (1e3, 3e3, 1e4, 5e4)


def cases() -> list[tuple[float, tuple[str, ...]]]:
    """Return stiffnesses and segments that are tied."""
    return [(k, segments) for k in STIFFNESSES for segments in HIDDEN]


def diagnosed(sets: int) -> None:
    """Hide springs in bags of an independent engine, and let the whole diagnosis look."""
    ties = leg_pair()
    partner = Partner(ties.other, ties.ties, 'human_legs')
    right = alarms = words = 0
    closed, inside = [], []
    for number, (k, segments) in enumerate(cases()[:sets]):
        found = _diagnosis(partner, Straps(segments, k), number)
        named = {tie.name for finding in found.findings for tie in finding.ties}
        ok = named == set(segments) and [f.name for f in found.findings] == ['human_interaction']
        right, words = right + ok, words + (ok and found.verdict == 'named')
        closed.append(found.gap.closed if found.gap else 0.0)
        inside += [
            abs(value - k) <= 1.96 * std
            for finding in found.findings
            for value, std in zip(finding.values, finding.std, strict=True)
        ]
        if not ok:
            names = [f'{f.name} at {", ".join(t.name for t in f.ties)}' for f in found.findings]
            print(f'  {k:g} N/m at {", ".join(segments)}: {found.verdict} {"; ".join(names)}')
    for number in range(sets):
        found = _diagnosis(partner, Straps(), 1000 + number)
        alarms += len(found.findings) > 0
        if found.findings:
            print(f'  nothing: {found.summary}')
    print('the same by armid diagnose, MuJoCo           wanted   measured')
    print(f'  name and segments right                    {sets}/{sets}    {right}/{sets}')
    print(f'  of these, verdict "named"                  {sets}/{sets}    {words}/{sets}')
    print(f'  named where there is nothing               0/{sets}     {alarms}/{sets}')
    print(f'  held-out gap closed, least and median      -        {min(closed):.3f}, ', end='')
    print(f'{np.median(closed):.3f}')
    print(f'  95 % intervals that hold the stiffness     -        {100 * np.mean(inside):.0f} %')


def _diagnosis(partner: Partner, straps: Straps, seed: int) -> Diagnosis:
    """Diagnose three recordings of a pair whose masses are off by up to a tenth in half of all."""
    exo = load_robot('exoskeleton_legs')
    recordings = []
    for walk in walks(straps, seed, seconds=SECONDS, wrong_masses=0.1 * (seed % 2)):
        own = Recording(joints=exo.joints, t=walk.t, q=walk.exo, tau=walk.tau)
        other = Recording(joints=partner.robot.joints, t=walk.t, q=walk.human)
        recordings.append(recorded_together(own, other, partner.robot, partner.ties))
    settings = DiagnosisSettings(partner=partner)
    return diagnose(ArmModel(exo), recordings, settings=settings, rng=np.random.default_rng(0))


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--sets', type=int, default=24, help='recordings with hidden springs')
    diagnosed(parser.parse_args().sets)

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a machine and its wearer: stiffness of the ties, and forces."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair
from armid_ros.papers.exo.report.poses import draw_poses
from armid_ros.papers.exo.report.sections import (
    assumptions_section,
    forces_section,
    stiffness_section,
)
from armid_ros.papers.exo.report.walk import by_torque_section, feet_section, SimulatedWalk, Walk
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
import numpy as np

#: Intervals wider than this share of the value are called poor.
_NARROW = 0.1


def exo_report(
    pair: TiedPair,
    motions: PairMotion,
    abscissa: FloatArray,
    name: str,
    found: Sequence[Interaction],
    walked: SimulatedWalk | None,
    provenance: Provenance,
) -> str:
    """
    Return report.html of a tied pair.

    Parameters
    ----------
    pair : TiedPair
        Both machines, with the estimated stiffness.
    motions : PairMotion
        The motion of both machines to show.
    abscissa : ndarray, shape (N,)
        Abscissa of the plots.
    name : str
        Name and unit of the abscissa.
    found : sequence of Interaction
        Estimates with one stiffness for all ties, then with one for each.
    walked : SimulatedWalk or None
        Truth of simulated data; None for recorded data.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    samples = np.linspace(0, len(abscissa) - 1, 6).astype(int).tolist()
    captions = [f'{abscissa[k]:.2f}' for k in samples]
    sections: list[Section] = [
        verdict(found, walked),
        stiffness_section(found, walked.truth if walked else {}),
    ]
    if walked is not None:
        sections += [
            Walk(walked.cycle, walked.driven),
            by_torque_section(walked),
            feet_section(walked.cycle),
        ]
    sections += [
        forces_section(pair, motions, abscissa, name),
        draw_poses(pair, motions, samples, captions),
        assumptions_section(),
        Origin(provenance),
    ]
    title = 'Springs between an exoskeleton and its wearer'
    return Page(title, f'{len(pair.ties)} springs · {len(abscissa)} samples', sections).html()


def verdict(found: Sequence[Interaction], walked: SimulatedWalk | None) -> VerdictSection:
    """Say what ties the two, how surely, and whether the torques walk."""
    overall = found[0]
    k, reach = overall.stiffness[0], HALF_WIDTH * overall.std[0]
    sentences = [
        f'The stiffness of the straps between exoskeleton and wearer is {k:.0f} ± {reach:.0f} N/m.'
    ]
    weak = [
        name.replace('_', ' ')
        for part in found[1:]
        for name, value, std in zip(part.segments, part.stiffness, part.std, strict=True)
        if HALF_WIDTH * std > _NARROW * abs(value)
    ]
    if walked is not None:
        each = ', '.join(f'{d.joint} {d.right.most:.2g}°' for d in walked.driven)
        sentences.append(f'Over a walking cycle, driven joints are off by at most: {each}.')
    beware = [f'{", ".join(weak)}: too slightly drawn out to know within 10 %.'] if weak else []
    if k - reach <= 0.0:
        return VerdictSection('no interaction', 'fair', ['No interaction is seen.'], beware)
    sure = reach < _NARROW * k
    return VerdictSection(
        'found' if sure else 'uncertain', 'good' if sure else 'fair', sentences, beware
    )

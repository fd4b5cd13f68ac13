# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a machine and its wearer: what ties them, and what each feels of the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.assumptions import Assumption
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
from armid_ros.papers.exo.report.poses import draw_poses
from armid_ros.papers.exo.report.sections import Assumptions, Forces, Poses, Stiffness
from armid_ros.papers.exo.report.walk import CycleByTorque, FootForces, Walk
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
import numpy as np

_POSES = 6
#: Intervals wider than this share of the value are called poor.
_NARROW = 0.1


@dataclass(frozen=True)
class ShownMotion:
    """
    The motion that is shown.

    Attributes
    ----------
    motions : PairMotion
        Of both.
    abscissa : ndarray, shape (N,)
        What it is drawn over.
    name : str
        Name and unit of the abscissa.

    """

    motions: PairMotion
    abscissa: FloatArray
    name: str


@dataclass(frozen=True)
class SimulatedWalk:
    """
    What is known of a pair that was simulated; nothing of one that was recorded.

    Attributes
    ----------
    truth : mapping of str to float
        True stiffnesses [N/m].
    cycle : GaitCycle or None
        A whole cycle of walking.
    whole : CycleByTorque or None
        Joints driven by torque over that.

    """

    truth: Mapping[str, float] = field(default_factory=dict)
    cycle: GaitCycle | None = None
    whole: CycleByTorque | None = None


def exo_report(
    pair: TiedPair,
    shown: ShownMotion,
    found: Sequence[Interaction],
    walked: SimulatedWalk | None = None,
    *,
    assumptions: Mapping[str, Assumption] | None = None,
    provenance: Provenance | None = None,
) -> str:
    """
    Return report.html of a tied pair.

    Parameters
    ----------
    pair : TiedPair
        Both machines, with the stiffness that was found.
    shown : ShownMotion
        The motion that is shown.
    found : sequence of Interaction
        One stiffness for all, then one for each.
    walked : SimulatedWalk, optional
        What is known of simulated data.
    assumptions : mapping, optional
        What was assumed.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    """
    motions, abscissa = shown.motions, shown.abscissa
    walked = walked or SimulatedWalk()
    torques = pair_torques(pair, *motions)
    alone = pair_torques(pair.with_stiffness(0.0), *motions)
    samples = np.linspace(0, len(abscissa) - 1, _POSES).astype(int).tolist()
    captions = [f'{abscissa[k]:.2f}' for k in samples]
    sections: list[Section] = [_verdict(found, walked), Stiffness(found, walked.truth)]
    if walked.cycle is not None and walked.whole is not None:
        cycle, whole = walked.cycle, walked.whole
        sections += [Walk(cycle, whole.driven), whole, FootForces(cycle)]
    sections += [
        Forces(
            abscissa,
            shown.name,
            torques.forces,
            pair.segments,
            torques.tau,
            alone.tau,
            pair.robot.joints,
        ),
        Poses(draw_poses(pair, motions, samples, captions)),
    ]
    if assumptions:
        sections.append(Assumptions(assumptions))
    sections.append(Origin(provenance or Provenance()))
    title = f'{pair.robot.name} on {pair.other.name}'
    return Page(title, f'{len(pair.ties)} springs · {len(abscissa)} samples', sections).html()


def _verdict(found: Sequence[Interaction], walked: SimulatedWalk) -> VerdictSection:
    """Say what ties the two, how surely, and whether the torques walk."""
    overall = found[0]
    k, reach = overall.stiffness[0], 1.96 * overall.std[0]
    sentences = [f'The springs between the two have {k:.0f} ± {reach:.0f} N/m (95 %).']
    weak = [
        name.replace('_', ' ')
        for part in found[1:]
        for name, value, std in zip(part.segments, part.stiffness, part.std, strict=True)
        if 1.96 * std > _NARROW * abs(value)
    ]
    if walked.whole is not None:
        each = ', '.join(f'{d.joint} {d.right.most:.2g}°' for d in walked.whole.driven)
        sentences.append(
            'Driven by their torques, joints follow a whole cycle of walking, on either foot and '
            f'on both: {each} at most.'
        )
    beware = [f'{", ".join(weak)}: too slightly drawn out to know within 10 %.'] if weak else []
    if k - reach <= 0.0:
        return VerdictSection('no interaction', 'fair', ['No interaction is seen.'], beware)
    sure = reach < _NARROW * k
    return VerdictSection(
        'found' if sure else 'uncertain', 'good' if sure else 'fair', sentences, beware
    )

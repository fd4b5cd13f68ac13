# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The short sections of the page of an identification: whether it can be believed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification import Fit, PhysicalCertificate
from armid_ros.identification.assess.consistency import NoiseCheck
from armid_ros.model.pseudo_inertia import Consistency
from armid_ros.report.charts import Chart, Level, Series
from armid_ros.report.families import full_label
from armid_ros.report.notation import digits, pretty
from armid_ros.report.page import Section
from armid_ros.report.statistics import Whiteness
from armid_ros.robots import Robot
import numpy as np

_WORST = 6


@dataclass(frozen=True)
class WhitenessSection(Section):
    """
    Autocorrelation of the residuals with the band of white noise.

    Attributes
    ----------
    robot : Robot
        Gives the joints.
    fits : sequence of Fit
        Data whose residual is looked at.
    role : str
        'held-out' or 'training'.

    """

    title: ClassVar[str] = 'Whiteness'
    template: ClassVar[str] = 'whiteness.html'

    robot: Robot
    fits: Sequence[Fit]
    role: str

    @property
    def joints(self) -> list[tuple[str, float, Chart]]:
        """Joint, share of lags outside the band, and the chart."""
        found = []
        for joint, name in enumerate(self.robot.joints):
            whiteness = Whiteness.of(self.fits, joint)
            levels = [Level(whiteness.band, '99 %'), Level(-whiteness.band)]
            chart = Chart(
                whiteness.lag,
                [Series('autocorrelation', whiteness.correlation, 'residual', 'sticks')],
                'lag [s]',
                'autocorrelation',
                height=150,
                levels=levels,
                symmetric=True,
                legend=False,
            )
            found.append((name, whiteness.outside, chart))
        return found


@dataclass(frozen=True)
class EncoderNoise(Section):
    """
    The test for errors in variables, and the bias that a simulation finds.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    check : NoiseCheck
        Both.

    """

    title: ClassVar[str] = 'Encoder noise'
    template: ClassVar[str] = 'encoder_noise.html'

    robot: Robot
    check: NoiseCheck

    @property
    def noise(self) -> str:
        """Position noise of every joint in words."""
        return ', '.join(
            f'{joint} {digits(1e3 * value)} m{unit}'
            for joint, value, unit in zip(
                self.robot.joints,
                self.check.position_noise,
                self.robot.position_units,
                strict=True,
            )
        )

    @property
    def worst(self) -> list[tuple[str, str, str, str]]:
        """Parameters with the largest bias: name, bias, its error, in standard deviations."""
        check = self.check
        order = np.argsort(-np.abs(check.relative_bias))[:_WORST]
        return [
            (
                full_label(check.instrumental.parameters[k], self.robot.links),
                f'{check.bias[k]:.2g} {pretty(check.instrumental.parameters[k].unit)}',
                f'{check.bias_std[k]:.1g}',
                f'{check.relative_bias[k]:+.2f}',
            )
            for k in order
        ]


@dataclass(frozen=True)
class PhysicalSection(Section):
    """
    The certificate of a fit among bodies.

    Attributes
    ----------
    certificate : PhysicalCertificate
        What shows it.
    exports : mapping of str to sequence of str
        Files for other programs, and what each has no place for.

    """

    title: ClassVar[str] = 'Physical consistency'
    template: ClassVar[str] = 'physical.html'

    certificate: PhysicalCertificate
    exports: Mapping[str, Sequence[str]]

    @property
    def rows(self) -> list[tuple[Consistency, float, bool]]:
        """Link, its smallest size relative to the prior's, whether it is at its limit."""
        given = self.certificate
        return [
            (link, float(share), link.link in given.active)
            for link, share in zip(given.links, given.shares, strict=True)
        ]

    @property
    def without_place(self) -> dict[str, Counter[str]]:
        """Effects, and how many values of each, that the files have no place for."""
        return {
            file: Counter(line.split(':')[0] for line in lines)
            for file, lines in self.exports.items()
        }

    @property
    def cost(self) -> tuple[float, float]:
        """Torque error that the constraints cost [%]: training data, blocks left out."""
        given = self.certificate
        return 100.0 * (given.misfit_ratio - 1.0), 100.0 * (given.held_out_ratio - 1.0)

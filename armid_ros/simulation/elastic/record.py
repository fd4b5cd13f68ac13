# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A run of an arm whose joints give way, recorded on both sides of its springs."""

from __future__ import annotations

from collections.abc import Callable

from armid_ros.errors import ModelError
from armid_ros.motion import ElasticRun, Motion
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.run import whole_steps
from armid_ros.simulation.simulated_arm import LinkSample, SimulatedArm
import numpy as np


def record(
    arm: SimulatedArm,
    reference: Reference,
    *,
    rate: float = 1000.0,
    progress: Callable[[float], None] | None = None,
) -> ElasticRun:
    """
    Let an arm follow a reference from its first point, and record both sides.

    Parameters
    ----------
    arm : SimulatedArm
        The arm, with springs.
    reference : Reference
        What it should do.
    rate : float
        Recorded samples per second [Hz]; a whole number of steps apart.
    progress : callable, optional
        Is given the share that is done, from 0 to 1.

    Raises
    ------
    TrajectoryError
        If the reference does not fit the robot, or passes a limit.
    ModelError
        If the rate does not fit the step, or all joints are rigid.

    """
    stride = whole_steps(1.0 / rate, arm.plant.dt, f'a rate of {rate:g} Hz')
    arm.start_on(reference)
    count = int(np.floor(reference.duration / (stride * arm.plant.dt) + 1e-9))
    samples = [arm.read(stride)]
    for number in range(count):
        samples.append(arm.advance(stride))
        if progress is not None and number % 100 == 0:
            progress(number / count)
    links = [_link(arm, sample.link) for sample in samples]
    t, q, dq, tau = (
        np.array([getattr(sample, name) for sample in samples]) for name in ('t', 'q', 'dq', 'tau')
    )
    link_q, link_dq, link_ddq, asked = (
        np.array([getattr(link, name) for link in links]) for name in ('q', 'dq', 'ddq', 'asked_q')
    )
    period = stride * arm.plant.dt
    before = asked[0] - period * links[0].asked_dq
    velocity = np.diff(asked, axis=0, prepend=before[np.newaxis]) / period
    return ElasticRun(
        Motion(arm.joints, t, q, dq, np.zeros_like(q), tau),
        Motion(arm.joints, t, link_q, link_dq, link_ddq),
        velocity,
        felt=np.stack([link.acceleration for link in links], axis=1),
    )


def _link(arm: SimulatedArm, sample: LinkSample | None) -> LinkSample:
    if sample is None:
        raise ModelError(f'{arm.plant.robot.name}: its joints are rigid; use simulate')
    return sample

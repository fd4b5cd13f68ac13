# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimation of drive gains from a known payload.

A common factor of all efforts cannot be distinguished from the same factor of all masses. A
payload of known mass in some recordings makes both identifiable. The effort of each joint is
k (Y pi + p), where p is the torque of the payload. The gain k is therefore the coefficient of p in
the regression of the effort on the columns of Y and p.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError, meant
from armid_ros.files.cells import listed, parted
from armid_ros.identification.rows.checks import residual_of_fit
from armid_ros.identification.rows.regression import predictions, regressions
from armid_ros.identification.rows.signals import conditioning, segments, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin
from scipy.stats import t as student


@dataclass(frozen=True)
class DriveGains:
    """
    Gain of each drive: ratio of measured effort to the torque of the drive.

    Attributes
    ----------
    joints : tuple of str
        Joint names.
    values, std : ndarray, shape (n,)
        Gains and their standard deviations; 1 and infinite if the payload does not determine them.
    half_width : ndarray, shape (n,)
        Half of the 95 % confidence interval.

    """

    joints: tuple[str, ...]
    values: FloatArray
    std: FloatArray
    half_width: FloatArray

    def document(self) -> list[dict[str, object]]:
        """Return the gains for identification.json; null for a gain that is not identified."""
        numbers = zip(
            *(array.tolist() for array in (self.values, self.std, self.half_width)), strict=True
        )
        return [
            {'joint': joint, 'gain': gain, 'std': std, 'interval': [gain - width, gain + width]}
            if np.isfinite(std)
            else {'joint': joint, 'gain': None}
            for joint, (gain, std, width) in zip(self.joints, numbers, strict=True)
        ]

    def sentences(self) -> tuple[str, ...]:
        """Return sentences on the drive gains, and on the scaling of efforts by these gains."""
        sure = np.isfinite(self.std)
        lines = [
            f'drive gain of {joint}: {gain:.4g} ({gain - width:.4g} to {gain + width:.4g}, 95 %)'
            for joint, gain, width, one in zip(
                self.joints, self.values, self.half_width, sure, strict=True
            )
            if one
        ]
        unknown = [joint for joint, one in zip(self.joints, sure, strict=True) if not one]
        if unknown:
            lines.append(f'drive gain not determined, taken as 1: {", ".join(unknown)}')
        scale = ','.join(f'{1.0 / gain:.4g}' for gain in self.values)
        lines.append(
            'the model is fitted to efforts divided by these gains; for other recordings of these '
            f'drives, give --effort-scale {scale}'
        )
        return tuple(lines)


def payloads_of(
    texts: Sequence[str], recordings: Sequence[Recording], robot: Robot
) -> Mapping[str, Robot]:
    """
    Return a robot with payload for each loaded recording, by the path of the recording.

    Raises
    ------
    IdentificationError
        If a text is no payload as in `parse_payload`, or names no recording or link.

    """
    found: dict[str, Robot] = {}
    bags = {recording.source: Path(recording.source) for recording in recordings}
    for text in texts:
        name, link, payload = parse_payload(text)
        named = [source for source, bag in bags.items() if name in (str(bag), bag.name, bag.stem)]
        if len(named) != 1:
            raise IdentificationError(
                f"--payload '{text}': BAG matches {len(named)} recordings; it has to match one of "
                f'{", ".join(map(str, bags.values()))}'
            )
        found[named[0]] = with_payload(found.get(named[0], robot), link, payload)
    return found


def parse_payload(text: str) -> tuple[str, str, pin.Inertia]:
    """
    Return recording, link and payload from a text 'BAG=KG@LINK' or 'BAG=KG@LINK:X,Y,Z'.

    Returns
    -------
    bag, link : str
        Name of the recording, and link that carries the payload.
    payload : pinocchio.Inertia
        Point mass in the frame of the link.

    Raises
    ------
    IdentificationError
        If the text has neither form.

    """
    *parts, body = parted(text, '=')
    bag = '='.join(parts)
    number, _, where = body.partition('@')
    link, *place = listed(where, ':')
    try:
        mass = float(number)
        center = [float(part) for part in (':'.join(place) or '0,0,0').split(',')]
    except ValueError:
        mass, center = np.nan, []
    if len(center) != 3 or not bag or not link or not 0.0 < mass < np.inf:
        raise IdentificationError(
            f"--payload '{text}' has to be BAG=KG@LINK, with a positive mass, or "
            'BAG=KG@LINK:X,Y,Z with its centre of mass in the frame of the link [m]'
        )
    return bag, link, pin.Inertia(mass, np.array(center), np.zeros((3, 3)))


def with_payload(robot: Robot, link: str, payload: pin.Inertia) -> Robot:
    """Return the robot with a payload added to a link; raise an error for an unknown link."""
    frames = {f.name: f for f in robot.model.frames if f.type == pin.FrameType.BODY}
    frame = frames.get(link)
    if frame is None or frame.parentJoint == 0:
        links = [name for name, one in frames.items() if one.parentJoint > 0]
        raise IdentificationError(
            f"--payload: '{link}' is not a moving link; moving links are {', '.join(links)}"
            f'{meant(link, links)}'
        )
    parameters = robot.rigid_parameters.reshape(-1, 10).copy()
    parameters[frame.parentJoint - 1] += frame.placement.act(payload).toDynamicParameters()
    return robot.with_inertias(parameters.ravel())


def drive_gains(
    arm: ArmModel,
    recordings: Sequence[Recording],
    loaded: Mapping[str, Robot],
    signals: SignalSettings,
    rng: np.random.Generator,
) -> DriveGains:
    """
    Estimate the gain of each drive from recordings with and without a known payload.

    Parameters
    ----------
    arm : ArmModel
        Robot and effects.
    recordings : sequence of Recording
        Data with efforts, where some recordings differ in their payload.
    loaded : mapping of str to Robot
        Robot with its payload, by the path of the recording.
    signals : SignalSettings
        Filtering.
    rng : numpy.random.Generator
        Generator of the random states from which base parameters are found.

    Raises
    ------
    IdentificationError
        If no gain is determined, as when all recordings have the same payload.

    """
    used = conditioning(recordings, signals)
    rows = regressions(arm, arm.base_parameters(rng).independent, recordings, used)
    known = np.zeros((0, arm.robot.n_joints))  # torque of the payloads
    for one in recordings:
        carrying = replace(arm, robot=loaded.get(one.source, arm.robot))
        fits = zip(predictions(carrying, [one], used), predictions(arm, [one], used), strict=True)
        added = [heavy.predicted - bare.predicted for heavy, bare in fits]
        known = np.concatenate([known, *added])
    columns, tau, informative = (
        np.concatenate([getattr(part, name) for part in rows])
        for name in ('columns', 'tau', 'informative')
    )
    # twenty blocks of each stretch, taken as independent
    counts = [len(part.tau) for part in rows]
    blocks = np.concatenate([20 * k + np.arange(n) * 20 // n for k, n in enumerate(counts)])
    gains = [
        _gain(columns[use, j], known[use, j], tau[use, j], blocks[use])
        for j, use in enumerate(informative.T)
    ]
    values, std, width = (np.array(one) for one in zip(*gains, strict=True))
    if not np.any(np.isfinite(std)):
        raise IdentificationError(
            '--payload: the recordings do not determine the gain of any drive; record one motion '
            'with and without the payload, or use a heavier payload'
        )
    return DriveGains(arm.robot.joints, values, std, width)


def _gain(
    columns: FloatArray, payload_torque: FloatArray, tau: FloatArray, blocks: FloatArray
) -> tuple[float, float, float]:
    """Return a drive's gain, with the standard deviation and half-width of its 95 % interval."""
    scale = np.linalg.norm(columns, axis=0)
    columns = columns[:, scale > 0.0] / scale[scale > 0.0]
    # regression of the effort's residual on that of the payload's torque (Frisch and Waugh)
    column, target = residual_of_fit(np.column_stack([payload_torque, tau]), columns).T
    size = float(column @ column)
    # the joint's own columns explain the torque of the payload
    if size <= 1e-8 * float(payload_torque @ payload_torque):
        return 1.0, np.inf, np.inf
    gain = float(column @ target) / size
    residual = target - gain * column
    scores = np.bincount(np.unique(blocks, return_inverse=True)[1], weights=column * residual)
    count = len(scores)
    std = float(np.sqrt(count / (count - 1.0) * np.sum(scores**2)) / size)
    # largest relative standard deviation of a gain that is determined
    if not std < 0.05 * abs(gain):
        return 1.0, np.inf, np.inf
    return gain, std, float(student.ppf(0.975, count - 1)) * std


def corrected(
    arm: ArmModel,
    recordings: Sequence[Recording],
    loaded: Mapping[str, Robot],
    gains: DriveGains,
    signals: SignalSettings,
) -> list[Recording]:
    """Return recordings with the bare arm's torques: efforts over gains, minus payload."""
    result = []
    for recording in recordings:
        assert recording.tau is not None
        tau = recording.tau / gains.values
        if recording.source in loaded:
            motions = list(segments(recording, conditioning([recording], signals)))
            times = np.concatenate([motion.t for motion in motions])
            carrying = replace(arm, robot=loaded[recording.source])
            torque = np.concatenate([carrying.torque(x) - arm.torque(x) for x in motions])
            tau = tau - np.column_stack([np.interp(recording.t, times, one) for one in torque.T])
        result.append(replace(recording, tau=tau))
    return result

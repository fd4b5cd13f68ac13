# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the kind and the number of a case to its recordings of two days."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np

from tests.hidden.arrays import FloatArray, KnownEffect, sampled, START_NS
from tests.hidden.lived.arms import load_arm, worn_bodies
from tests.hidden.lived.causes import CAUSES
from tests.hidden.lived.causes.base import Cause, Scene
from tests.hidden.lived.causes.rigid import Mounting
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import draw_path, Path, tracked
from tests.hidden.lived.plant import LivedArm
from tests.hidden.lived.sizing import filtered, misfit, rows_of, sized
from tests.hidden.lived.specification import LivedSpec, specify
from tests.hidden.lived.wear import Wear
from tests.hidden.sensors import Instruments


@dataclass(frozen=True)
class LivedRecording:
    """
    What was recorded of one run, and what only the generator knows of it.

    Attributes
    ----------
    recording : Recording
        What a diagnosis gets.
    style : str
        What kind of motion it is.
    contribution : ndarray, shape (N, n)
        Part of the effort that the cause made, without noise: with it less without it, along the
        same recorded motion [N m]. Not for the diagnosis.

    """

    recording: Recording
    style: str
    contribution: FloatArray


@dataclass(frozen=True)
class LivedCase:
    """
    An arm on two days.

    Attributes
    ----------
    spec : LivedSpec
        What it was made of.
    robot : Robot
        As its engineer describes it, on a floor on earth: what a diagnosis gets.
    known : tuple of KnownEffect
        Friction that the engineer's model has; empty where a model is identified from day 1.
    day_1, day_2 : tuple of LivedRecording
        Three each; day_1 is empty where the question is asked of a description alone.
    held_out : LivedRecording
        One more of day 2.
    truth : tuple of Cause
        What happened; empty for nothing.
    gravity : ndarray, shape (3,)
        True gravity of day 2 in the base frame [m/s^2].
    misfit : ndarray, shape (n,)
        What an ordinary model of day 1 leaves in each joint, rms; the noise without a day 1 [N m].
    gap : float
        Power of the cause over the squared misfit, in the joint where that is largest.

    """

    spec: LivedSpec
    robot: Robot
    known: tuple[KnownEffect, ...]
    day_1: tuple[LivedRecording, ...]
    day_2: tuple[LivedRecording, ...]
    held_out: LivedRecording
    truth: tuple[Cause, ...]
    gravity: FloatArray
    misfit: FloatArray
    gap: float


@lru_cache(maxsize=4)
def lived_case(kind: str, index: int) -> LivedCase:
    """
    Make a case; the same one for the same kind and number.

    Parameters
    ----------
    kind : str
        One of specification.KINDS.
    index : int
        Number, from 0.

    """
    return case_of(specify(kind, index))


def case_of(spec: LivedSpec) -> LivedCase:
    """Make the case of a specification."""
    draft = draw_case(spec)
    spec, chain, cause = draft.spec, draft.arm.chain, draft.cause
    recordings = {run: _record(draft, run) for run in draft.paths}
    return LivedCase(
        spec=spec,
        robot=draft.robot,
        known=_known(spec, draft.arm.wear, draft.robot),
        day_1=tuple(r for run, r in recordings.items() if run.startswith('day_1')),
        day_2=tuple(r for run, r in recordings.items() if run.startswith('day_2')),
        held_out=recordings['held_out'],
        truth=(cause,) if cause else (),
        gravity=(cause.bodies(chain) if cause else chain).gravity,
        misfit=draft.floor,
        gap=draft.gap(cause) if cause else 0.0,
    )


@dataclass(frozen=True)
class Draft:
    """
    A case before it is recorded.

    Attributes
    ----------
    spec : LivedSpec
        What it is made of.
    robot : Robot
        As described.
    arm : LivedArm
        As it is on day 1.
    worn : dict of str to LivedArm
        As it is in each run.
    paths : dict of str to Path
        Motion of each run.
    instruments : Instruments
        What records it.
    floor : ndarray, shape (n,)
        Misfit of an ordinary model of day 1 in each joint [N m].
    cause : Cause or None
        What happened.

    """

    spec: LivedSpec
    robot: Robot
    arm: LivedArm
    worn: dict[str, LivedArm]
    paths: dict[str, Path]
    instruments: Instruments
    floor: FloatArray
    cause: Cause | None

    def gap(self, cause: Cause) -> float:
        """Return the gap that a cause makes in the recording that is held out."""
        part = filtered(self.worn['held_out'].contribution(self.paths['held_out'], cause))
        return float(((part**2).mean(axis=0) / self.floor**2).max())


def draw_case(spec: LivedSpec) -> Draft:
    """Draw all of a case; the second of a pair has the cause of the first."""
    robot = load_arm(spec.arm)
    described = Chain.of(robot)
    strength = _strength(described, robot)
    arm = _draw_arm(spec, described, robot, strength)
    paths = {
        run: _draw_run(spec, run, arm.chain, robot, style) for run, style in spec.styles.items()
    }
    instruments = Instruments.of(strength, spec.rng('instruments'))
    if spec.exact:
        instruments = replace(instruments, jitter=0.0, torque_noise=0.5 * instruments.torque_noise)
    worn = {
        run: arm if spec.exact else replace(arm, wear=arm.wear.of_a_run(spec.rng('friction', run)))
        for run in paths
    }
    floor = _floor(described, worn, paths, instruments)
    draft = Draft(spec, robot, arm, worn, paths, instruments, floor, None)
    if spec.second_of_pair:
        return replace(draft, cause=draw_case(specify(spec.kind, spec.index - 1)).cause)
    return replace(draft, cause=_draw_cause(draft, strength))


def _strength(chain: Chain, robot: Robot) -> FloatArray:
    """Return what the torque of each joint goes by, shape (n,): gravity and quick motion."""
    rng = np.random.default_rng(0)
    n = robot.n_joints
    q = rng.uniform(-1.5, 1.5, (200, n))
    speed = np.minimum(robot.velocity_limit, 3.0)
    dq, ddq = rng.normal(size=(2, 200, n)) * np.array([0.3 * speed, 0.6 * speed])[:, np.newaxis]
    rms = np.sqrt((chain.torque(q, dq, ddq) ** 2).mean(axis=0))
    return rms + 0.03 * rms.max()


def _draw_arm(spec: LivedSpec, described: Chain, robot: Robot, strength: FloatArray) -> LivedArm:
    """Draw an arm of a description, with the clutter of its own."""
    rng, n = spec.rng('arm'), robot.n_joints
    speed = np.minimum(robot.velocity_limit, 3.0)
    unit = np.zeros((1, n))
    inertia = np.array(
        [
            described.with_gravity(np.zeros(3)).torque(unit, unit, np.eye(n)[[j]])[0, j]
            for j in range(n)
        ]
    )
    wear = Wear.draw(strength, speed, inertia, rng)
    if spec.exact:
        plain = Wear.none(n)
        wear = replace(
            plain, viscous=wear.viscous, coulomb=wear.coulomb, presliding=np.full(n, 1e-5)
        )
        return LivedArm(described, wear)
    return LivedArm(replace(described, bodies=worn_bodies(described.bodies, rng)), wear)


def _draw_run(spec: LivedSpec, run: str, chain: Chain, robot: Robot, style: str) -> Path:
    rng = spec.rng('motion', run)
    wanted = draw_path(style, robot, chain, float(rng.uniform(15.0, 24.0)), rng)
    error = np.exp(rng.uniform(np.log(3e-4), np.log(3e-3), robot.n_joints))
    return tracked(wanted, chain, error)


def _floor(
    described: Chain,
    worn: dict[str, LivedArm],
    paths: dict[str, Path],
    instruments: Instruments,
) -> FloatArray:
    """Return the misfit of an ordinary model of day 1 in each joint, rms, shape (n,) [N m]."""
    days = [run for run in paths if run.startswith('day_1')]
    noise = 0.3 * instruments.torque_noise  # what is left of it behind the filter
    if not days:
        return noise
    rows = [rows_of(described, paths[run], worn[run].effort(paths[run])) for run in days]
    return np.hypot(misfit(rows), noise)


def _draw_cause(draft: Draft, strength: FloatArray) -> Cause | None:
    spec, robot = draft.spec, draft.robot
    if spec.cause == 'none':
        return None
    if spec.gravity is not None:
        return Mounting(spec.gravity)
    second = [path for run, path in draft.paths.items() if not run.startswith('day_1')]
    ends = np.array([robot.lower, robot.upper])
    scene = Scene(
        chain=draft.arm.chain,
        strength=strength,
        speed=2.0 * np.sqrt(np.mean([(path.dq**2).mean(axis=0) for path in second], axis=0)),
        low=np.min([path.q.min(axis=0) for path in second], axis=0),
        high=np.max([path.q.max(axis=0) for path in second], axis=0),
        middle=np.where(np.isfinite(ends).all(axis=0), ends, 0.0).mean(axis=0),
        end=float(min(path.t[-1] for path in second)),
    )
    cause = CAUSES[spec.cause].draw(scene, spec.rng('cause'))
    return cause if spec.wanted is None else sized(cause, spec.wanted, draft.gap)


def _record(draft: Draft, run: str) -> LivedRecording:
    arm, path, instruments = draft.worn[run], draft.paths[run], draft.instruments
    rng = draft.spec.rng('noise', run)
    there = None if run.startswith('day_1') else draft.cause
    effort = arm.effort(path)
    contribution = np.zeros_like(effort) if there is None else arm.effort(path, there) - effort
    stamps = instruments.stamps(path.t)
    taken = instruments.taken(stamps, float(path.t[-1]), rng)
    q, dq, tau, part = (
        sampled(taken, path.t, x) for x in (path.q, path.dq, effort + contribution, contribution)
    )
    counted = instruments.positions(q, rng)
    noisy = instruments.torques(tau, rng)
    recording = Recording(
        joints=arm.chain.joints,
        t=stamps,
        q=counted,
        dq=instruments.velocities(dq, counted, rng),
        tau=noisy,
        start_ns=START_NS,
    )
    return LivedRecording(recording, draft.spec.styles[run], part)


def _known(spec: LivedSpec, wear: Wear, robot: Robot) -> tuple[KnownEffect, ...]:
    if spec.friction == 'unknown':
        return ()
    return tuple(
        KnownEffect(name, robot.joints, values if spec.friction == 'values' else None)
        for name, values in (
            ('viscous_friction', wear.viscous),
            ('coulomb_friction', wear.coulomb),
        )
    )

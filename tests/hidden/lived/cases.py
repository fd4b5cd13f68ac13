# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the kind and the number of a case to its recordings of two days."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path as FilePath

from armid_ros.robots import Robot
import numpy as np

from tests.hidden.arrays import FloatArray, Parameter, sampled
from tests.hidden.lived.arms import load_arm, worn_bodies
from tests.hidden.lived.causes import Cause, CAUSES, Mounting, Scene
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.instruments import Instruments
from tests.hidden.lived.motions import draw_path, Path, tracked
from tests.hidden.lived.plant import LivedArm
from tests.hidden.lived.sizing import gap, misfit, rows_of, sized
from tests.hidden.lived.specification import LivedSpec, specify
from tests.hidden.lived.wear import Wear

#: How many recordings each day has.
RUNS = 3


@dataclass(frozen=True)
class LivedRecording:
    """
    What was recorded of one run, and what only the generator knows of it.

    Attributes
    ----------
    joints : tuple of str
        Names in column order, n of them.
    t : ndarray, shape (N,)
        Stamps [s].
    q, tau : ndarray, shape (N, n)
        Positions [rad] and efforts [N m].
    dq : ndarray, shape (N, n), or None
        Velocities [rad/s], if they were recorded.
    style : str
        What kind of motion it is.
    contribution : ndarray, shape (N, n)
        Part of the effort that the cause made, without noise: with it less without it, along the
        same recorded motion [N m]. Not for the diagnosis.
    noise : ndarray, shape (n,)
        Standard deviation of the noise of the efforts [N m]. Not for the diagnosis.

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    tau: FloatArray
    dq: FloatArray | None
    style: str
    contribution: FloatArray
    noise: FloatArray


@dataclass(frozen=True)
class Truth:
    """
    What happened between the days.

    Attributes
    ----------
    name : str
        As in the catalogue, or of something the catalogue does not have.
    joints : tuple of str
        Where; empty for the whole arm.
    parameters : tuple of Parameter
        True values, as the catalogue names them.
    in_catalogue : bool
        Whether the catalogue has it.

    """

    name: str
    joints: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    in_catalogue: bool


@dataclass(frozen=True)
class Known:
    """
    Friction that the engineer's model has.

    Attributes
    ----------
    name : str
        As in the catalogue.
    joints : tuple of str
        Where.
    values : ndarray, shape (number of joints,), or None
        Values; None where it is given by name only.

    """

    name: str
    joints: tuple[str, ...]
    values: FloatArray | None


@dataclass(frozen=True)
class LivedCase:
    """
    An arm on two days.

    Attributes
    ----------
    spec : LivedSpec
        What it was made of.
    urdf : Path
        The engineer's description: what a diagnosis gets, on a floor on earth.
    known : tuple of Known
        Friction that the engineer's model has; empty where a model is identified from day 1.
    day_1, day_2 : tuple of LivedRecording
        Three each; day_1 is empty where the question is asked of a description alone.
    held_out : LivedRecording
        One more of day 2.
    truth : tuple of Truth
        What happened; empty for nothing.
    gravity : ndarray, shape (3,)
        True gravity of day 2 in the base frame [m/s^2].
    misfit : ndarray, shape (n,)
        What an ordinary model of day 1 leaves in each joint, rms; the noise without a day 1 [N m].
    misfit_share : float
        The same of all joints over the torque.
    gap : float
        Power of the cause over the squared misfit, in the joint where that is largest.

    """

    spec: LivedSpec
    urdf: FilePath
    known: tuple[Known, ...]
    day_1: tuple[LivedRecording, ...]
    day_2: tuple[LivedRecording, ...]
    held_out: LivedRecording
    truth: tuple[Truth, ...]
    gravity: FloatArray
    misfit: FloatArray
    misfit_share: float
    gap: float

    @property
    def key(self) -> str:
        """Name of the case."""
        return self.spec.key


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
    return _record_case(draw_case(specify(kind, index)))


def _record_case(draft: Draft) -> LivedCase:
    """Record all runs of a case."""
    spec, robot, arm, paths = draft.spec, draft.robot, draft.arm, draft.paths
    cause = draft.cause
    recordings = {
        run: _record(spec, run, draft.worn[run], paths[run], draft.instruments, cause)
        for run in paths
    }
    reach = draft.gap(cause) if cause else 0.0
    chain = cause.bodies(arm.chain) if cause else arm.chain
    assert robot.path is not None
    return LivedCase(
        spec=spec,
        urdf=robot.path,
        known=_known(spec, arm.wear, robot),
        day_1=tuple(r for run, r in recordings.items() if run.startswith('day_1')),
        day_2=tuple(r for run, r in recordings.items() if run.startswith('day_2')),
        held_out=recordings['held_out'],
        truth=_truth(cause),
        gravity=chain.gravity,
        misfit=draft.floor,
        misfit_share=draft.share,
        gap=reach,
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
    share : float
        Misfit of all joints over the torque.
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
    share: float
    cause: Cause | None

    def gap(self, cause: Cause) -> float:
        """Return the gap that a cause makes in the recording that is held out."""
        return gap(self.worn['held_out'], self.paths['held_out'], cause, self.floor)


def draw_case(spec: LivedSpec) -> Draft:
    """Draw all of a case; the second of a pair has the cause of the first."""
    robot = load_arm(spec.arm)
    described = Chain.of(robot)
    arm = _draw_arm(spec, described, robot)
    paths = {
        run: _draw_run(spec, run, arm.chain, robot, style) for run, style in spec.styles.items()
    }
    instruments = Instruments.draw(_strength(described, robot), spec.rng('instruments'))
    if spec.exact:
        instruments = replace(instruments, jitter=0.0, torque_noise=0.5 * instruments.torque_noise)
    worn = {run: replace(arm, wear=_wear_of(spec, arm.wear, run)) for run in paths}
    floor, share = _floor(described, worn, paths, instruments)
    draft = Draft(spec, robot, arm, worn, paths, instruments, floor, share, None)
    if spec.second_of_pair:
        return replace(draft, cause=draw_case(specify(spec.kind, spec.index - 1)).cause)
    return replace(draft, cause=_draw_cause(draft, described))


def _truth(cause: Cause | None) -> tuple[Truth, ...]:
    if cause is None:
        return ()
    return (Truth(cause.name, cause.joints, cause.parameters, cause.in_catalogue),)


def _strength(chain: Chain, robot: Robot) -> FloatArray:
    """Return what the torque of each joint goes by, shape (n,): gravity and quick motion."""
    rng = np.random.default_rng(0)
    n = robot.n_joints
    q = rng.uniform(-1.5, 1.5, (200, n))
    speed = np.minimum(robot.velocity_limit, 3.0)
    dq, ddq = rng.normal(size=(2, 200, n)) * np.array([0.3 * speed, 0.6 * speed])[:, np.newaxis]
    rms = np.sqrt((chain.torque(q, dq, ddq) ** 2).mean(axis=0))
    return rms + 0.03 * rms.max()


def _draw_arm(spec: LivedSpec, described: Chain, robot: Robot) -> LivedArm:
    """Draw an arm of a description, with the clutter of its own."""
    rng = spec.rng('arm')
    strength, n = _strength(described, robot), robot.n_joints
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


def _wear_of(spec: LivedSpec, wear: Wear, run: str) -> Wear:
    return wear if spec.exact else wear.of_a_run(spec.rng('friction', run))


def _floor(
    described: Chain,
    worn: dict[str, LivedArm],
    paths: dict[str, Path],
    instruments: Instruments,
) -> tuple[FloatArray, float]:
    """Return the misfit of an ordinary model of day 1 in each joint, and as a share."""
    days = [run for run in paths if run.startswith('day_1')]
    noise = 0.3 * instruments.torque_noise  # what is left of it behind the filter
    if not days:
        efforts = np.concatenate([worn[run].effort(path) for run, path in paths.items()])
        return noise, float(np.linalg.norm(noise) / np.sqrt((efforts**2).sum(axis=1).mean()))
    rows = [rows_of(described, paths[run], worn[run].effort(paths[run])) for run in days]
    floor, share = misfit(rows)
    return np.hypot(floor, noise), share


def _draw_cause(draft: Draft, described: Chain) -> Cause | None:
    spec, robot = draft.spec, draft.robot
    if spec.cause == 'none':
        return None
    if spec.gravity is not None:
        return Mounting(spec.gravity)
    second = [path for run, path in draft.paths.items() if not run.startswith('day_1')]
    ends = np.array([robot.lower, robot.upper])
    scene = Scene(
        chain=draft.arm.chain,
        strength=_strength(described, robot),
        speed=2.0 * np.sqrt(np.mean([(path.dq**2).mean(axis=0) for path in second], axis=0)),
        low=np.min([path.q.min(axis=0) for path in second], axis=0),
        high=np.max([path.q.max(axis=0) for path in second], axis=0),
        middle=np.where(np.isfinite(ends).all(axis=0), ends, 0.0).mean(axis=0),
        end=float(min(path.t[-1] for path in second)),
    )
    cause = CAUSES[spec.cause].draw(scene, spec.rng('cause'))
    return cause if spec.wanted is None else sized(cause, spec.wanted, draft.gap)


def _record(
    spec: LivedSpec,
    run: str,
    arm: LivedArm,
    path: Path,
    instruments: Instruments,
    cause: Cause | None,
) -> LivedRecording:
    rng = spec.rng('noise', run)
    there = None if run.startswith('day_1') else cause
    effort = arm.effort(path)
    contribution = np.zeros_like(effort) if there is None else arm.effort(path, there) - effort
    stamps = instruments.stamps(path.t)
    taken = instruments.taken(stamps, float(path.t[-1]), rng)
    q, dq, tau, part = (
        sampled(taken, path.t, x) for x in (path.q, path.dq, effort + contribution, contribution)
    )
    counted = instruments.positions(q, rng)
    return LivedRecording(
        joints=arm.chain.joints,
        t=stamps,
        q=counted,
        tau=instruments.torques(tau, rng),
        dq=instruments.velocities(dq, counted, rng),
        style=spec.styles[run],
        contribution=part,
        noise=instruments.torque_noise,
    )


def _known(spec: LivedSpec, wear: Wear, robot: Robot) -> tuple[Known, ...]:
    if spec.friction == 'unknown':
        return ()
    return tuple(
        Known(name, robot.joints, values if spec.friction == 'values' else None)
        for name, values in (
            ('viscous_friction', wear.viscous),
            ('coulomb_friction', wear.coulomb),
        )
    )

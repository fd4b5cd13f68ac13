# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Coupled joints: the map q = f(u) from the n driven joints u to the m moving joints q.

With J = df/du, the moving joints have dq = J du and ddq = J ddu + dJ/dt du, and the virtual work
of the torques tau of the moving joints gives the torques J^T tau of the driven joints. Constraint
forces do no work and do not appear. The map is affine for mimic joints and differentials. Passive
joints of a loop are solved for: Newton's method closes the loop, and the implicit function theorem
gives their derivatives (Featherstone 2008, chapter 8; Khalil and Dombre 2002, chapter 7).

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import threading
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots.description import Description, Joint
from armid_ros.robots.robot import of_joints, Robot
from armid_ros.robots.selection import leaders, standing_position
import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv


class Configuration(NamedTuple):
    """
    The moving joints in one state of the driven joints, or in N states.

    Attributes
    ----------
    q : ndarray, shape (m,) or (N, m)
        Positions [rad or m].
    jacobian : ndarray, shape (m, n) or (N, m, n)
        Derivative J of the positions by those of the driven joints.
    drift : ndarray, shape (m,) or (N, m)
        Accelerations dJ/dt du without an acceleration of the driven joints.

    """

    q: FloatArray
    jacobian: FloatArray
    drift: FloatArray


@dataclass(frozen=True, eq=False)
class Mechanism:
    """
    The map from n driven joints to m moving joints, q = A u + B p(u) + b.

    Attributes
    ----------
    joints : tuple of str
        Moving joints, in the order of the model.
    driven : ndarray, shape (m, n)
        A, the factors of the driven joints.
    passive : ndarray, shape (m, k)
        B, the factors of the passive joints p; k = 0 without loops.
    offset : ndarray, shape (m,)
        b [rad or m].
    start : tuple of ndarray, shapes (n,) and (k,)
        Positions at which the search for a closed loop begins [rad or m].
    model : pinocchio.Model
        Joints and, as frames, the points of the loops.
    loops : tuple of (int, int)
        Frames whose origins coincide.
    lower, upper : ndarray, shape (n,)
        Range in which the loops close. Beyond it the map is continued as a linear one, so that a
        search may pass through poses that it will reject.
    largest : ndarray, shape (m, n)
        Bound on the absolute values of J over the range; a sampled one with a margin for loops.

    """

    joints: tuple[str, ...]
    driven: FloatArray
    passive: FloatArray
    offset: FloatArray
    start: tuple[FloatArray, FloatArray]
    model: pin.Model
    loops: tuple[tuple[int, int], ...]
    lower: FloatArray
    upper: FloatArray
    largest: FloatArray

    @property
    def constant(self) -> bool:
        """Whether J is constant."""
        return not self.loops

    def at(self, u: FloatArray, du: FloatArray | None = None) -> Configuration:
        """
        Return the moving joints in one state of the driven joints.

        Parameters
        ----------
        u, du : ndarray, shape (n,)
            Positions [rad or m] and velocities, zero by default.

        Raises
        ------
        RobotError
            If a loop does not close.

        """
        if self.constant:
            return Configuration(self.driven @ u + self.offset, self.driven, 0.0 * self.offset)
        solution = self._solved(u)
        drift = np.zeros(len(solution[0])) if du is None else self._drift(*solution, du)
        return Configuration(solution[0], solution[1], drift)

    def states(self, u: FloatArray, du: FloatArray | None = None) -> Configuration:
        """Return the moving joints in N states, each (N, n), of the driven joints."""
        m, n = self.driven.shape
        if self.constant:
            q = u @ self.driven.T + self.offset
            return Configuration(q, np.broadcast_to(self.driven, (len(u), m, n)), np.zeros_like(q))
        known, key = _SCRATCH.of(self)[2], u.tobytes()
        if key not in known:
            while len(known) > 8:  # of the motions at hand
                known.pop(next(iter(known)))
            known[key] = [self._solved(row) for row in u]
        rows = known[key]
        drift = np.zeros((len(u), m))
        if du is not None:
            pairs = zip(rows, du, strict=True)
            drift[:] = [self._drift(q, slope, closing, x) for (q, slope, closing), x in pairs]
        q, jacobian = (np.array([row[part] for row in rows]) for part in (0, 1))
        return Configuration(q.reshape(-1, m), jacobian.reshape(-1, m, n), drift)

    def along(self, motion: Motion) -> tuple[Motion, FloatArray]:
        """Return the motion of the moving joints, and J of every sample, shape (N, m, n)."""
        q, jacobian, drift = self.states(motion.q, motion.dq)
        dq, ddq = (np.einsum('kmn,kn->km', jacobian, x) for x in (motion.dq, motion.ddq))
        return Motion(self.joints, motion.t, q, dq, ddq + drift), jacobian

    def _solved(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return the moving joints with closed loops, and J, in one state of the driven joints.

        The third result, (m, 3 L), are the changes of the moving joints that close a unit gap.

        """
        work, inside = _SCRATCH.of(self), np.clip(u, self.lower, self.upper)
        data, (begin, p), _ = work
        far = np.abs(inside - begin).max()
        if far > 0.5:  # the path from the start keeps the mode of assembly
            begin, p = self.start
            far = np.abs(inside - begin).max()
        for share in np.linspace(0.0, 1.0, int(far / 0.2) + 2)[1:] if far > 0.2 else (1.0,):
            base = self.driven @ (begin + share * (inside - begin)) + self.offset
            for _ in range(20):
                gap, by_q = self._gap(data, base + self.passive @ p)
                by_p = by_q @ self.passive
                _, inverse, failed = dposv(by_p.T @ by_p, by_p.T)
                if failed:
                    raise RobotError('the driven joints do not determine the passive ones')
                step = inverse @ gap
                p = p - step
                if np.abs(step).max() < 1e-12:
                    break
        if not np.abs(gap).max() < 1e-4:  # m; descriptions have rounded lengths
            raise RobotError(
                f'a loop does not close: its points are {np.abs(gap).max():.3g} m apart with the '
                f'driven joints at {np.round(u, 3).tolist()}'
            )
        work[1] = inside, p
        closing = self.passive @ inverse
        jacobian = self.driven - closing @ (by_q @ self.driven)
        return base + self.passive @ p + jacobian @ (u - inside), jacobian, closing

    def _drift(
        self, q: FloatArray, jacobian: FloatArray, closing: FloatArray, du: FloatArray
    ) -> FloatArray:
        """Return the accelerations dJ/dt du, shape (m,), that keep the loops closed."""
        data, world = _SCRATCH.of(self)[0], pin.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(self.model, data, q, jacobian @ du, np.zeros(len(q)))
        apart = [
            pin.getFrameClassicalAcceleration(self.model, data, b, world).linear
            - pin.getFrameClassicalAcceleration(self.model, data, a, world).linear
            for a, b in self.loops
        ]
        return np.asarray(-closing @ np.concatenate(apart))

    def _gap(self, data: pin.Data, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the vectors between the points of the loops, (3 L,) [m], and their slope."""
        pin.computeJointJacobians(self.model, data, q)
        pin.updateFramePlacements(self.model, data)
        world, gaps, slopes = pin.LOCAL_WORLD_ALIGNED, [], []
        for a, b in self.loops:
            first, second = (pin.getFrameJacobian(self.model, data, k, world)[:3] for k in (a, b))
            gaps.append(data.oMf[b].translation - data.oMf[a].translation)
            slopes.append(second - first)
        return np.concatenate(gaps), np.concatenate(slopes)


class _Scratch(threading.local):
    """Per mechanism and thread: work space, last solution, and solutions of whole motions."""

    def __init__(self) -> None:
        self._of: WeakKeyDictionary[Mechanism, list[Any]] = WeakKeyDictionary()

    def of(self, mechanism: Mechanism) -> list[Any]:
        if mechanism not in self._of:
            self._of[mechanism] = [mechanism.model.createData(), mechanism.start, {}]
        return self._of[mechanism]


_SCRATCH = _Scratch()


def moving_joints(description: Description, driven: Sequence[str]) -> tuple[str, ...]:
    """
    Return the joints that move a body when some joints are driven, in the order of the file.

    A driven joint that others follow is a motor without a body of its own if its link and all
    links that it carries have no inertia.

    """
    free, bodies = (
        {*driven, *description.passive},
        {name for name, inertial in description.links.items() if inertial},
    )
    while True:  # up to the links that carry bodies
        more = {j.parent for j in description.joints if j.child in bodies} - bodies
        if not more:
            break
        bodies |= more
    led = {name for joint in description.joints if joint.mimic for name in joint.mimic.multipliers}
    return tuple(
        joint.name
        for joint in description.movable()
        if free & set(leaders(description, joint, ())[0])
        and not (joint.name in led and joint.name in driven and joint.child not in bodies)
    )


def couple(tree: Robot, driven: Sequence[Joint], known: Mapping[str, float]) -> Robot:
    """
    Return the robot whose moving joints follow some driven joints.

    Parameters
    ----------
    tree : Robot
        The robot with all moving joints as driven ones.
    driven : sequence of Joint
        The driven joints.
    known : mapping of str to float
        Positions of joints that neither are driven nor move [rad or m].

    Returns
    -------
    Robot
        Limits of the driven joints are narrowed, so that all moving joints keep theirs.

    Raises
    ------
    RobotError
        If a loop does not close, or leaves passive joints free.

    """
    description = tree.description
    order = {name: number for number, name in enumerate(tree.joints)}
    driven = sorted(driven, key=lambda joint: order.get(joint.name, len(order)))
    names = [joint.name for joint in driven]
    if tuple(names) == tree.joints:
        return tree
    passive = [name for name in description.passive if name in tree.joints]
    matrix, offset = np.zeros((len(tree.joints), len(names) + len(passive))), []
    place = {name: column for column, name in enumerate([*names, *passive])}
    for row, name in zip(matrix, tree.joints, strict=True):
        factors, shift = leaders(description, description.by_name[name], ())
        for leader, factor in factors.items():
            if leader in place:
                row[place[leader]] += factor
            else:
                held = description.by_name[leader]
                shift += factor * standing_position(description, held, known)
        offset.append(shift)
    own = of_joints(driven)
    model, loops = tree.model.copy(), []
    for loop in description.loops:
        frames = []
        for link, point in zip(loop.links, loop.points, strict=True):
            carrier = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
            placement = carrier.placement * pin.SE3(np.eye(3), np.array(point))
            named = f'{link}_loop_{len(model.frames)}'
            frames.append(pin.Frame(named, carrier.parentJoint, placement, pin.FrameType.OP_FRAME))
        loops.append((model.addFrame(frames[0]), model.addFrame(frames[1])))
    ends = [(description.by_name[name].lower, description.by_name[name].upper) for name in passive]
    n = len(driven)
    mechanism = Mechanism(
        joints=tree.joints,
        driven=read_only(matrix[:, :n]),
        passive=read_only(matrix[:, n:]),
        offset=read_only(offset),
        start=(
            np.clip(np.zeros(n), own['lower'], own['upper']),
            np.array([min(max(0.0, lower), upper) for lower, upper in ends]),
        ),
        model=model,
        loops=tuple(loops),
        lower=np.full(n, -np.inf),
        upper=np.full(n, np.inf),
        largest=read_only(np.abs(matrix[:, :n])),
    )
    lower, upper = _narrowed(mechanism, tree, own['lower'], own['upper'])
    if loops:
        mechanism, lower, upper = _closing(mechanism, tree, lower, upper)
    share = np.sum(mechanism.largest, axis=1)
    rates = tree.velocity_limit / np.where(share > 0.0, share, 1.0)
    acts = mechanism.largest > 0.0
    velocity = np.min(np.where(acts, rates[:, np.newaxis], np.inf), axis=0, initial=np.inf)
    follow = [name for name in tree.joints if name not in names]
    limits = {
        'lower': lower,
        'upper': upper,
        'velocity_limit': np.minimum(velocity, own['velocity_limit']),
    }
    notes = (*tree.notes, f'coupled to the driven joints: {", ".join(follow)}')
    return replace(tree, **(own | limits), mechanism=mechanism, notes=notes)


def _narrowed(
    mechanism: Mechanism, tree: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return position limits of the driven joints that keep those of joints that follow them."""
    lower, upper = lower.copy(), upper.copy()
    followers = ~np.any(mechanism.passive, axis=1)
    ends = np.stack([tree.lower, tree.upper], axis=1) - mechanism.offset[:, np.newaxis]
    rows = list(zip(mechanism.driven[followers], ends[followers], strict=True))
    for row, end in rows:
        if np.count_nonzero(row) == 1:
            k = int(np.flatnonzero(row)[0])
            low, high = np.sort(end / row[k])
            lower[k], upper[k] = max(lower[k], low), min(upper[k], high)
    several = [
        (row, end) for row, end in rows if np.count_nonzero(row) > 1 and np.isfinite(end).all()
    ]
    if several:  # a box within the polytope, around the middle of the ranges
        matrix = np.array([row for row, _ in several])
        middle = np.linalg.lstsq(matrix, np.mean([end for _, end in several], axis=1))[0]
        for row, end in several:
            acts = row != 0.0  # noqa: RUF069 - as described
            room = np.abs(end - row @ middle).min() / np.abs(row).sum()
            lower[acts] = np.maximum(lower, middle - room)[acts]
            upper[acts] = np.minimum(upper, middle + room)[acts]
    if np.any(lower >= upper):
        raise RobotError('the limits of coupled joints leave no range to their driven joints')
    return lower, upper


def _closing(
    mechanism: Mechanism, tree: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[Mechanism, FloatArray, FloatArray]:
    """
    Narrow the range of the driven joints to where loops close and passive joints keep limits.

    Both hold a tenth beyond the result, because a motion may overshoot its limits.

    """
    start = mechanism.start[0]
    moved = np.any(mechanism.passive, axis=1)
    slopes = [np.abs(mechanism.at(start + shift).jacobian[moved]) for shift in (0.0, 0.01, -0.01)]
    own = np.flatnonzero(np.max(slopes, axis=(0, 1)) > 1e-9)
    ends = np.array([lower, upper])
    ends = np.where(np.isfinite(ends), ends, start + np.array([[-np.pi], [np.pi]]))
    count = 21 if len(own) < 3 else 5
    for share in np.linspace(1.1, 0.1, 21):
        box = start + share * (ends - start)
        grid = np.tile(start, (count ** len(own), 1))
        grid[:, own] = list(itertools.product(*np.linspace(box[0, own], box[1, own], count).T))
        try:
            q, jacobian, _ = mechanism.states(grid)
        except RobotError:
            continue
        inside = (q > tree.lower) & (q < tree.upper)
        # near a dead centre, the passive joints are much faster than the driven ones
        if inside[:, moved].all() and np.abs(jacobian).max() < 10.0:
            break
    else:
        raise RobotError(
            'a loop does not close around the position of its driven joints nearest to zero, or '
            'its passive joints are beyond their limits there'
        )
    ends[:, own] = (start + share / 1.1 * (ends - start))[:, own]
    within = [np.maximum(lower, ends[0]), np.minimum(upper, ends[1])]
    reach = np.array([np.full(len(start), -np.inf), np.full(len(start), np.inf)])
    reach[:, own] = box[:, own]
    largest = mechanism.largest.copy()
    # J between the samples: half of what it changes over the range is a generous margin
    largest[moved] = (np.abs(jacobian).max(axis=0) + 0.5 * np.ptp(jacobian, axis=0))[moved]
    found = replace(mechanism, lower=reach[0], upper=reach[1], largest=read_only(largest))
    return found, within[0], within[1]

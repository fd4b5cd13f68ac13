# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs and dampers between a link and a person, another machine or the world.

The spring is between a point of a link (``attachment``, in the frame of its joint) and an anchor.
The anchor is a fixed point of the base frame, or a point whose motion was recorded; see ``tied``.
The force of the spring acts on the arm, the opposite force on the anchor.

"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

from armid_ros.effects.action import Action
from armid_ros.effects.base import Arm, Effect, Unexplained
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.model import LinkFrames
from armid_ros.model.spring_ties import extension
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: Positions and velocities of all k anchors [m, m/s] at times of shape (N,), each (N or 1, k, 3).
Anchor = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

_AXES = ('x', 'y', 'z')
_ATTACHMENT_SHAPES = tuple(
    Shape(f'attachment_{axis}', 'm', -100.0, 100.0, 0.0, (-0.1, 0.0, 0.1)) for axis in _AXES
)


@dataclass(frozen=True)
class Attached(Effect):
    """Base class of springs and dampers between points of links and anchors."""

    @classmethod
    def _possible_joints(cls, robot: Robot) -> tuple[str, ...]:
        return robot.moving

    def _default_shape(self, robot: Robot) -> FloatArray:
        """Return default shape parameters: springs attached near the links' centres of mass."""
        values, model = self.shape_values, robot.model
        reach = max(float(np.linalg.norm(place.translation)) for place in model.jointPlacements)
        for row, joint in zip(values, self.joints, strict=True):
            lever = model.inertias[model.getJointId(joint)].lever
            away = float(np.linalg.norm(lever))
            # the assumed reach of an arm with one joint is 1 m
            row[:3] = lever * min((reach or 1.0) / max(away, 1e-12), 1.0)
        return values

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values of the shapes: present values for points, grids for all others."""
        return tuple(
            self.shape_values[:, [index]]
            if shape.unit == 'm' and shape.lower < 0.0
            else np.tile(shape.grid, (len(self.owners), 1))
            for index, shape in enumerate(self.shapes)
        )

    @property
    def _attachments(self) -> FloatArray:
        """Points on the links at which the springs are attached, shape (k, 3) [m]."""
        return self.shape_values[:, :3]

    @abstractmethod
    def _anchor(self, arm: Arm) -> Anchor:
        """Return a function from times to positions and velocities of the springs' anchors."""

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with the joint torques of the springs as a function of link motion."""
        robot, anchor = arm.robot, self._anchor(arm)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            times = np.broadcast_to(np.atleast_1d(t), (len(np.atleast_2d(q)),))
            frames = LinkFrames.of(robot, np.atleast_2d(q), self.joints)
            columns = self._columns(frames, np.atleast_2d(dq), *anchor(times))
            return np.asarray((columns @ values).reshape(np.shape(q)))

        return Action(link_torque=torque if np.any(values) else None)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the joint torque per unit of each parameter of every spring, shape (N, n, P)."""
        link = arm.link_motion(motion)
        return self._columns(arm.link_frames(motion), link.dq, *self._anchor(arm)(link.t))

    def _columns(
        self, frames: LinkFrames, dq: FloatArray, anchors: FloatArray, velocities: FloatArray
    ) -> FloatArray:
        """Return the regressor for given motions of links and anchors, shape (N, n, P)."""
        positions, jacobians = frames.points(self.joints, self._attachments)
        rate = np.einsum('nkxj,nj->nkx', jacobians, dq) - velocities
        columns = self._of_springs(jacobians, positions - anchors, rate)
        return columns.reshape(*dq.shape, -1)

    @abstractmethod
    def _of_springs(self, jacobians: FloatArray, span: FloatArray, rate: FloatArray) -> FloatArray:
        """
        Return the joint torque per unit of each quantity of k springs, shape (N, n, k, ...).

        `jacobians` of the attachments have the shape (N, k, 3, n). `span` is the vector from the
        anchor to the attachment [m], and `rate` its derivative, (N, k, 3) each.

        """


@dataclass(frozen=True)
class HumanInteraction(Attached):
    """
    Spring and damper between a point of a link and an anchor outside the arm.

    tau = J^T (k (p - r) + d (v - w) - f). p and v are position and velocity of the attachment, r
    and w those of the anchor. By default, the anchor rests where the attachment is in the middle
    of the range of motion. A spring fixed at another point r' has the force f = k (r' - r), so
    that an unknown anchor is three linear parameters. Confounded with joint_spring on a single
    moving joint and with the weight of the limb. The sum of the torques of a pair does not contain
    the spring, their difference does.
    Source: the human-exoskeleton leg pair, springs between corresponding segments.

    """

    name = 'human_interaction'
    summary = 'spring and damper from a link to a person, another machine or the world'
    smooth = True
    quantities = (
        Quantity('interaction_stiffness', 'N/m', lower=0.0, typical=(50.0, 50000.0)),
        Quantity('interaction_damping', 'N s/m', lower=0.0, typical=(0.5, 500.0)),
        *(Quantity(f'interaction_force_{axis}', 'N', typical=(0.5, 200.0)) for axis in _AXES),
    )
    shapes = _ATTACHMENT_SHAPES

    def _anchor(self, arm: Arm) -> Anchor:
        frames = LinkFrames.in_the_middle(arm.robot)
        points = zip(self.joints, self._attachments, strict=True)
        middle = np.stack([frames.places(joint, point) for joint, point in points], axis=1)
        return lambda t: (middle, np.zeros((1, 1, 3)))

    def _of_springs(self, jacobians: FloatArray, span: FloatArray, rate: FloatArray) -> FloatArray:
        stretch, speed = (np.einsum('nkxj,nkx->njk', jacobians, x) for x in (span, rate))
        forces = -jacobians.transpose(2, 0, 3, 1)
        # ties to known points have no constant forces
        return np.stack([stretch, speed, *forces][: len(self.quantities)], axis=-1)


@dataclass(frozen=True)
class InterfaceSlack(Attached):
    """
    Strap between a link and an anchor: a spring that pulls only when the slack is used up.

    tau = k J^T e max(|x| - slack, 0), where x = p - r is the vector from the anchor to the
    attachment and e its direction. Without slack it equals human_interaction with a known anchor;
    different tensions of the strap distinguish them. The anchor is a shape: a point of the base
    frame.

    """

    name = 'interface_slack'
    summary = 'strap from a link to an anchor: a spring that pulls only beyond its slack'
    smooth = True
    quantities = (Quantity('slack_stiffness', 'N/m', lower=0.0, typical=(50.0, 50000.0)),)
    shapes = (
        *_ATTACHMENT_SHAPES,
        *(
            Shape(f'anchor_{axis}', 'm', -100.0, 100.0, 0.0, (-0.3, -0.1, 0.0, 0.1, 0.3))
            for axis in _AXES
        ),
        Shape('slack', 'm', 0.0, 5.0, 0.01, (0.0, 0.003, 0.01, 0.03, 0.1)),
    )

    def _default_shape(self, robot: Robot) -> FloatArray:
        """Return default shapes; each anchor is where the attachment is in the mid-range pose."""
        values = super()._default_shape(robot)
        middle = LinkFrames.in_the_middle(robot)
        for row, joint in zip(values, self.joints, strict=True):
            row[3:6] = middle.places(joint, row[:3])[0]
        return values

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return the anchors and slacks that best explain the residual, as start values."""
        rows = np.unique(np.linspace(0, len(unexplained.q) - 1, 400).astype(int))
        weight = unexplained.weight[rows, :, np.newaxis]
        basis = np.linalg.qr((unexplained.nuisance[rows] * weight).reshape(weight.size, -1))[0]

        target = (unexplained.residual[rows, :, np.newaxis] * weight).ravel()
        target -= basis @ (basis.T @ target)
        starts, frames = [], LinkFrames.of(arm.robot, unexplained.q[rows])
        for joint, shape in zip(self.joints, self.shape_values, strict=True):
            positions, jacobians = frames.points((joint,), shape[np.newaxis, :3])
            anchors, slacks = _proposals(positions[:, 0])
            pulls = extension(positions - anchors, slacks)
            straps = jacobians[:, 0].swapaxes(1, 2) @ pulls.swapaxes(1, 2)
            columns = (straps * weight).reshape(weight.size, -1)
            # squares and products of the parts of the columns beyond `nuisance`
            own = np.sum(columns**2, axis=0) - np.sum((basis.T @ columns) ** 2, axis=0)
            aim = columns.T @ target
            gain = np.maximum(aim, 0.0) ** 2 / np.maximum(own, max(1e-12 * own.max(), 1e-300))
            best = np.argsort(-gain)[:2]  # both kinds become candidate causes
            starts.append([(*shape[:3], *anchors[k], slacks[k]) for k in best])
        return tuple(np.array(starts).transpose(2, 0, 1))

    @property
    def slacks(self) -> FloatArray:
        """Slack of every strap, shape (k,) [m]."""
        return self.shape_values[:, -1]

    def _anchor(self, arm: Arm) -> Anchor:
        fixed = self.shape_values[np.newaxis, :, 3:6], np.zeros((1, 1, 3))
        return lambda t: fixed

    def _of_springs(self, jacobians: FloatArray, span: FloatArray, rate: FloatArray) -> FloatArray:
        return np.asarray(np.einsum('nkxj,nkx->njk', jacobians, extension(span, self.slacks)))


def _proposals(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return candidate anchors (A, 3) and slacks (A,) of a strap, for positions of its end."""
    middle, spread = places.mean(axis=0), float(places.std(axis=0).max())
    directions = np.array(
        [direction for direction in product((-1.0, 0.0, 1.0), repeat=3) if any(direction)]
    )
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # distances from the mean position, relative to the spread of the positions
    shells = [middle + distance * spread * directions for distance in (0.7, 1.5, 3.0)]
    anchors = np.concatenate([middle[np.newaxis], *shells])
    lengths = np.linalg.norm(places - anchors[:, np.newaxis], axis=2)
    shares = np.array([0.0, 0.2, 0.4, 0.6, 0.8])  # slacks are quantiles of the strap length
    slacks = np.quantile(lengths, shares, axis=1).T * (shares > 0.0)
    return np.repeat(anchors, len(shares), axis=0), slacks.ravel()

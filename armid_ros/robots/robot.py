# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The `Robot`: rigid-body model of the driven joints and their limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, freeze, read_only
from armid_ros.robots.description import Description, Joint, parse_description, parse_xml
from armid_ros.robots.mechanism import Mechanism
import numpy as np
import numpy.typing as npt
import pinocchio as pin

GRAVITIES = {'earth': (0.0, 0.0, -9.81), 'moon': (0.0, 0.0, -1.62)}
#: Number of inertial parameters of a link.
PER_LINK = 10

#: A mass [kg] or a first moment [kg m] below this is zero. BLAS kernels round differently; for a
#: first moment of 1 kg m and a larger mass, the inertia about the centre is accurate to 1e-7.
NO_MASS = 1e-9

#: Half the range of a joint without position limits [rad or m].
UNLIMITED_HALF_RANGE = np.pi


@dataclass(frozen=True, eq=False)
class Robot:
    """
    Robot with fixed base and n driven joints, each revolute or prismatic.

    The model is never changed; `with_gravity` and `with_inertias` return a robot with a copy of
    it. Friction, damping and rotor inertia are no part of the model, but effects with their own
    parameters.

    Attributes
    ----------
    name : str
        Name in the description, or the shipped name.
    model : pinocchio.Model
        Rigid bodies of the moving joints, nq == nv == m; m = n unless joints are coupled. Links on
        joints that do not move are part of the body that carries them.
    joints : tuple of str
        Driven joints in velocity order.
    links : tuple of str
        Child link of each moving joint, m of them.
    lower, upper : ndarray, shape (n,)
        Position limits [rad or m]; infinite where the description gives none.
    velocity_limit : ndarray, shape (n,)
        [rad/s or m/s], infinite where unlimited.
    torque_limit : ndarray, shape (n,)
        [N m or N], infinite where unlimited.
    acceleration_limit : ndarray, shape (n,)
        [rad/s^2 or m/s^2], infinite where none is given; a URDF has none.
    prismatic : ndarray of bool, shape (n,)
        True where a joint slides.
    urdf : str
        The description, xacro expanded.
    urdf_damping, urdf_friction : ndarray, shape (n,)
        Values in ``<dynamics>`` of the description [N m s/rad, N m]; zero if missing.
    notes : tuple of str
        Sentences on assumptions and doubtful values in the description.
    path : Path or None
        The loaded file; meshes and collision exceptions (SRDF) are searched from its folder.
    mechanism : Mechanism or None
        Map from the driven to the moving joints; None if these are the same.

    Examples
    --------
    >>> import armid_ros as ar
    >>> robot = ar.load_robot('my_arm.urdf')
    >>> robot.joints
    ('waist', 'shoulder', 'elbow')
    >>> print(robot.rigid_parameters[::10], 'kg')
    [2. 2. 1.] kg

    """

    name: str
    model: pin.Model = field(repr=False)
    joints: tuple[str, ...]
    links: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity_limit: FloatArray
    torque_limit: FloatArray
    acceleration_limit: FloatArray
    prismatic: npt.NDArray[np.bool_]
    urdf: str = field(repr=False)
    urdf_damping: FloatArray = field(repr=False)
    urdf_friction: FloatArray = field(repr=False)
    notes: tuple[str, ...] = ()
    path: Path | None = None
    mechanism: Mechanism | None = None

    def __repr__(self) -> str:
        """Return name, joints and mass in two lines."""
        return (
            f'Robot {self.name}: {self.n_joints} joints ({", ".join(self.joints)})\n'
            f'  {self.rigid_parameters[::10].sum():.4g} kg moving, from {self.path or "text"}'
        )

    def __post_init__(self) -> None:
        """Freeze the arrays and check that model and names agree."""
        limits = ('lower', 'upper', 'velocity_limit', 'torque_limit', 'acceleration_limit')
        names = (*limits, 'urdf_damping', 'urdf_friction')
        freeze(self, *names)
        for name in names:
            if getattr(self, name).shape != (len(self.joints),):
                raise RobotError(
                    f'{self.name}: {name} has shape {getattr(self, name).shape}, '
                    f'but there are {len(self.joints)} driven joints'
                )
        prismatic = np.array(self.prismatic, dtype=np.bool_)
        prismatic.setflags(write=False)
        object.__setattr__(self, 'prismatic', prismatic)
        if not self.model.nq == self.model.nv == len(self.moving):
            raise RobotError(
                f'{self.name}: the model has nq = {self.model.nq} and nv = {self.model.nv}, '
                f'but there are {len(self.moving)} moving joints'
            )

    @property
    def n_joints(self) -> int:
        """Return the number of driven joints n."""
        return len(self.joints)

    @property
    def moving(self) -> tuple[str, ...]:
        """Joints that move a body: driven joints, and joints coupled to driven joints."""
        return self.joints if self.mechanism is None else self.mechanism.joints

    @property
    def all_joints(self) -> tuple[str, ...]:
        """Moving joints, and driven joints (motors) without a body of their own."""
        return tuple(dict.fromkeys([*self.moving, *self.joints]))

    @property
    def tip(self) -> str:
        """Last moving joint of the arm; with coupled joints, the joint farthest from the base."""
        if self.mechanism is None:
            return self.joints[-1]
        lengths = [np.linalg.norm(place.translation) for place in self.model.jointPlacements]
        reach = [
            sum(lengths[number] for number in chain) + np.linalg.norm(body.lever)
            for chain, body in zip(self.model.supports, self.model.inertias, strict=True)
        ]
        return self.moving[int(np.argmax(reach[1:]))]

    def slides(self, joint: str) -> bool:
        """Return whether a joint, driven or moving, is prismatic."""
        own = self if joint in self.joints else self.tree
        return bool(own.prismatic[own.index(joint)])

    def body_of(self, joint: str) -> int:
        """Return the index of the body that a joint moves; for a motor, of the last moved body."""
        if self.mechanism is None or joint in self.moving:
            return self.moving.index(joint)
        return int(np.flatnonzero(self.mechanism.driven[:, self.index(joint)])[-1])

    @cached_property
    def tree(self) -> Robot:
        """Robot with all moving joints driven; the same object if no joints are coupled."""
        if self.mechanism is None:
            return self
        own = [self.description.by_name[name] for name in self.moving]
        return replace(self, **joint_fields(own), mechanism=None)

    def positions(self, q: FloatArray) -> FloatArray:
        """Convert positions of driven joints (..., n) to positions of moving joints (..., m)."""
        if self.mechanism is None:
            return q
        rows = self.mechanism.states(q.reshape(-1, self.n_joints)).q
        return rows.reshape(*q.shape[:-1], len(self.moving))

    def state(
        self, q: FloatArray, dq: FloatArray, ddq: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Convert positions, velocities and accelerations of driven joints to moving joints."""
        if self.mechanism is None:
            return q, dq, ddq
        position, jacobian, drift = self.mechanism.at(q, dq)
        return position, jacobian @ dq, jacobian @ ddq + drift

    def inverse_dynamics(
        self, data: pin.Data, q: FloatArray, dq: FloatArray, ddq: FloatArray
    ) -> FloatArray:
        """Return the torques of the driven joints for one state, shape (n,) [N m or N]."""
        if self.mechanism is None:
            return np.asarray(pin.rnea(self.model, data, q, dq, ddq))
        position, jacobian, drift = self.mechanism.at(q, dq)
        tau = pin.rnea(self.model, data, position, jacobian @ dq, jacobian @ ddq + drift)
        return np.asarray(jacobian.T @ tau)

    def inertia(self, data: pin.Data, q: FloatArray) -> FloatArray:
        """Return the inertia matrix of the driven joints in a pose, shape (n, n) [kg m^2]."""
        if self.mechanism is None:
            return np.asarray(pin.crba(self.model, data, q))
        position, jacobian, _ = self.mechanism.at(q)
        return np.asarray(jacobian.T @ pin.crba(self.model, data, position) @ jacobian)

    @cached_property
    def description(self) -> Description:
        """Links and joints of the URDF, driven or not."""
        return parse_description(parse_xml(self.urdf))

    @cached_property
    def geometry(self) -> tuple[JointGeometry, ...]:
        """Axis and placement of each moving joint."""
        return tuple(JointGeometry.of(self.model, k) for k in range(len(self.links)))

    @property
    def gravity(self) -> FloatArray:
        """Gravity vector in the base frame, shape (3,) [m/s^2]."""
        return read_only(np.array(self.model.gravity.linear))

    @property
    def base(self) -> str:
        """Name of the base link, whose frame is the base frame."""
        for frame in self.model.frames:
            if frame.type == pin.FrameType.BODY:
                return str(frame.name)
        return str(self.model.frames[0].name)

    @property
    def rigid_parameters(self) -> FloatArray:
        """
        Inertial parameters of the m moving bodies, shape (10 m,).

        Body by body m, m cx, m cy, m cz [kg, kg m] and Ixx, Ixy, Iyy, Ixz, Iyz, Izz [kg m^2]
        about the joint frame, which is the column order of pinocchio's
        computeJointTorqueRegressor.

        """
        bodies = list(self.model.inertias)[1:]
        return read_only(np.concatenate([body.toDynamicParameters() for body in bodies]))

    @property
    def described_spread(self) -> FloatArray:
        """
        Largest expected errors of the described inertial parameters, shape (m, 10).

        A described value may be wrong by as much as its own size. A missing value gets a tenth of
        a mean link, at 0.1 m from the joint.

        """
        body = np.abs(self.rigid_parameters.reshape(-1, PER_LINK))
        mass = body[:, :1] + 0.1 * np.mean(body[:, :1])
        return np.asarray(body + mass * np.array([1.0] + 3 * [0.1] + 6 * [0.1**2]))

    @property
    def position_units(self) -> tuple[str, ...]:
        """Return the unit of each joint position: 'rad' or 'm'."""
        return tuple('m' if slides else 'rad' for slides in self.prismatic)

    @property
    def torque_units(self) -> tuple[str, ...]:
        """Return the unit of each joint torque or force: 'N m' or 'N'."""
        return tuple('N' if slides else 'N m' for slides in self.prismatic)

    @property
    def zero_pose(self) -> FloatArray:
        """Pose with each joint at zero, or at the limit nearest to zero, shape (n,)."""
        return np.clip(np.zeros(self.n_joints), self.lower, self.upper)

    @property
    def middle_pose(self) -> FloatArray:
        """Pose with each joint in the middle of its range, 0 without limits, shape (n,)."""
        limited = np.isfinite(self.lower) & np.isfinite(self.upper)
        lower, upper = (np.where(limited, end, 0.0) for end in (self.lower, self.upper))
        return np.asarray((lower + upper) / 2)

    def position_range(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper position limits (n,), +-`UNLIMITED_HALF_RANGE` if unlimited."""
        return position_range(self.lower, self.upper)

    def index(self, joint: str) -> int:
        """Return the index of a driven joint; a RobotError lists the known names."""
        try:
            return self.joints.index(joint)
        except ValueError:
            raise RobotError(
                f"{self.name} has no driven joint '{joint}'; its driven joints are "
                f'{", ".join(self.joints)}'
            ) from None

    def with_gravity(self, vector: Sequence[float] | FloatArray) -> Robot:
        """Return the robot with another gravity vector, (3,) [m/s^2], in the base frame."""
        model = self.model.copy()
        model.gravity = pin.Motion(parse_gravity(vector), np.zeros(3))
        return replace(self, model=model)

    def with_inertias(self, parameters: npt.ArrayLike) -> Robot:
        """
        Return the robot with other inertial parameters.

        Parameters
        ----------
        parameters : array_like, shape (10 m,)
            In the order of `rigid_parameters`. They need not be physically consistent, but a
            body without mass must not have a first moment.

        Raises
        ------
        RobotError
            If the shape is wrong, a number is not finite, or a first moment has no mass.

        """
        pi = np.asarray(parameters, dtype=np.float64)
        expected = (PER_LINK * len(self.links),)
        if pi.shape != expected or not np.all(np.isfinite(pi)):
            raise RobotError(
                f'{self.name}: rigid parameters have to be {expected[0]} finite numbers, '
                f'not an array of shape {pi.shape}'
            )
        model, place = self.model.copy(), self.path or self.name
        for body, values in enumerate(pi.reshape(-1, PER_LINK)):
            mass, moment, (ixx, ixy, iyy, ixz, iyz, izz) = values[0], values[1:4], values[4:]
            if abs(mass) >= NO_MASS:  # pinocchio's conversion divides by the mass
                model.inertias[body + 1] = pin.Inertia.FromDynamicParameters(values)
                continue
            if np.abs(moment).max() >= NO_MASS:
                raise RobotError(
                    f"{place}: link '{self.links[body]}' has a first moment, {moment} kg m, but "
                    'no mass; give the link an <inertial> with a rough mass'
                )
            inertia = pin.Inertia.Zero()  # the constructor accepts positive masses only
            inertia.inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
            model.inertias[body + 1] = inertia
        return replace(self, model=model)


@dataclass(frozen=True, eq=False)
class JointGeometry:
    """
    Axis and placement of a joint with one degree of freedom.

    Attributes
    ----------
    parent : int
        Index of the joint that moves the parent link; -1 for the base.
    movers : tuple of int
        Indices of the joints that move the child link, from the base on.
    slide, turn : ndarray, shape (3,)
        Translation and rotation of the child link per unit of the joint position, in the link's
        frame.
    origin, sliding : ndarray, shape (3,)
        Position of the joint on the parent link at zero [m], and its displacement per unit.
    turning : ndarray, shape (3, 3, 3)
        Rotation of the child link on the parent link: this times (1, sin q, 1 - cos q).

    """

    parent: int
    movers: tuple[int, ...]
    slide: FloatArray
    turn: FloatArray
    origin: FloatArray
    sliding: FloatArray
    turning: FloatArray

    @classmethod
    def of(cls, model: pin.Model, number: int) -> JointGeometry:
        """Return the geometry of joint `number` (from 0) of a Pinocchio model."""
        joint, placement = model.joints[number + 1], model.jointPlacements[number + 1]
        data = joint.createData()
        joint.calc(data, np.zeros(joint.nq))
        motion = np.asarray(data.S).ravel()
        cross = pin.skew(motion[3:])
        rotation = np.array(placement.rotation)
        return cls(
            int(model.parents[number + 1]) - 1,
            tuple(int(above) - 1 for above in model.supports[number + 1] if above > 0),
            motion[:3],
            motion[3:],
            np.array(placement.translation),
            rotation @ motion[:3],
            np.stack([rotation, rotation @ cross, rotation @ cross @ cross], axis=2),
        )


def joint_fields(joints: Sequence[Joint]) -> dict[str, Any]:
    """Return names, limits and friction of joints as a dictionary of `Robot` fields."""
    return {
        'joints': tuple(joint.name for joint in joints),
        'lower': np.array([joint.lower for joint in joints]),
        'upper': np.array([joint.upper for joint in joints]),
        'velocity_limit': np.array([joint.velocity for joint in joints]),
        'torque_limit': np.array([joint.effort for joint in joints]),
        'acceleration_limit': np.full(len(joints), np.inf),
        'prismatic': np.array([joint.kind == 'prismatic' for joint in joints]),
        'urdf_damping': np.array([joint.damping for joint in joints]),
        'urdf_friction': np.array([joint.friction for joint in joints]),
    }


def description_name(path: Path) -> str:
    """Return NAME of a description NAME.urdf, NAME.urdf.xacro or NAME.xml."""
    return path.name.removesuffix('.xacro').removesuffix('.urdf').removesuffix('.xml')


def position_range(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Replace infinite position limits, (n,), by +-`UNLIMITED_HALF_RANGE`."""
    return (
        np.where(np.isfinite(lower), lower, -UNLIMITED_HALF_RANGE),
        np.where(np.isfinite(upper), upper, UNLIMITED_HALF_RANGE),
    )


def parse_gravity(value: str | Sequence[float] | FloatArray) -> FloatArray:
    """
    Return the gravity vector (3,) for a name, a string 'x,y,z' or three numbers.

    Parameters
    ----------
    value : str or array_like, shape (3,)
        'earth', 'moon', 'x,y,z' or the vector itself [m/s^2], in the robot's base frame.

    Returns
    -------
    ndarray, shape (3,)
        Acceleration of gravity [m/s^2], read-only.

    Raises
    ------
    RobotError
        If the value is neither a known name nor three finite numbers.

    """
    if isinstance(value, str) and value.strip().lower() in GRAVITIES:
        return read_only(GRAVITIES[value.strip().lower()])
    try:
        numbers = value.split(',') if isinstance(value, str) else value
        vector = np.array([float(number) for number in numbers])
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise RobotError(
            f'gravity {value!r} is neither {" nor ".join(GRAVITIES)} nor three numbers x,y,z '
            f'[m/s^2], such as 0,0,-9.81'
        )
    return read_only(vector)

# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What may have happened to an arm between two days: one cause, drawn at ordinary size."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import ClassVar, Self

import numpy as np
from scipy.spatial.transform import Rotation

from tests.hidden.arrays import FloatArray, Parameter
from tests.hidden.lived.chain import body_vector, Chain
from tests.hidden.lived.motions import Path
from tests.hidden.lived.wear import Wear

_BODY = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
_BODY_UNITS = ('kg', 'kg m', 'kg m', 'kg m') + ('kg m^2',) * 6


@dataclass(frozen=True)
class Scene:
    """
    What a cause is drawn for.

    Attributes
    ----------
    chain : Chain
        True bodies.
    strength, speed : ndarray, shape (n,)
        What torque and speed of each joint go by [N m, rad/s].
    low, high : ndarray, shape (n,)
        Smallest and largest position of the motions of day 2 [rad].
    middle : ndarray, shape (n,)
        Middle of the position limits; zero where there are none [rad].
    end : float
        How long recordings are [s].

    """

    chain: Chain
    strength: FloatArray
    speed: FloatArray
    low: FloatArray
    high: FloatArray
    middle: FloatArray
    end: float

    def joint(self, rng: np.random.Generator, *, loaded: bool = False, first: int = 0) -> int:
        """Pick a joint; of the loaded ones, if asked for."""
        allowed = np.arange(len(self.strength)) >= min(first, len(self.strength) - 1)
        if loaded:
            allowed &= self.strength > 0.1 * self.strength.max()
        chosen = np.flatnonzero(allowed)
        return int(rng.choice(chosen if len(chosen) else [np.argmax(self.strength)]))


class Cause(ABC):
    """One cause with its true parameters; every hook leaves things as they are by default."""

    #: Name in the catalogue, or of something the catalogue does not have.
    name: ClassVar[str]
    #: Whether the catalogue has it.
    in_catalogue: ClassVar[bool] = True
    #: Largest and smallest factor on the drawn size that make sense.
    factors: ClassVar[tuple[float, float]] = (0.02, 30.0)

    joints: tuple[str, ...] = ()

    @classmethod
    @abstractmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        """Draw one of ordinary size."""

    @abstractmethod
    def scaled(self, factor: float) -> Self:
        """Return it larger by a factor."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The true parameters, as the catalogue names them."""

    def bodies(self, chain: Chain) -> Chain:
        """Change the rigid arm or its gravity."""
        return chain

    def wear(self, wear: Wear) -> Wear:
        """Change friction, springs or rotors."""
        return wear

    def truth(self, path: Path) -> Path:
        """Return where the joints are when the encoders say what the path says."""
        return path

    def dry(self, dq: FloatArray) -> FloatArray | float:
        """Return the dry friction that it adds at a speed, shape (N, n) [N m]."""
        return 0.0

    def torque(self, path: Path, chain: Chain) -> FloatArray | float:
        """Return torque that the drives have to give besides, shape (N, n) [N m]."""
        return 0.0

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        """Return the effort that is reported, shape (N, n), for what the drives would report."""
        return tau


@dataclass(frozen=True)
class _JointCause(Cause):
    """A cause in one joint with one value that its size goes by."""

    joint: str
    index: int
    value: float

    @property
    def joints(self) -> tuple[str, ...]:
        return (self.joint,)

    def scaled(self, factor: float) -> Self:
        return replace(self, value=self.value * factor)

    def _column(self, like: FloatArray, values: FloatArray) -> FloatArray:
        torque = np.zeros_like(like)
        torque[:, self.index] = values
        return torque

    def _more(self, wear: Wear, name: str) -> Wear:
        values = getattr(wear, name).copy()
        values[self.index] += self.value
        return replace(wear, **{name: values})


@dataclass(frozen=True)
class _Body(_JointCause):
    """A ball fixed to a link; the value is its mass [kg]."""

    centre: tuple[float, float, float]
    radius: float

    @property
    def body(self) -> FloatArray:
        """Its ten parameters about the frame of the joint."""
        central = 0.4 * self.value * self.radius**2 * np.eye(3)
        return body_vector(self.value, np.array(self.centre), central)

    def bodies(self, chain: Chain) -> Chain:
        return chain.with_body(self.index, self.body)


class Payload(_Body):
    """Something in the hand."""

    name = 'payload'
    factors = (0.01, 20.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = len(scene.strength) - 1
        mass = rng.uniform(0.02, 0.12) * float(scene.chain.bodies[1:, 0].sum())
        centre = rng.normal(size=3)
        centre *= rng.uniform(0.03, 0.15) / np.linalg.norm(centre)
        return cls(scene.chain.joints[j], j, mass, tuple(centre.tolist()), rng.uniform(0.02, 0.06))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f'payload_{name}', self.joint, float(value), unit)
            for name, value, unit in zip(_BODY, self.body, _BODY_UNITS, strict=True)
        )


class Link(_Body):
    """Something mounted on a link in the middle of the arm."""

    name = 'link_inertia'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(1, max(n - 1, 2)))
        centre = rng.normal(size=3)
        centre *= rng.uniform(0.08, 0.2) / np.linalg.norm(centre)
        mass = 0.08 * float(scene.chain.bodies[1:, 0].sum())
        return cls(scene.chain.joints[j], j, mass, tuple(centre.tolist()), rng.uniform(0.03, 0.06))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f'{name}_difference', self.joint, float(value), unit)
            for name, value, unit in zip(_BODY, self.body, _BODY_UNITS, strict=True)
        )


@dataclass(frozen=True)
class Tilt(Cause):
    """The base turned about a horizontal axis, so that gravity as it sees it turns back."""

    name = 'base_tilt'
    factors = (0.02, 5.0)
    tilt: tuple[float, float]

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        turn = np.radians(np.exp(rng.uniform(0.0, np.log(10.0))))
        return cls((turn * np.cos(angle), turn * np.sin(angle)))

    def scaled(self, factor: float) -> Self:
        return replace(self, tilt=(self.tilt[0] * factor, self.tilt[1] * factor))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        x, y = self.tilt
        return Parameter('tilt_x', '', x, 'rad'), Parameter('tilt_y', '', y, 'rad')

    def bodies(self, chain: Chain) -> Chain:
        turn = Rotation.from_rotvec([*self.tilt, 0.0])
        return chain.with_gravity(turn.inv().apply(chain.gravity))


class Wall(Tilt):
    """Another mounting: on a wall, on a slope, under a ceiling."""

    factors = (1.0, 1.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        angle = rng.integers(0, 8) * np.pi / 4.0
        turn = np.radians(float(rng.choice([30.0, 45.0, 60.0, 90.0, 90.0, 90.0, 135.0, 179.0])))
        return cls((turn * np.cos(angle), turn * np.sin(angle)))


class Coulomb(_JointCause):
    """A gear that has become stiff."""

    name = 'coulomb_friction'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        return cls(scene.chain.joints[j], j, 0.15 * scene.strength[j])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('coulomb_torque', self.joint, self.value, 'N m'),)

    def wear(self, wear: Wear) -> Wear:
        return self._more(wear, 'coulomb')


class Viscous(_JointCause):
    """A gear with other grease."""

    name = 'viscous_friction'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        return cls(scene.chain.joints[j], j, 0.15 * scene.strength[j] / scene.speed[j])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('viscous_coefficient', self.joint, self.value, 'N m s/rad'),)

    def wear(self, wear: Wear) -> Wear:
        return self._more(wear, 'viscous')


@dataclass(frozen=True)
class Stribeck(_JointCause):
    """A gear that sticks at low speed."""

    name = 'stribeck_friction'
    velocity: float = 0.1

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        velocity = float(scene.speed[j] * rng.uniform(0.15, 0.5))
        return cls(scene.chain.joints[j], j, 0.2 * scene.strength[j], velocity)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('stribeck_torque', self.joint, self.value, 'N m'),
            Parameter('stribeck_velocity', self.joint, self.velocity, 'rad/s'),
        )

    def dry(self, dq: FloatArray) -> FloatArray:
        return self._column(dq, self.value * np.exp(-((dq[:, self.index] / self.velocity) ** 2)))


class LoadFriction(_JointCause):
    """A gear in which dry friction grows with the load."""

    name = 'load_dependent_friction'
    factors = (0.02, 6.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng, loaded=True)
        return cls(scene.chain.joints[j], j, 0.1)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('load_coefficient', self.joint, self.value, ''),)

    def wear(self, wear: Wear) -> Wear:
        return self._more(wear, 'load_share')


class Rotor(_JointCause):
    """A drive exchanged for one with a heavier rotor."""

    name = 'rotor_inertia'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng, first=1)
        return cls(scene.chain.joints[j], j, 0.05 * scene.strength[j] / scene.speed[j])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('rotor_inertia', self.joint, self.value, 'kg m^2'),)

    def wear(self, wear: Wear) -> Wear:
        return self._more(wear, 'rotor')


class Gain(_JointCause):
    """A torque reading of another scale."""

    name = 'torque_gain'
    factors = (0.05, 6.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng, loaded=True)
        return cls(scene.chain.joints[j], j, float(rng.choice([-1.0, 1.0])) * 0.08)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('gain_error', self.joint, self.value, ''),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self._column(tau, self.value * tau[:, self.index])


class Offset(_JointCause):
    """A torque reading of another zero."""

    name = 'torque_offset'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        return cls(
            scene.chain.joints[j], j, float(rng.choice([-1.0, 1.0])) * 0.1 * scene.strength[j]
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('torque_offset', self.joint, self.value, 'N m'),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self._column(tau, np.full(len(tau), self.value))


@dataclass(frozen=True)
class Delay(Cause):
    """Torques that are older than the positions they come with."""

    name = 'time_delay'
    factors = (0.05, 3.0)
    value: float

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        return cls(0.01)

    def scaled(self, factor: float) -> Self:
        return replace(self, value=self.value * factor)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('delay', '', self.value, 's'),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return np.column_stack([np.interp(t - self.value, t, column) for column in tau.T])


class Encoder(_JointCause):
    """An encoder that reads too little by a constant."""

    name = 'encoder_offset'
    factors = (0.02, 6.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng, loaded=True, first=1)
        return cls(scene.chain.joints[j], j, float(rng.choice([-1.0, 1.0])) * 0.03)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('encoder_offset', self.joint, self.value, 'rad'),)

    def truth(self, path: Path) -> Path:
        q = path.q.copy()
        q[:, self.index] += self.value
        return replace(path, q=q)


@dataclass(frozen=True)
class Spring(_JointCause):
    """A hose or a cable across a joint."""

    name = 'joint_spring'
    rest: float = 0.0

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        low, high = scene.low[j], scene.high[j]
        value = 0.3 * scene.strength[j] / (high - low)
        return cls(scene.chain.joints[j], j, value, float(rng.uniform(low, high)))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('spring_stiffness', self.joint, self.value, 'N m/rad'),
            Parameter('spring_preload', self.joint, -self.value * self.rest, 'N m'),
        )

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        return self._column(path.q, self.value * (path.q[:, self.index] - self.rest))


@dataclass(frozen=True)
class Holding(_JointCause):
    """
    A person who holds a link: a spring and a damper to a fixed place.

    The value is the stiffness [N/m]; forces of the catalogue are those at the middle posture.

    """

    name = 'human_interaction'
    attachment: tuple[float, float, float]
    anchor: tuple[float, float, float]
    middle: tuple[float, float, float]
    damping_time: float = 0.03

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(min(n // 2 + 1, n - 1), n))
        point, anchor, middle = _grip(scene, j, rng)
        return cls(scene.chain.joints[j], j, 0.5 * scene.strength.max(), point, anchor, middle)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        force = self.value * (np.array(self.anchor) - self.middle)
        return (
            Parameter('interaction_stiffness', self.joint, self.value, 'N/m'),
            Parameter('interaction_damping', self.joint, self.value * self.damping_time, 'N s/m'),
            *_forces(self.joint, force),
        )

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        position, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        velocity = np.einsum('jxn,nj->xn', jacobian, path.dq)
        way = position - np.array(self.anchor)[:, np.newaxis] + self.damping_time * velocity
        return np.einsum('jxn,xn->nj', jacobian, self.value * way)


@dataclass(frozen=True)
class Pulling(_JointCause):
    """
    A person, or a balancer's rope, that pulls at a link with a constant force.

    The value is the force [N].

    """

    name = 'human_interaction'
    attachment: tuple[float, float, float]
    direction: tuple[float, float, float]

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(min(n // 2 + 1, n - 1), n))
        point, _, _ = _grip(scene, j, rng)
        along = rng.normal(size=3) * [1.0, 1.0, 0.3]  # not the weight of something
        along /= np.linalg.norm(along)
        return cls(
            scene.chain.joints[j], j, 0.3 * scene.strength.max(), point, tuple(along.tolist())
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return _forces(self.joint, self.value * np.array(self.direction))

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        _, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        return -np.einsum('jxn,x->nj', jacobian, self.value * np.array(self.direction))


@dataclass(frozen=True)
class Knocks(_JointCause):
    """A person who pushes a link now and then, this way and that: in no catalogue."""

    name = 'pushes'
    in_catalogue = False
    attachment: tuple[float, float, float]
    pushes: tuple[tuple[float, float, float, float, float], ...]

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(min(n // 2 + 1, n - 1), n))
        point, _, _ = _grip(scene, j, rng)
        times = np.sort(rng.uniform(0.8, scene.end - 0.8, 9))
        pushes = [
            (float(time), float(rng.uniform(0.15, 0.7)), *rng.normal(size=3).tolist())
            for time in times
        ]
        return cls(scene.chain.joints[j], j, scene.strength.max(), point, tuple(pushes))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('force', self.joint, self.value, 'N'),)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        force = np.zeros((3, len(path.t)))
        for begin, length, *along in self.pushes:
            x = np.clip((path.t - begin) / length, 0.0, 1.0)
            force += np.array(along)[:, np.newaxis] * np.sin(np.pi * x)
        _, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        return -np.einsum('jxn,xn->nj', jacobian, self.value * force)


@dataclass(frozen=True)
class Bumps(_JointCause):
    """Places in a gear that push one way where they are entered, the other way where left."""

    name = 'bumps'
    in_catalogue = False
    places: tuple[float, ...] = ()
    width: float = 0.1

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        low, high = scene.low[j], scene.high[j]
        places = low + (high - low) * rng.uniform(0.15, 0.85, 3)
        return cls(
            scene.chain.joints[j],
            j,
            0.3 * scene.strength[j],
            tuple(places.tolist()),
            0.05 * float(high - low),
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('torque', self.joint, self.value, 'N m'),)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        x = (path.q[:, self.index, np.newaxis] - np.array(self.places)) / self.width
        return self._column(path.q, -self.value * (x * np.exp(-(x**2))).sum(axis=1))


class CubicDrag(_JointCause):
    """Drag that grows with the cube of the speed: in no catalogue."""

    name = 'cubic_drag'
    in_catalogue = False

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        return cls(scene.chain.joints[j], j, 0.1 * scene.strength[j] / scene.speed[j] ** 3)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('cubic_coefficient', self.joint, self.value, 'N m s^3/rad^3'),)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        return self._column(path.q, self.value * path.dq[:, self.index] ** 3)


#: What may have happened, by the word that cases are made of.
CAUSES: Mapping[str, type[Cause]] = MappingProxyType(
    {
        'payload': Payload,
        'link': Link,
        'tilt': Tilt,
        'mounting': Wall,
        'coulomb': Coulomb,
        'viscous': Viscous,
        'stribeck': Stribeck,
        'load_friction': LoadFriction,
        'rotor': Rotor,
        'gain': Gain,
        'offset': Offset,
        'delay': Delay,
        'encoder': Encoder,
        'spring': Spring,
        'holding': Holding,
        'pulling': Pulling,
        'knocks': Knocks,
        'bumps': Bumps,
        'cubic_drag': CubicDrag,
    }
)


def _grip(
    scene: Scene, j: int, rng: np.random.Generator
) -> tuple[tuple[float, float, float], ...]:
    """Return a link's centre of mass, an anchor near where it moves, and its middle place."""
    body = scene.chain.bodies[j]
    point = body[1:4] / body[0]
    postures = rng.uniform(scene.low, scene.high, (40, len(scene.low)))
    places, _ = scene.chain.point(j, point, postures)
    anchor = places.mean(axis=1) + 0.1 * rng.normal(size=3)
    middle, _ = scene.chain.point(j, point, scene.middle[np.newaxis])
    return tuple(point.tolist()), tuple(anchor.tolist()), tuple(middle[:, 0].tolist())


def _forces(joint: str, force: FloatArray) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(f'interaction_force_{axis}', joint, float(value), 'N')
        for axis, value in zip('xyz', force, strict=True)
    )

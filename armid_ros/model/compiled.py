# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Access to the compiled kernel, `kernel.c`, and rigid bodies in its format.

The kernel computes torques and regressors over whole motions, steps of the simulation, and updates
of recursive least squares. It is compiled at installation. Without a compiler, Python and its
libraries compute the same numbers.

"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
import zlib

from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

ADDRESS, REAL, COUNT = ctypes.c_void_p, ctypes.c_double, ctypes.c_int64

_JOINT = np.dtype(
    [
        ('parent', np.int64),
        ('slide', float, 3),
        ('turn', float, 3),
        ('origin', float, 3),
        ('sliding', float, 3),
        ('turning', float, (9, 3)),
        ('mass', float),
        ('first_moment', float, 3),
        ('inertia', float, 9),
    ]
)


class Structure(ctypes.Structure):
    """
    Base class of C structures that the compiled kernel reads.

    Attributes
    ----------
    arrays : tuple of ndarray
        Arrays whose addresses are in the structure; they live as long as the structure.
    address : int
        Address of the structure in memory.

    """

    arrays: tuple[npt.NDArray[Any], ...]

    @property
    def address(self) -> int:
        """Memory address of the structure."""
        return ctypes.addressof(self)


class BodyOfKernel(Structure):
    """Rigid body of n joints, in the data format of the compiled kernel."""

    _fields_ = (
        ('n', COUNT),
        ('gravity', REAL * 3),
        ('joints', ADDRESS),
        ('added_inertia', ADDRESS),
    )

    def along(self, motion: Motion, quantity: str, *arrays: FloatArray) -> None:
        """
        Compute a quantity of the rigid body along a motion, into the last array.

        Parameters
        ----------
        motion : Motion
            N samples of the n joints.
        quantity : str
            'torques', (N, n); 'regressors', (N, n, 10 n); or 'regressor_slopes', (3, N, n), the
            derivatives of sum(weights * regressors) by q, dq and ddq.
        *arrays : ndarray
            Weights (N, n, 10 n) of 'regressor_slopes'; array for the result, with zeros.

        """
        library, states = kernel(), (motion.q, motion.dq, motion.ddq)
        used = [np.ascontiguousarray(x) for x in (*states, *arrays)]
        getattr(library, quantity)(self.address, len(motion), *library.addresses(*used))


@cache
def kernel() -> Any:
    """Load and return the compiled kernel; None without one, or if its source has changed."""
    try:
        module = import_module('armid_ros.model._kernel')
    except ImportError:
        return None
    source = Path(__file__).with_name('kernel.c')
    if getattr(module, 'checksum', None) != zlib.crc32(source.read_bytes()):
        return None
    library = ctypes.CDLL(module.__file__)
    library.advance.restype = COUNT
    library.advance.argtypes = [*3 * [ADDRESS], REAL, COUNT, COUNT, *8 * [ADDRESS]]
    for function in (library.torques, library.regressors):
        function.argtypes = [ADDRESS, COUNT, *4 * [ADDRESS]]
    library.regressor_slopes.argtypes = [ADDRESS, COUNT, *5 * [ADDRESS]]
    library.addresses = module.addresses  # type: ignore[attr-defined]
    library.inertia_matrix.argtypes = 3 * [ADDRESS]
    library.add_rows.restype = REAL
    library.add_rows.argtypes = [COUNT, COUNT, *5 * [ADDRESS]]
    return library


def kernel_body(
    robot: Robot, added_inertia: FloatArray | None = None, weighs: bool = True
) -> BodyOfKernel | None:
    """
    Convert a robot for the compiled kernel; None without kernel, or with too many joints.

    Parameters
    ----------
    robot : Robot
        Robot of n joints without a mechanism.
    added_inertia : ndarray, shape (n, n), optional
        Inertia added to the inertia matrix of the robot [kg m^2]; by default none.
    weighs : bool
        Whether gravity acts on the robot.

    """
    library, n = kernel(), robot.n_joints
    if library is None or n > COUNT.in_dll(library, 'most_joints').value:
        return None
    rows = [
        (
            *(joint.parent, joint.slide, joint.turn, joint.origin, joint.sliding),
            joint.turning.reshape(9, 3),
            *(body.mass, body.mass * body.lever, body.matrix()[3:, 3:].ravel()),
        )
        for joint, body in zip(robot.geometry, robot.model.inertias[1:], strict=True)
    ]
    joints = np.array(rows, _JOINT)
    added = np.zeros((n, n)) if added_inertia is None else np.ascontiguousarray(added_inertia)
    gravity = (REAL * 3)(*(weighs * robot.gravity))
    body = BodyOfKernel(n, gravity, joints.ctypes.data, added.ctypes.data)
    body.arrays = joints, added
    return body

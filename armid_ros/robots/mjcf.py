# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Conversion of a MuJoCo model (MJCF) to a URDF.

MuJoCo itself reads the file, so defaults, includes, frames and inertias from shapes are as in
MuJoCo. A body with several joints becomes one link per joint. The frame of a
link is at its joint.

"""

from __future__ import annotations

from collections.abc import Mapping
import math
from pathlib import Path
import re
from types import ModuleType
from typing import Any
import warnings
from xml.etree import ElementTree

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray
from armid_ros.robots.description import inertia_attributes, text_of
import numpy as np
import pinocchio as pin

#: Pattern of the text before the root element of an MJCF, and of the element's name.
_ROOT = re.compile(r'(?:\s|<\?(?>.*?\?>)|<!--(?>.*?-->))*+<mujoco[\s/>]', re.DOTALL)


def is_mjcf(text: str) -> bool:
    """Return whether a text is in MJCF format: its root element is <mujoco>."""
    return _ROOT.match(text) is not None


def urdf_of_mjcf(path: Path) -> tuple[str, tuple[str, ...]]:
    """
    Convert the arm in an MJCF file to URDF; return the URDF, and notes on omitted parts.

    Parameters
    ----------
    path : Path
        The file; included files and meshes are read too.

    Returns
    -------
    urdf : str
        Links, joints with damping and friction, and shapes.
    notes : tuple of str
        Notes on contents of the file that a URDF cannot express.

    Raises
    ------
    RobotError
        If MuJoCo is not installed or rejects the file, or a joint is a ball joint.

    """
    try:
        import mujoco
    except ImportError:
        raise RobotError(
            f"{path}: an MJCF file needs MuJoCo: pip install 'armid_ros[mujoco]', or pip install "
            'mujoco'
        ) from None
    notes: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter('always')
            model = _compiled(mujoco, path, notes)
        notes += [' '.join(str(warning.message).split()) for warning in warned]
    except (ValueError, RuntimeError, OSError) as error:
        raise RobotError(f'{path}: MuJoCo: {" ".join(str(error).split())}') from None
    urdf = _Writer(mujoco, model, path, notes).urdf()
    ElementTree.indent(urdf)
    return ElementTree.tostring(urdf, encoding='unicode'), tuple(notes)


def _compiled(mujoco: ModuleType, path: Path, notes: list[str]) -> Any:
    """Compile an MJCF file with MuJoCo; textures and missing meshes are left out."""
    spec = mujoco.MjSpec.from_file(str(path))
    folder = Path(spec.modelfiledir) / spec.meshdir
    missing = {
        mesh.name: mesh for mesh in spec.meshes if mesh.file and not (folder / mesh.file).is_file()
    }
    for geom in list(spec.geoms):
        geom.material = ''
        if geom.meshname in missing:
            body, file = geom.parent, missing[geom.meshname].file
            if not body.explicitinertial and geom.mass != 0.0 and geom.density != 0.0:  # noqa: RUF069 - as it is written
                raise RobotError(
                    f"{path}: the inertia of body '{body.name}' is computed from the mesh {file}, "
                    f'which is not in {folder}; add the file, or give the body an <inertial>'
                )
            notes.append(f"link '{body.name}': mesh {file} not found; left out")
            spec.delete(geom)
    for element in (*spec.materials, *spec.textures, *missing.values()):
        spec.delete(element)
    return spec.compile()


class _Writer:
    """Converter of one compiled MuJoCo model to URDF elements."""

    def __init__(self, mujoco: ModuleType, model: Any, path: Path, notes: list[str]) -> None:
        self.mujoco, self.model, self.path, self.notes = mujoco, model, path, notes
        self.root = ElementTree.Element('robot', name=model.names.split(b'\0')[0].decode())
        self.bodies = _names('body', [model.body(k).name for k in range(model.nbody)])
        self.joints = _names('joint', [model.joint(k).name for k in range(model.njnt)])

    def urdf(self) -> ElementTree.Element:
        """Return the root element of a URDF with all bodies that do not float."""
        model, afloat, anchors = self.model, set[int](), {0: np.zeros(3)}
        ElementTree.SubElement(self.root, 'link', name=self.bodies[0])
        self._shapes(self.root[-1], 0, anchors[0])
        for body in range(1, model.nbody):
            joints = range(
                model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]
            )
            free = any(model.jnt_type[j] == self.mujoco.mjtJoint.mjJNT_FREE for j in joints)
            parent = int(model.body_parentid[body])
            if free or model.body_mocapid[body] >= 0 or parent in afloat:
                afloat.add(body)
                self.notes.append(
                    f"body '{self.bodies[body]}' is not fixed to the world; left out"
                )
                if free and any(self.model.body_rootid[k] == body != k for k in model.jnt_bodyid):
                    raise RobotError(
                        f"{self.path}: body '{self.bodies[body]}' floats, but the base of an arm "
                        'is fixed: remove its freejoint'
                    )
                continue
            anchors[body] = self._link(body, parent, list(joints), anchors[parent])
        # notes on elements of MuJoCo that a URDF cannot contain
        model, kinds = self.model, self.mujoco.mjtEq
        if not np.allclose(model.opt.gravity, (0.0, 0.0, -9.81), atol=0.01):
            gravity = ','.join(f'{value:g}' for value in model.opt.gravity)
            self.notes.append(f'gravity {gravity} of the file is not read: --gravity={gravity}')
        open_ = [k for k, kind in enumerate(model.eq_type) if kind != kinds.mjEQ_JOINT]
        open_ = [k for k in open_ if not self._loop(k, anchors)]
        counts = {
            'equalities (connect, weld, tendon)': len(open_),
            'tendons': model.ntendon,
            'bodies with gravcomp': int(np.count_nonzero(model.body_gravcomp)),
            'contact exclusions and pairs': model.nexclude + model.npair,
            'flexible bodies': model.nflex,
        }
        found = ', '.join(f'{count} {what}' for what, count in counts.items() if count)
        if found:
            self.notes.append(f'not read: {found}')
        return self.root

    def _link(
        self, body: int, parent: int, joints: list[int], parent_anchor: FloatArray
    ) -> FloatArray:
        """Write a MuJoCo body and its joints; return the link origin in the body frame [m]."""
        model, name = self.model, self.bodies[body]
        placement = pin.SE3(_rotation(model.body_quat[body]), np.array(model.body_pos[body]))
        placement.translation = placement.translation - parent_anchor
        above, anchor = self.bodies[parent], np.zeros(3)
        for number, joint in enumerate(joints):
            last = number == len(joints) - 1
            child = name if last else f'{name}_{self.joints[joint]}'
            place = np.array(model.jnt_pos[joint])
            self._joint(joint, above, child, placement * pin.SE3(np.eye(3), place - anchor))
            if not last:
                ElementTree.SubElement(self.root, 'link', name=child)
            above, anchor, placement = child, place, pin.SE3.Identity()
        if not joints:
            element = ElementTree.SubElement(
                self.root, 'joint', name=_unused(f'{name}_fixed', self.joints), type='fixed'
            )
            _place(element, above, name, placement)
        link = ElementTree.SubElement(self.root, 'link', name=name)
        if model.body_mass[body] > 0.0:
            axes = _rotation(model.body_iquat[body])
            tensor = axes @ np.diag(model.body_inertia[body]) @ axes.T
            inertial = ElementTree.SubElement(link, 'inertial')
            centre = text_of(model.body_ipos[body] - anchor)
            ElementTree.SubElement(inertial, 'origin', xyz=centre, rpy='0 0 0')
            ElementTree.SubElement(inertial, 'mass', value=text_of(model.body_mass[body]))
            ElementTree.SubElement(inertial, 'inertia', inertia_attributes(tensor))
        self._shapes(link, body, anchor)
        return anchor

    def _joint(self, joint: int, parent: str, child: str, placement: pin.SE3) -> None:
        model, kinds, name = self.model, self.mujoco.mjtJoint, self.joints[joint]
        slides = model.jnt_type[joint] == kinds.mjJNT_SLIDE
        if not slides and model.jnt_type[joint] != kinds.mjJNT_HINGE:
            raise RobotError(
                f"{self.path}: joint '{name}' is a ball joint; only hinges and slides can be used"
            )
        axis, dof = np.array(model.jnt_axis[joint]), int(model.jnt_dofadr[joint])
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        if slides:
            shift = pin.SE3(np.eye(3), -reference * axis)
        else:
            shift = pin.SE3(pin.exp3(-reference * axis), np.zeros(3))
        limited = bool(model.jnt_limited[joint])
        kind = 'prismatic' if slides else 'revolute' if limited else 'continuous'
        element = ElementTree.SubElement(self.root, 'joint', name=name, type=kind)
        _place(element, parent, child, placement * shift)
        ElementTree.SubElement(element, 'axis', xyz=text_of(axis))
        limits: dict[str, str] = {}
        if limited:
            limits |= dict(
                zip(('lower', 'upper'), map(text_of, model.jnt_range[joint]), strict=True)
            )
        effort = self._effort(joint)
        if math.isfinite(effort):
            limits['effort'] = text_of(effort)
        if limits and (limited or not slides):
            ElementTree.SubElement(element, 'limit', limits)
        dynamics = {
            'damping': model.dof_damping[dof],
            'friction': model.dof_frictionloss[dof],
        }
        ElementTree.SubElement(
            element, 'dynamics', {key: text_of(value) for key, value in dynamics.items()}
        )
        self._mimic(element, joint)
        if np.any(model.jnt_stiffness[joint]):
            self.notes.append(f"joint '{name}': its spring (stiffness) is not read")
        if np.any(getattr(model, 'dof_dampingpoly', np.zeros((model.nv, 1)))[dof]):
            self.notes.append(f"joint '{name}': its damping is a polynomial; only its linear term "
                              'is read')  # fmt: skip

    def _effort(self, joint: int) -> float:
        """Return the torque or force limit of a joint or of its actuator [N m or N]."""
        model = self.model
        limits = [math.inf]
        if model.jnt_actfrclimited[joint]:
            limits.append(float(np.abs(model.jnt_actfrcrange[joint]).max()))
        for actuator in range(model.nu):
            kind, target = model.actuator_trntype[actuator], model.actuator_trnid[actuator, 0]
            if kind != self.mujoco.mjtTrn.mjTRN_JOINT or target != joint:
                continue
            gear = abs(float(model.actuator_gear[actuator, 0]))
            if model.actuator_forcelimited[actuator]:
                limits.append(gear * float(np.abs(model.actuator_forcerange[actuator]).max()))
            motor = (
                model.actuator_gaintype[actuator] == self.mujoco.mjtGain.mjGAIN_FIXED
                and model.actuator_biastype[actuator] == self.mujoco.mjtBias.mjBIAS_NONE
                and model.actuator_dyntype[actuator] == self.mujoco.mjtDyn.mjDYN_NONE
            )
            if motor and model.actuator_ctrllimited[actuator]:
                gain = gear * abs(float(model.actuator_gainprm[actuator, 0]))
                limits.append(gain * float(np.abs(model.actuator_ctrlrange[actuator]).max()))
        return min(limits)

    def _mimic(self, element: ElementTree.Element, joint: int) -> None:
        """Write a linear equality constraint between two joints as a <mimic> element."""
        model = self.model
        for number in range(model.neq):
            follows, leader = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            kind = model.eq_type[number]
            if kind != self.mujoco.mjtEq.mjEQ_JOINT or follows != joint or leader < 0:
                continue
            constant, factor, *others = model.eq_data[number, :5]
            if np.any(np.array(others) != 0.0):  # noqa: RUF069 - as it is written
                self.notes.append(f"joint '{self.joints[joint]}': its equality is not linear")
                continue
            zero, zero_of_leader = (model.qpos0[model.jnt_qposadr[j]] for j in (joint, leader))
            offset = constant + zero - factor * zero_of_leader
            values = {'joint': self.joints[leader], 'multiplier': text_of(factor)}
            ElementTree.SubElement(element, 'mimic', values | {'offset': text_of(offset)})

    def _loop(self, equality: int, anchors: Mapping[int, FloatArray]) -> bool:
        """Write a `connect` equality as a closed loop; return False if this is impossible."""
        model, kinds = self.model, self.mujoco.mjtEq
        bodies = [int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])]
        of_bodies = model.eq_objtype[equality] == self.mujoco.mjtObj.mjOBJ_BODY
        if (
            model.eq_type[equality] != kinds.mjEQ_CONNECT
            or not of_bodies
            or not all(body in anchors for body in bodies)
        ):
            return False
        chains = [set[int](), set[int]()]
        for chain, body in zip(chains, bodies, strict=True):
            while body:
                first = int(model.body_jntadr[body])
                chain.update(range(first, first + int(model.body_jntnum[body])))
                body = int(model.body_parentid[body])
        moved = model.actuator_trntype == self.mujoco.mjtTrn.mjTRN_JOINT
        driven = set(model.actuator_trnid[moved, 0].tolist())
        passive = sorted((chains[0] ^ chains[1]) - driven)
        if not driven or not passive:
            return False
        names = ' '.join(self.joints[joint] for joint in passive)
        loop = ElementTree.SubElement(self.root, 'loop', passive=names)
        for body, point in zip(bodies, model.eq_data[equality, :6].reshape(2, 3), strict=True):
            xyz = text_of(point - anchors[body])
            ElementTree.SubElement(loop, 'point', link=self.bodies[body], xyz=xyz)
        return True

    def _shapes(self, link: ElementTree.Element, body: int, anchor: FloatArray) -> None:
        model, kinds = self.model, self.mujoco.mjtGeom
        for geom in np.flatnonzero(np.array(model.geom_bodyid) == body):
            tag = (
                'collision'
                if model.geom_contype[geom] or model.geom_conaffinity[geom]
                else 'visual'
            )
            place = pin.SE3(_rotation(model.geom_quat[geom]), model.geom_pos[geom] - anchor)
            x, y, z = (float(value) for value in model.geom_size[geom])
            kind = kinds(int(model.geom_type[geom]))
            pieces: list[tuple[str, dict[str, str], float]] = []
            if kind in (kinds.mjGEOM_BOX, kinds.mjGEOM_ELLIPSOID):  # bounding box
                pieces = [('box', {'size': text_of([2 * x, 2 * y, 2 * z])}, 0.0)]
            elif kind == kinds.mjGEOM_SPHERE:
                pieces = [('sphere', {'radius': text_of(x)}, 0.0)]
            elif kind in (kinds.mjGEOM_CYLINDER, kinds.mjGEOM_CAPSULE):
                sizes = {'radius': text_of(x), 'length': text_of(2 * y)}
                ends = (y, -y) if kind == kinds.mjGEOM_CAPSULE else ()
                pieces = [
                    ('cylinder', sizes, 0.0),
                    *(('sphere', {'radius': text_of(x)}, end) for end in ends),
                ]
            elif kind == kinds.mjGEOM_MESH:
                mesh = int(model.geom_dataid[geom])
                file = model.paths[model.mesh_pathadr[mesh] :].split(b'\0')[0].decode()
                moved = pin.SE3(_rotation(model.mesh_quat[mesh]), np.array(model.mesh_pos[mesh]))
                place = place * moved.inverse()
                if file and model.mesh_pathadr[mesh] >= 0:
                    scale = text_of(model.mesh_scale[mesh])
                    pieces = [('mesh', {'filename': f'file://{file}', 'scale': scale}, 0.0)]
            for shape, values, along in pieces:
                element = ElementTree.SubElement(link, tag)
                _origin(element, place * pin.SE3(np.eye(3), np.array([0.0, 0.0, along])))
                ElementTree.SubElement(ElementTree.SubElement(element, 'geometry'), shape, values)


def _names(kind: str, given: list[str]) -> list[str]:
    """Return the names of bodies or joints; an empty name becomes kind and number, 'body_3'."""
    return [one or _unused(f'{kind}_{number}', given) for number, one in enumerate(given)]


def _unused(name: str, taken: list[str]) -> str:
    while name in taken:
        name += '_'
    return name


def _place(element: ElementTree.Element, parent: str, child: str, placement: pin.SE3) -> None:
    _origin(element, placement)
    ElementTree.SubElement(element, 'parent', link=parent)
    ElementTree.SubElement(element, 'child', link=child)


def _origin(element: ElementTree.Element, placement: pin.SE3) -> None:
    """Write a placement as <origin> of a URDF element."""
    xyz, rpy = text_of(placement.translation), text_of(pin.rpy.matrixToRpy(placement.rotation))
    ElementTree.SubElement(element, 'origin', xyz=xyz, rpy=rpy)


def _rotation(quaternion: FloatArray) -> FloatArray:
    w, x, y, z = (float(value) for value in quaternion)
    return np.array(pin.Quaternion(w, x, y, z).normalized().toRotationMatrix())

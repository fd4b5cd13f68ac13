# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Learning of the residual of a diagnosis: a map and a formula of few terms for each joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import Diagnosis
from armid_ros.diagnosis.data.evidence import torque_rms
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.diagnose import OPEN
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects.learned import LearnedTorque, TorqueMap
from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import DataTable, Paragraph, SmallMultiples, TableCell
from armid_ros.report.charts import image_data
from armid_ros.report.notation import digits, percent
from armid_ros.report.page import render, Section
from armid_ros.residual.gaussian_process import learn_map
from armid_ros.residual.law import Law, share_of, suggest_law
from armid_ros.residual.rows import BLOCKS, joint_rows, JointRows
from markupsafe import Markup
import numpy as np
import numpy.typing as npt

#: Smallest number of rows of a joint for a map.
_MIN_ROWS = 100


@dataclass(frozen=True)
class JointResidual:
    """
    The learned map of a joint's residual torque, and the formula that approximates it.

    Attributes
    ----------
    joint : str
        The joint.
    learned : TorqueMap
        The map.
    ranges : ndarray, shape (3, 2)
        Smallest and largest position, velocity and load in the data.
    before, after : float
        Root mean square of the residual without and with the map [N m].
    gain : float
        Share of the squared residual that the map predicts in held-out data: blocks left out in
        turn, and samples of held-out recordings near the training data.
    held_out : float or None
        The same share for held-out recordings alone; None if none is near the training data.
    law : Law or None
        Formula of few terms; None if no formula approximates the residual.

    """

    joint: str
    learned: TorqueMap
    ranges: FloatArray
    before: float
    after: float
    gain: float
    held_out: float | None
    law: Law | None

    def axis(self, number: int, count: int) -> FloatArray:
        """Return `count` evenly spaced values of input 0 (position), 1 (velocity) or 2 (load)."""
        return np.linspace(float(self.ranges[number, 0]), float(self.ranges[number, 1]), count)


@dataclass(frozen=True)
class Residual:
    """
    Residual torque that a diagnosis leaves unexplained, learned as a map for each joint.

    Attributes
    ----------
    base : ArmModel
        The model without the maps.
    arm : ArmModel
        The model with them.
    joints : tuple of JointResidual
        Joints whose residual is predictable; the largest residual first.
    table_file : str
        File in the folder of model.yaml, with the maps on a grid of position, velocity and load.

    """

    table_file: ClassVar[str] = 'residual.csv'

    base: ArmModel
    arm: ArmModel
    joints: tuple[JointResidual, ...]

    def sentences(self) -> tuple[str, ...]:
        """Return a sentence for each joint on its learned map and formula."""
        lines = []
        for one in self.joints:
            alone = ''
            if one.held_out is not None:
                alone = f' ({percent(one.held_out)} of held-out recordings)'
                if one.held_out < 0.0:
                    alone = ' (held-out recordings get worse: they leave the training data)'
            like = 'no formula of few terms'
            if one.law is not None:
                like = f'{one.law.text} ({percent(one.law.share)})'
            lines.append(
                f'{one.joint}: a learned map predicts {percent(one.gain)} of the '
                f'residual{alone}; similar formula: {like}'
            )
        return tuple(lines)

    def steps(self) -> list[str]:
        """Return the next step of the user, as a sentence for each joint with a learned map."""
        return [
            f'Inspect gear, cables and stops of {one.joint} where the learned torque is large.'
            if one.law is None
            else f'If {one.law.text} is plausible for {one.joint}, write it as an effect of your '
            'own and diagnose again.'
            for one in self.joints
        ]

    def section(self) -> Section:
        """Return the report section that shows the learned maps at the mid-range load."""
        robot = self.base.robot
        rows, pictures = [], []
        for one in self.joints:
            j = robot.joints.index(one.joint)
            unit, length = robot.torque_units[j], robot.position_units[j]
            held_out = '' if one.held_out is None else percent(one.held_out)
            if one.held_out is not None and one.held_out < 0.0:
                held_out = 'worse'
            rows.append(
                (
                    one.joint,
                    f'{digits(one.before)} {unit}',
                    f'{digits(one.after)} {unit}',
                    percent(one.gain),
                    held_out,
                    TableCell('no simple formula' if one.law is None else one.law.text, 'law'),
                    '' if one.law is None else percent(one.law.share),
                )
            )
            pictures += _pictures(one, unit, length)
        heads = (
            'Joint',
            'Residual, rms',
            'With the map',
            'Share, map',
            'Held-out alone',
            'Looks like',
            'Share, formula',
        )
        return Section(
            'Learned residual',
            [
                Paragraph(
                    'No effect of the catalogue explains the residual of these joints. A Gaussian '
                    'process over position, velocity and load predicts it. model.yaml has this '
                    f'map as an effect, {self.table_file} as a table. The map is zero where there '
                    'were no data. Shares are of the squared residual in cross-validation, and in '
                    'held-out recordings close to the data.'
                ),
                DataTable(heads, rows, (0, 5)),
                Paragraph(
                    'q: position, dq: velocity, w: gravity torque. A formula is a suggestion: '
                    'write it as an effect of your own if it is plausible, and diagnose again.',
                    'hint',
                ),
                SmallMultiples(pictures),
            ],
        )

    def table(self) -> list[tuple[str, ...]]:
        """
        Return the learned maps as a table of torques on a grid over the recorded range.

        Returns
        -------
        list of tuple of str
            Heads, then joint, position, velocity, load, torque and its standard deviation; the
            load is empty if the map does not depend on load. Position varies slowest.

        """
        rows: list[tuple[str, ...]] = [('joint', 'position', 'velocity', 'load', 'torque', 'std')]
        for one in self.joints:
            # points along position, velocity and load
            axes = [one.axis(number, count) for number, count in enumerate((41, 31, 9))]
            loaded = one.learned.takes_load
            if not loaded:
                axes[2] = np.zeros(1)
            inputs = np.array(list(product(*axes)))
            torque, std = one.learned.torque(inputs), one.learned.std(inputs)
            rows += [
                (
                    one.joint,
                    *(f'{x:.6g}' for x in (q, dq)),
                    f'{w:.6g}' if loaded else '',
                    f'{tau:.6g}',
                    f'{s:.4g}',
                )
                for (q, dq, w), tau, s in zip(inputs, torque, std, strict=True)
            ]
        return rows

    def document(self) -> dict[str, Any]:
        """Return the maps and formulas as the entry `residual` of diagnosis.json."""
        return {
            'method': 'gp',
            'table': self.table_file,
            'joints': [
                {
                    'joint': one.joint,
                    'rms_before': one.before,
                    'rms_after': one.after,
                    'gain': one.gain,
                    'held_out_gain': one.held_out,
                    'amplitude': float(one.learned.amplitude),
                    'length_scales': [
                        float(x) if np.isfinite(x) else None for x in one.learned.lengths
                    ],
                    'law': None if one.law is None else one.law.document(),
                }
                for one in self.joints
            ],
        }


def require_libraries() -> None:
    """Raise IdentificationError if scikit-learn is not installed."""
    try:
        import sklearn  # noqa: F401 - is it there?
    except ImportError:
        raise IdentificationError(
            'learning a residual needs scikit-learn, which is not installed: '
            "pip install 'armid_ros[residual]'"
        ) from None


def learn_residual(diagnosis: Diagnosis, rng: np.random.Generator) -> Residual | None:
    """
    Learn maps of the residual torque that a diagnosis leaves unexplained.

    The residual is that of the patched model. If the diagnosis has no findings, it is that of the
    diagnosed model, whose rigid body is refitted if the diagnosis did so.

    Parameters
    ----------
    diagnosis : Diagnosis
        Its verdict, model and data.
    rng : numpy.random.Generator
        Random numbers for the initial cells.

    Returns
    -------
    Residual or None
        None if the findings explain the residual, or if no map predicts held-out data.

    Raises
    ------
    IdentificationError
        If a library is not installed.

    """
    require_libraries()
    if diagnosis.verdict not in OPEN or diagnosis.explanation is None:
        return None
    base = diagnosis.arm if diagnosis.findings else diagnosis.explanation.fitted.arm
    gap = diagnosis.gap
    validation: Sequence[Trajectory] = ()
    if gap is not None and gap.predicted:
        validation = [overlay.trajectory for overlay in gap.overlays]
    every = joint_rows(base, diagnosis.data)
    unseen = joint_rows(base, validation) if validation else [None] * len(every)
    # a system has only a hundred rows, so two threads would mostly wait
    import sklearn.linear_model  # noqa: F401 - so that its threads are limited as well
    from threadpoolctl import threadpool_limits

    material = DiagnosisSettings.material * torque_rms(diagnosis.data)
    with threadpool_limits(1):
        learned = [
            _learned(joint, rows, other, least, base, rng)
            for joint, rows, other, least in zip(
                base.robot.joints, every, unseen, material, strict=True
            )
        ]
    found = [one for one in learned if one is not None]
    if not found:
        return None
    found.sort(key=lambda one: -one.before)
    order = sorted(found, key=lambda one: base.robot.joints.index(one.joint))
    joints, maps = zip(*((one.joint, one.learned) for one in order), strict=True)
    arm = base.with_effect(LearnedTorque(joints, maps=maps), np.ones(len(order)))
    return Residual(base, arm, tuple(found))


def _learned(
    joint: str,
    rows: JointRows,
    unseen: JointRows | None,
    material: float,
    base: ArmModel,
    rng: np.random.Generator,
) -> JointResidual | None:
    """
    Learn a map of a joint's residual torque; None if the map predicts held-out data poorly.

    The map is None if it does not predict held-out blocks beyond chance. It is also None if its
    torque is below a material torque [N m] and it predicts no held-out recording.

    """
    if len(rows) < _MIN_ROWS:
        return None
    learned, predicted = learn_map(rows, rng)
    # a map must reduce the error of held-out blocks, even without the best block
    saved = rows.residual**2 - (rows.residual - predicted) ** 2
    blocks = np.bincount(rows.block, saved, BLOCKS)
    if not blocks.sum() - blocks.max() > 0.0:
        return None
    parts = [(rows.residual, predicted)]
    near = None if unseen is None else unseen.select(near_data(learned, unseen))
    if near is not None and len(near) >= _MIN_ROWS:
        parts.append((near.residual, learned.torque(near.inputs)))
    residual, torque = (np.concatenate(one) for one in zip(*parts, strict=True))
    gain = share_of(residual, torque)
    held_out = share_of(*parts[1]) if len(parts) > 1 else None
    is_material = float(np.sqrt(np.mean(torque**2))) >= material
    if gain <= 0.0 or not (is_material or (held_out or 0.0) > 0.0):
        return None
    prismatic = bool(base.robot.prismatic[base.robot.joints.index(joint)])
    return JointResidual(
        joint,
        learned,
        np.array([rows.inputs.min(axis=0), rows.inputs.max(axis=0)]).T,
        float(np.sqrt(np.mean(residual**2))),
        float(np.sqrt(np.mean((residual - torque) ** 2))),
        gain,
        held_out,
        suggest_law(rows, prismatic),
    )


def near_data(learned: TorqueMap, rows: JointRows) -> npt.NDArray[np.bool_]:
    """Return a mask (N,) of the samples that are near the training data of a map."""
    # a map is informative where its standard deviation is less than half of that of the prior
    return np.asarray(learned.std(rows.inputs) < 0.5 * learned.amplitude)


def _pictures(one: JointResidual, unit: str, length: str) -> list[tuple[str, str, Markup, str]]:
    """Return two images of a map at the mid-range load: torque, and standard deviation."""
    # cells along position and velocity
    q, dq = (one.axis(number, count) for number, count in enumerate((80, 60)))
    load = np.full((len(dq), len(q)), one.ranges[2].mean())
    inputs = np.stack([*np.meshgrid(q, dq[::-1]), load], axis=-1)
    torque, std = one.learned.torque(inputs), one.learned.std(inputs)
    peak = max(float(np.abs(torque).max()), 1e-12)
    row, column = np.unravel_index(np.argmax(np.abs(torque)), torque.shape)
    most = f'most at {digits(q[column])} {length} and {digits(dq[::-1][row])} {length}/s'
    blue, orange = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0)
    colours = np.where((torque >= 0.0)[..., None], blue, orange)
    unsure = f'{digits(one.learned.amplitude)} {unit}'
    ends = {
        **{name: f'{digits(x)} {length}' for name, x in (('left', q[0]), ('right', q[-1]))},
        **{name: f'{digits(x)} {length}/s' for name, x in (('low', dq[0]), ('high', dq[-1]))},
    }
    maps = (
        (
            f'{one.joint}: torque, blue up to {digits(peak)} {unit}, orange down to '
            f'-{digits(peak)} {unit}',
            image_data(colours, torque / peak),
            f'Learned torque of {one.joint} over position and velocity, {most}',
        ),
        (
            f'{one.joint}: standard deviation (shaded: large; {unsure} far from data)',
            image_data(np.broadcast_to(0.5, (*std.shape, 3)), std / one.learned.amplitude),
            'Standard deviation of that torque',
        ),
    )
    return [
        (caption, '', render('heat_map.html', {'image': image, 'words': words, **ends}), 'heat')
        for caption, image, words in maps
    ]

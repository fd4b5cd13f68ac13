# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Descriptions and prior knowledge of the shipped effects, in one table.

The classes of effects contain the equations of the torque. This table contains texts, frequency of
occurrence, and the URDF attributes of the quantities.

"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Traits:
    """
    Descriptions and prior knowledge of an effect class, in addition to its equations.

    Attributes
    ----------
    shown_by : str
        Description of the experiment that identifies the effect best.
    look_at : str
        Part of the robot to inspect before the next recording.
    sign : str
        Meaning of a positive value, if the name is not clear.
    weighs : bool
        Whether the effect is a carried load, described by its mass (the first quantity) and its
        position. A load may be picked up or put down at any time.
    usual : bool
        Whether the effect is fitted by default, because nearly every joint has it.
    friction : bool
        Whether the effect is friction; all friction of a joint may change together.
    external : bool
        Whether the cause is outside the arm, such as a person or another machine.
    corrects : bool
        Whether the effect is an error of the description, not a change of the arm.
    rests : bool
        Whether the effect has no torque in a part of the motion, as a strap while it is slack. A
        strap that is always taut is a spring.
    nuisance : tuple of tuple of float
        Shapes of the effect as a nuisance parameter, if it was not requested; () if never.
    measured_as : str
        Effect that explains the same by a measured signal, where it was measured; '' if none.
    separate : tuple of tuple of int
        Groups of quantities that are separate causes; empty if all quantities are one cause.
    urdf_attribute, mjcf_attribute : str
        Attribute of a joint in URDF and in MJCF that contains the quantity; '' if none.

    """

    shown_by: str = 'faster motion'
    look_at: str = ''
    sign: str = ''
    weighs: bool = False
    usual: bool = False
    friction: bool = False
    external: bool = False
    corrects: bool = False
    rests: bool = False
    nuisance: tuple[tuple[float, ...], ...] = ()
    measured_as: str = ''
    separate: tuple[tuple[int, ...], ...] = ()
    urdf_attribute: str = ''
    mjcf_attribute: str = ''


#: Traits of the shipped effects by name; other effects define the attribute ``traits``.
TRAITS = {
    'encoder_offset': Traits(
        shown_by='hard stops, or a payload at two poses',
        look_at='the zero of the encoder, at a mark or a stop of the joint',
        sign='position is reading plus offset',
    ),
    'joint_elasticity': Traits(
        shown_by='a sweep of frequency through the resonance',
        look_at='the belt, the gear, and the screws of its flanges',
    ),
    'backlash': Traits(
        shown_by='slow reversals with the load pulling and pushing',
        look_at='the play of the gear, by moving the link by hand while the motor holds',
    ),
    'actuator_saturation': Traits(
        shown_by='the same motion at rising amplitudes',
        look_at='the limits of current and torque in the settings of the drive',
        separate=((0,), (1,)),
    ),
    'torque_crosstalk': Traits(
        shown_by='one joint loaded while the other joint stands still',
        look_at='the mounting of the torque sensors, and their cables',
    ),
    'torque_gain': Traits(
        shown_by='the same motion with and without a known payload',
        look_at='the scale of the torque in the driver, of the sensor or of the motor constant',
        sign='readings are 1 + error times the torque',
    ),
    'torque_drift': Traits(
        shown_by='the same static hold, repeated for half an hour',
        look_at='the temperature of the torque sensor, and the time at which its zero was set',
    ),
    'time_delay': Traits(
        shown_by='the same motion at two speeds, and a sweep of frequency',
        look_at='the timestamps of positions and torques in the driver',
    ),
    'torque_lag': Traits(
        shown_by='a sweep of frequency up to half of the bandwidth',
        look_at='the filter of the torque in the driver or the sensor',
    ),
    'rotor_inertia': Traits(
        shown_by='fast motion of the joint in two postures of the arm',
        look_at='the motor and the gear, which may be of another type than described',
        mjcf_attribute='armature',
    ),
    'torque_ripple': Traits(
        shown_by='slow constant velocity at three speeds',
        look_at='the gear and the motor, for a worn tooth, a bent shaft or weak magnets',
    ),
    'viscous_friction': Traits(
        shown_by='constant velocities, slow to fast, in both directions',
        look_at='the grease, its temperature, the seals and the bearings',
        usual=True,
        nuisance=((),),
        friction=True,
        urdf_attribute='damping',
        mjcf_attribute='damping',
    ),
    'coulomb_friction': Traits(
        shown_by='slow constant velocity in both directions',
        look_at='the brake, the seals and the bearings, by moving the joint by hand',
        usual=True,
        nuisance=((),),
        friction=True,
        urdf_attribute='friction',
        mjcf_attribute='frictionloss',
    ),
    'asymmetric_friction': Traits(
        shown_by='static holds and slow motion in both directions',
        look_at='the brake, the gear, and cables that pull one way',
        friction=True,
    ),
    'quadratic_friction': Traits(
        shown_by='constant velocities up to the limit',
        look_at='parts that move through air, oil or grease',
        friction=True,
    ),
    'stribeck_friction': Traits(
        shown_by='constant velocities from 0.01 to 1 rad/s in both directions',
        look_at='the kind, the age and the temperature of the grease',
        nuisance=((0.03, 2.0), (0.1, 2.0), (0.3, 2.0)),
        friction=True,
    ),
    'thermal_friction': Traits(
        shown_by='the same motion cold and after half an hour of work',
        look_at='the temperature of the gear, and the time of work before the recording',
        friction=True,
        measured_as='temperature_dependent_friction',
    ),
    'temperature_dependent_friction': Traits(
        shown_by='the same motion cold and warm, with the temperature of each joint',
        look_at='the time of work before the recording, the temperature of the hall, the cooling',
        sign='friction per kelvin above the reference temperature',
        friction=True,
    ),
    'gravity_magnitude': Traits(
        shown_by='fast motion and static holds',
        look_at='the gravity in the settings, and the scale of all torques',
        corrects=True,
    ),
    'base_tilt': Traits(
        shown_by='static holds with the first joint turned around',
        look_at='the mounting of the base, with a spirit level',
    ),
    'load_dependent_friction': Traits(
        shown_by='the same motion with and without a known payload',
        look_at='the wear, the grease and the alignment of the gear',
        nuisance=((),),
        friction=True,
    ),
    'presliding_hysteresis': Traits(
        shown_by='triangles of less than 0.02 rad at two rates',
        look_at='the seals, the bearings and their preload',
    ),
    'human_interaction': Traits(
        shown_by='the same motion with the contact released',
        look_at='whether a person, a table or a fixture touches the arm',
        external=True,
    ),
    'interface_slack': Traits(
        shown_by='the same motion at two tensions of the strap',
        look_at='the strap, cable, table or fixture that may hold the arm, and its tightness',
        external=True,
        rests=True,
    ),
    'payload': Traits(
        shown_by='the same motion with the tool taken off',
        look_at='the hand, the gripper, the tool, a part or a cable that the arm carries',
        weighs=True,
    ),
    'link_inertia': Traits(
        shown_by='fast motion and static holds',
        look_at='the link and the parts bolted to it; see armid check ROBOT BAG',
        corrects=True,
    ),
    'coupled_joint_friction': Traits(
        shown_by='motion of one joint of the pair at a time',
        look_at='the gear, belt or tendon that the two joints share',
        friction=True,
    ),
    'joint_coupling': Traits(
        shown_by='static holds of one joint of the pair at many positions of the other',
        look_at='cables, hoses and tendons that run along both joints',
    ),
    'torque_offset': Traits(
        shown_by='static holds over the range of positions',
        look_at='the zero of the torque sensor, with the joint unloaded',
        usual=True,
    ),
    'joint_spring': Traits(
        shown_by='static holds over the range, with and without a payload',
        look_at='cables, hoses and springs along the joint',
    ),
    'soft_limit': Traits(
        shown_by='slow motion into and out of the end of the range',
        look_at='the stops, and parts that the joint touches near them',
        separate=((0,), (1,)),
    ),
}

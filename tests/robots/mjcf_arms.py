# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Arms as people write them in MJCF, each with other means that the conversion has to follow.

Defaults, frames, sequences of angles and copies are those of MuJoCo, which reads the file.

"""

DIAG = 'diaginertia="0.02 0.03 0.01"'

ARMS = {
    'defaults of defaults': f"""<mujoco model="six"><compiler angle="radian" autolimits="true"/>
<default><default class="six"><joint axis="0 1 0" range="-3 3" armature="0.1"/>
<default class="wrist"><joint range="-6.2 6.2" armature="0.02" damping="0.5"/></default></default>
</default><worldbody><body name="base" quat="0 0 0 -1" childclass="six"><inertial mass="4"
pos="0 0 0" {DIAG}/><body name="a" pos="0 0 0.163"><inertial mass="3.7" pos="0 0 0.01"
quat="0.5 0.5 -0.5 0.5" {DIAG}/><joint name="pan" axis="0 0 1"/><body name="b" pos="0 0.138 0"
quat="1 0 1 0"><inertial mass="8.4" pos="0 0 0.21" {DIAG}/><joint name="lift"/><body name="c"
pos="0 -0.13 0.425"><inertial mass="2.3" pos="0.01 0 0.2" {DIAG}/><joint name="elbow"/>
<body name="d"
pos="0 0 0.392" quat="1 0 1 0"><inertial mass="1.2" pos="0 0.12 0" {DIAG}/><joint name="w1"
class="wrist"/><body name="e" pos="0 0.127 0"><inertial mass="1.2" pos="0 0 0.1" {DIAG}/><joint
name="w2" axis="0 0 1" class="wrist"/><body name="f" pos="0 0 0.1"><inertial mass="0.2"
pos="0 0.09
0" quat="0.7 0.7 0.1 0" {DIAG}/><joint name="w3" class="wrist"/></body></body></body></body>
</body>
</body></body></worldbody></mujoco>""",
    'inertia of shapes': """<mujoco><worldbody><body name="a"><joint name="j1" axis="0 0 1"/>
<geom type="box" size="0.1 0.05 0.2" pos="0 0.1 0.2" euler="10 20 30" mass="3"/><geom
type="capsule" fromto="0 0 0 0.2 0.1 0.3" size="0.04" density="2700"/><body name="b"
pos="0.2 0.1 0.3"><joint name="j2" axis="0 1 0"/><geom type="cylinder" size="0.05 0.2"
xyaxes="0 1 0 0 0 1"/><geom type="ellipsoid" size="0.1 0.2 0.3" zaxis="1 1 1" density="300"/>
<body name="c" pos="0 0 0.4"><joint name="j3" axis="1 0 0"/><geom type="sphere" size="0.07"
pos="0 0 0.1"/></body></body></body></worldbody></mujoco>""",
    'full inertia': """<mujoco><compiler angle="radian"/><worldbody><body name="a">
<joint name="j1"
axis="0 1 0" damping="1.5" frictionloss="0.7"/><inertial mass="4.97" pos="0.0039 0.0021 -0.0476"
fullinertia="0.70337 0.70661 0.0091170 -0.000139 0.0067720 0.019169"/><body name="b" pos="0 0 0.3"
quat="1 -1 0 0"><joint name="j2" damping="0.4"/><inertial mass="0.65" pos="-0.003 -0.029 0.0035"
fullinertia="0.0379620 0.028104 0.036155 -0.0039250 0.010254 0.00070400"/></body></body>
</worldbody></mujoco>""",
    'several joints in a body': f"""<mujoco><worldbody><body name="a" pos="0 0 1"><joint name="x"
type="slide" axis="1 0 0" ref="0.2"/><joint name="yaw" axis="0 0 1" pos="0.1 0 0" ref="40"/><joint
name="pitch" axis="0 1 0" pos="0 0.2 0.1"/><inertial mass="3" pos="0.1 0.2 0.3" {DIAG}/>
<body name="b"
pos="0.5 0 0"><joint name="roll" axis="1 0 0" pos="0 0 -0.1"/><geom type="box"
size="0.1 0.2 0.3"/>
</body></body></worldbody></mujoco>""",
    'a gripper with an equality': f"""<mujoco><worldbody><body name="a"><joint name="j1"
axis="0 1 0"/><inertial mass="3" pos="0 0 0.2" {DIAG}/><body name="hand" pos="0 0 0.4"
euler="0 0 -45">
<inertial mass="0.7" pos="0 0 0.03" {DIAG}/><body name="left"><joint name="finger_joint1"
type="slide"
axis="0 1 0" range="0 0.04"/><geom type="box" size="0.01 0.02 0.02" pos="0 0.01 0.06"/></body>
<body
name="right" quat="0 0 0 1"><joint name="finger_joint2" type="slide" axis="0 1 0" range="0 0.04"/>
<geom type="box" size="0.01 0.02 0.02" pos="0 0.01 0.06"/></body></body></body></worldbody>
<equality><joint joint1="finger_joint2" joint2="finger_joint1"/></equality></mujoco>""",
    'without names': f"""<mujoco><worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 1"/>
<body pos="0 0 0.5"><body euler="90 0 0"><joint axis="0 0 1"/>
<inertial mass="1" pos="0.2 0 0" {DIAG}/><body pos="0.4 0 0"><joint axis="0 0 1"/>
<inertial mass="1" pos="0.2 0.1 0" {DIAG}/></body></body>
</body><body name="cube" pos="1 0 0"><freejoint/><geom size="0.1"/></body></worldbody>
</mujoco>""",
}

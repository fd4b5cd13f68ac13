# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # First model
#
# This notebook leads from a URDF to a model with uncertainties. `arm.urdf` describes a small arm
# of three joints; any other URDF works as well.

# %%
import armid_ros as ar
import matplotlib.pyplot as plt

URDF = '../arm.urdf'
print(ar.load_robot(URDF).joints)

# %% [markdown]
# ## Design a motion
#
# The designed motion stays inside the limits of the URDF, and makes the parameters identifiable.
# The table shows the share of each limit that the motion uses.

# %%
plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
plan

# %%
motion = plan.motion(100.0)
figure, axes = plt.subplots(figsize=(8, 3))
axes.plot(motion.t, motion.q, label=motion.joints)
axes.set(xlabel='time [s]', ylabel='position [rad]')
axes.legend(ncols=3)
figure.tight_layout()

# %% [markdown]
# ## Two recordings
#
# On a robot you would run the trajectory that `plan.save('plan')` writes, and record
# `/joint_states`. Here a simulated arm takes the place of the robot. The simulated arm has
# friction that the URDF lacks.

# %%
friction = ['viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2']
robot = ar.ArmModel.of(URDF, effects=friction)
monday, tuesday = (ar.simulate(robot, plan, torque_noise=0.05, rng=day) for day in (1, 2))
monday

# %% [markdown]
# ## The model
#
# The model is fitted to one recording and predicts the torques of the other. The grade judges the
# predicted torques.

# %%
model = ar.identify(URDF, monday, validate=tuesday)
model

# %% [markdown]
# The true friction of every joint is 0.3 N m s/rad (viscous) and 0.2 N m (Coulomb).

# %%
table = model.to_dataframe()
table[table.name.isin(['viscous_coefficient', 'coulomb_torque'])]

# %% [markdown]
# Measured torque, predicted torque and residual of the elbow:

# %%
(fit,) = model.predict(tuesday)
elbow = fit.motion.joints.index('elbow')
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(8, 4))
above.plot(fit.motion.t, fit.motion.tau[:, elbow], label='measured')
above.plot(fit.motion.t, fit.predicted[:, elbow], '--', label='predicted')
above.set(ylabel='torque [N m]')
above.legend()
below.plot(fit.motion.t, fit.residual[:, elbow])
below.set(xlabel='time [s]', ylabel='residual [N m]')
figure.tight_layout()

# %% [markdown]
# `model.save('model')` writes `model.yaml`, `identification.json` and an HTML report.

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
# # Trusting the numbers
#
# A standard deviation is a claim: a repeat of the experiment lands within it two times in three.
# Here the experiment is repeated, and the claim is counted.

# %%
import armid_ros as ar
import matplotlib.pyplot as plt
import numpy as np

URDF = '../arm.urdf'
friction = ['viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2']
truth = ar.ArmModel.of(URDF, effects=friction)
plan = ar.design_excitation(truth, duration=12.0, starts=1, iterations=10)
models = [
    ar.identify(URDF, ar.simulate(truth, plan, torque_noise=0.05, rng=seed)) for seed in range(20)
]
models[0]

# %% [markdown]
# ## Do the intervals hold the truth?
#
# Viscous friction of the elbow, 20 times, with 95 % intervals. One of twenty may miss.

# %%
k = models[0].estimate.index('viscous_coefficient', 'elbow')
values = np.array([model.estimate.values[k] for model in models])
std = np.array([model.estimate.std[k] for model in models])
figure, axes = plt.subplots(figsize=(8, 3))
axes.errorbar(range(len(models)), values, 1.96 * std, fmt='o', capsize=3)
axes.axhline(0.3, color='black', linewidth=1)
axes.set(xlabel='repeat', ylabel='viscous coefficient [N m s/rad]')
figure.tight_layout()
print(f'scatter {values.std(ddof=1):.5f}, stated {std.mean():.5f}')

# %% [markdown]
# All friction of all joints, all repeats:

# %%
names = models[0].estimate.parameters
true = {'viscous_coefficient': 0.3, 'coulomb_torque': 0.2, 'torque_offset': 0.0}
inside = [
    abs(model.estimate.values[k] - true[name.name]) < 1.96 * model.estimate.std[k]
    for model in models
    for k, name in enumerate(names)
    if name.name in true
]
print(f'{100 * np.mean(inside):.0f} % of {len(inside)} intervals of 95 % hold the truth')

# %% [markdown]
# ## When the claim is void
#
# The claim takes the model as right. Leave out the Coulomb friction, which is there, and the
# intervals of the viscous friction miss by far. The residual shows it: it goes with the direction
# of motion.

# %%
recording = ar.simulate(truth, plan, torque_noise=0.05, rng=99)
wrong = ar.identify(URDF, recording, effects='viscous_friction')
k = wrong.estimate.index('viscous_coefficient', 'elbow')
print(f'{wrong.estimate.values[k]:.3f} ± {wrong.estimate.std[k]:.3f} N m s/rad, true 0.3')

# %%
(fit,) = wrong.predict(recording)
figure, axes = plt.subplots(figsize=(8, 3))
axes.plot(fit.motion.dq[:, 2], fit.residual[:, 2], '.', markersize=2)
axes.set(xlabel='velocity of the elbow [rad/s]', ylabel='residual [N m]')
figure.tight_layout()

# %% [markdown]
# ## What to look at
#
# The held-out error and the grade come first; a model that predicts is worth asking about its
# parameters.

# %%
print(wrong.grade, models[0].grade)
print(ar.diagnose(wrong.arm, recording))

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
# A standard deviation is a claim: in two of three repeats of an experiment, the estimate lies
# within one standard deviation of the truth. This notebook repeats an experiment and tests the
# claim.

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
# ## Do the intervals contain the truth?
#
# The plot shows the viscous friction of the elbow in 20 repeats, with 95 % intervals. One interval
# in twenty may miss the truth.

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
# The same for all friction parameters of all joints:

# %%
names = models[0].estimate.parameters
true = {'viscous_coefficient': 0.3, 'coulomb_torque': 0.2, 'torque_offset': 0.0}
inside = [
    abs(model.estimate.values[k] - true[name.name]) < 1.96 * model.estimate.std[k]
    for model in models
    for k, name in enumerate(names)
    if name.name in true
]
print(f'{100 * np.mean(inside):.0f} % of {len(inside)} 95 % intervals contain the truth')

# %% [markdown]
# ## When the claim is wrong
#
# Intervals assume that the model lacks no effect. Without the Coulomb friction of the arm, the
# intervals of the viscous friction miss the truth by far. The residual depends on
# the direction of motion, which shows the missing effect.

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
# ## What to check first
#
# Check the grade and the held-out error first. Trust the parameters of a model only if the model
# predicts well.

# %%
print(wrong.grade, models[0].grade)
print(ar.diagnose(wrong.arm, recording))

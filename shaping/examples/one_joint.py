"""Compare three ways of shaping by the vibration of a flexible shoulder that turns a stretching arm."""

import numpy as np

from tvist_shaping import Fixed, FlexibleJoint, TvistFilter, shaper

K, D, H = 420.0, 1.05, 0.0002  # spring [N m/rad] and damper [N m s/rad] of the shoulder, period [s]
START, END = np.radians([70.0, 150.0]), np.radians([0.0, 30.0])  # shoulder and elbow


def inertia(q):  # about the shoulder; the elbow, q[1], changes it [kg m²]
    return 0.27 + 0.18 * np.cos(q[1])


def vibration(estimator, name):
    """Largest deflection later than 150 ms after the unshaped motion [mrad]; motors follow exactly."""
    u = np.clip(np.arange(0.0, 2.2, H) / 1.3, 0.0, 1.0)  # constant acceleration, then constant deceleration
    reference = START + np.where(u < 0.5, 2 * u**2, 1 - 2 * (1 - u) ** 2)[:, None] * (END - START)
    tvist = TvistFilter(shaper(name), estimator, joints=2, period=H)
    tvist.reset(START)
    q = np.array([tvist.filter(sample) for sample in reference])
    theta, momentum, deflection = START[0], 0.0, np.zeros(len(q))
    for i, (motor, elbow) in enumerate(np.gradient(q, H, axis=0)):
        # The momentum about the shoulder p = I θ' + M q₂' changes by the joint's torque alone.
        speed = (momentum - (0.13 + 0.09 * np.cos(q[i, 1])) * elbow) / inertia(q[i])
        momentum -= H * (K * (theta - q[i, 0]) + D * (speed - motor))
        theta, deflection[i] = theta + H * speed, theta - q[i, 0]
    return 1e3 * np.abs(deflection[round(1.45 / H) :]).max()


arm = FlexibleJoint(inertia, (0.09, 0.45), K, D)
middle = Fixed(*arm.estimate([0.0, np.radians(90.0)]))
ways = {"unshaped": (arm, "none"), "ZV for 90°": (middle, "zv"), "TVIST": (arm, "zv")}
left = {name: vibration(*way) for name, way in ways.items()}
for name, amplitude in left.items():
    print(f"{name:10} {amplitude:6.3f} mrad, {100.0 * amplitude / left['unshaped']:5.1f} %")

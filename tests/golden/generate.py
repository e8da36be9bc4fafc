#!/usr/bin/env python3
"""Golden values of the youBot's arm, from Pinocchio (`pip install pin`): writes youbot.json beside this file.

The model is built here from the same numbers as src/libraries/youbot/parameters.rs (candle zero, URDF axes), joint by
joint. Two models: the arm on a fixed base, and the arm on a planar joint, whose accelerations the fixed arm must feel.
Run it again only when a number of the robot changes; the poses come from a fixed seed.
"""
import json
import pathlib

import numpy as np
import pinocchio as pin

ORIGIN = [(0.024, 0, 0.115), (0.033, 0, 0), (0, 0, 0.155), (0, 0, 0.135), (0, 0, 0.1136)]
AXIS = [(0, 0, -1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, -1)]
LOWER = np.radians([-169, -65, -151, -102.5, -167.5])
UPPER = np.radians([169, 90, 146, 102.5, 167.5])
LINK = [
    (2.351, (0.01516, 0.00359, -0.03105), (0.0029525, 0.0060091, 0.0058821)),
    (1.318, (-0.01903, 0.0150, 0.11397), (0.0031145, 0.0031631, 0.0005843)),
    (0.821, (0.00013, 0.02022, 0.10441), (0.00172767, 0.0018468, 0.00041967)),
    (0.769, (0.00015, -0.02464, 0.05353), (0.0006764, 0.0010573, 0.0006610)),
    (0.687, (0, 0.0012, 0.01648), (0.0001934, 0.0001602, 0.0000689)),
]
TOOL = np.array([0, 0, 0.05716 + 0.0289])
GRIPPER = (0.219, TOOL, (0.0002324, 0.0003629, 0.0002067))
MOUNT = np.array([0.143, 0, 0.13])
GRAVITY = 9.81


def inertia(mass, com, principal):
    return pin.Inertia(mass, np.array(com, dtype=float), np.diag(principal))


def arm(planar):
    model = pin.Model()
    model.gravity.linear = np.array([0, 0, -GRAVITY])
    parent, place = 0, pin.SE3.Identity()
    if planar:
        parent = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "base")
        place = pin.SE3(np.eye(3), MOUNT)
    for i in range(5):
        here = place * pin.SE3(np.eye(3), np.array(ORIGIN[i], dtype=float))
        parent = model.addJoint(
            parent, pin.JointModelRevoluteUnaligned(np.array(AXIS[i], dtype=float)), here, f"joint_{i + 1}"
        )
        model.appendBodyToJoint(parent, inertia(*LINK[i]), pin.SE3.Identity())
        place = pin.SE3.Identity()
    model.appendBodyToJoint(parent, inertia(*GRIPPER), pin.SE3.Identity())
    model.addFrame(pin.Frame("tool", parent, 0, pin.SE3(np.eye(3), TOOL), pin.FrameType.OP_FRAME))
    return model


def cases(rng):
    special = [
        [0, 0, 0, 0, 0],
        [0, -30, 100, 60, 0],
        [0, 30, 60, 60, 0],
        [0, 90, 0, 0, 0],
        [90, -60, 135, -95, 45],
        [169, 90, 146, 102.5, 167.5],
        [-169, -65, -151, -102.5, -167.5],
    ]
    poses = [np.radians(s) for s in special] + [LOWER + rng.random(5) * (UPPER - LOWER) for _ in range(50)]
    for q in poses:
        yield q, rng.uniform(-1.5, 1.5, 5), rng.uniform(-10, 10, 5), rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3)


def main():
    fixed, moving = arm(False), arm(True)
    data, moving_data = fixed.createData(), moving.createData()
    tool = fixed.getFrameId("tool")
    out = []
    for q, qd, qdd, base_v, base_a in cases(np.random.default_rng(20120604)):
        pin.forwardKinematics(fixed, data, q, qd)
        pin.updateFramePlacements(fixed, data)
        jacobian = pin.computeFrameJacobian(fixed, data, q, tool, pin.LOCAL_WORLD_ALIGNED)
        mass = pin.crba(fixed, data, q).copy()
        mass = np.triu(mass) + np.triu(mass, 1).T
        # The planar base stands at the origin, unturned: its frame is the world's. Velocity (vx, vy, wz), acceleration
        # of its coordinates likewise (spatial, in its own frame).
        at = np.concatenate([[0, 0, 1, 0], q])
        moved = pin.rnea(moving, moving_data, at, np.concatenate([base_v, qd]), np.concatenate([base_a, qdd]))
        out.append(
            {
                "q": q.tolist(),
                "qd": qd.tolist(),
                "qdd": qdd.tolist(),
                "tool": data.oMf[tool].translation.tolist(),
                "rotation": data.oMf[tool].rotation.tolist(),
                "jacobian": jacobian[:3].tolist(),
                "gravity": pin.computeGeneralizedGravity(fixed, data, q).tolist(),
                "mass_matrix": mass.tolist(),
                "torque": pin.rnea(fixed, data, q, qd, qdd).tolist(),
                "base_velocity": base_v.tolist(),
                "base_acceleration": base_a.tolist(),
                "torque_on_moving_base": moved[3:].tolist(),
            }
        )
    target = pathlib.Path(__file__).with_name("youbot.json")
    target.write_text(
        '{"pinocchio": "%s", "cases": [\n' % pin.__version__ + ",\n".join(json.dumps(c) for c in out) + "\n]}\n"
    )


main()

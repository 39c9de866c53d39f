"""The compiled dynamics of a chain against pinocchio's, on arms of this package and on random chains."""

import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.chain import SCRATCH, chain_of, collect_inertia, sweep, torques
from tvist_plant.description import Payload, load
from tvist_plant.imperfections import YieldingBase, on_base
from tvist_plant.model import FLANGE, flexible_model, rigid_model

KINDS = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
DISC = Payload(mass=4.0, com=(0.02, -0.01, 0.06), inertia=(0.01, 0.001, 0.0, 0.012, 0.0, 0.02))


def random_chain(random, links):
    """A chain of random joints, placements and bodies, with a frame somewhere on the last one."""
    model = pin.Model()
    for number in range(links):
        placement = pin.SE3.Random()
        kind = KINDS[random.integers(3)]()
        joint = model.addJoint(number, kind, placement, f"joint {number}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Random())
    model.addFrame(pin.Frame("end", links, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    return model, model.getFrameId("end")


def models():
    for name in ("ur3e", "ur5e", "ur30"):
        description = load(name)
        rigid, flexible = rigid_model(description, DISC), flexible_model(description, DISC)
        yield name, (rigid, rigid.getFrameId(FLANGE))
        yield f"{name} bending", (flexible.model, flexible.flange)
        based = on_base(flexible, YieldingBase())
        yield f"{name} on a base", (based.model, based.flange)
    pin.seed(7)
    random = np.random.default_rng(7)
    for links in (1, 2, 7, 15):
        yield f"{links} random joints", random_chain(random, links)


MODELS = dict(models())


@pytest.mark.parametrize("name", MODELS)
def test_dynamics_match_pinocchio(name):
    model, end = MODELS[name]
    data, links, random = model.createData(), model.nv, np.random.default_rng(3)
    chain, scratch = chain_of(model, end), np.full((links + 1, SCRATCH), np.nan)
    for _ in range(30):
        q, qd, qdd = random.uniform(-3.0, 3.0, (3, links))
        torque, M = np.empty(links), np.zeros((links, links))
        torques(chain, q, qd, qdd, 9.81, scratch, torque)
        wanted = pin.rnea(model, data, q, qd, qdd)
        np.testing.assert_allclose(torque, wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())
        collect_inertia(scratch, M)
        np.testing.assert_allclose(M, np.triu(pin.crba(model, data, q)), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", MODELS)
def test_motion_of_the_end_frame_matches_pinocchio(name):
    model, end = MODELS[name]
    data, links = model.createData(), model.nv
    q, qd, qdd = np.random.default_rng(5).uniform(-3.0, 3.0, (3, links))
    chain, scratch = chain_of(model, end), np.zeros((links + 1, SCRATCH))
    sweep(chain, q, qd, qdd, 0.0, scratch)
    pin.forwardKinematics(model, data, q, qd, qdd)
    placement = pin.updateFramePlacement(model, data, end)
    np.testing.assert_allclose(scratch[-1, :9].reshape(3, 3), placement.rotation, atol=1e-12)
    np.testing.assert_allclose(scratch[-1, 9:12], placement.translation, atol=1e-12)
    rate = pin.getFrameVelocity(model, data, end, pin.WORLD)
    rise = pin.getFrameAcceleration(model, data, end, pin.WORLD)
    for found, motion in ((scratch[-1, 16:22], rate), (scratch[-1, 22:28], rise)):
        wanted = np.concatenate([motion.angular, motion.linear])
        np.testing.assert_allclose(found, wanted, atol=1e-10 * max(1.0, np.abs(wanted).max()))


def test_torques_are_linear_in_the_parameters_of_the_last_body():
    """So a payload can be phased in; a body may also be a difference of two, which no pin.Inertia can be."""
    model, end = MODELS["ur5e"]
    chain, scratch = chain_of(model, end), np.zeros((7, SCRATCH))
    q, qd, qdd, parameters = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 6))
    found = np.empty((3, 6))
    for share, torque in zip((0.0, 1.0, 0.25), found, strict=True):
        loaded = chain.copy()
        loaded[5, 12:18] += share * parameters
        torques(loaded, q, qd, qdd, 9.81, scratch, torque)
    np.testing.assert_allclose(found[2], 0.75 * found[0] + 0.25 * found[1], atol=1e-10)

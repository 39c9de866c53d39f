"""Estimators, which provide the modes f_d(q) and ζ(q) from different models."""

from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.estimators.flexible_joint import FlexibleJoint, flexible_joint
from tvist_shaping.estimators.modal import Modal
from tvist_shaping.estimators.polynomial import Polynomial, terms

__all__ = [
    "Drivetrain",
    "Estimator",
    "Fixed",
    "FlexibleJoint",
    "Modal",
    "Polynomial",
    "flexible_joint",
    "terms",
]

"""Models: bodies, supports, loads, contacts; assembled to a discrete problem and recovered."""

from ..elements.elasticity import LinearElastic
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.rigid import Rigid
from .fields import ContactFields
from .model import Model
from .parts import Body, BodyForce, Contact, Fix, NodalForce, Pressure, Traction
from .processes import distributed

__all__ = ["Body", "BodyForce", "CiarletGeymonat", "Contact", "ContactFields", "Fix",
           "LinearElastic", "Model", "NeoHookean", "NodalForce", "Pressure", "Rigid",
           "Traction", "distributed"]  # fmt: skip

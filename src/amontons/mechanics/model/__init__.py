"""Models: bodies, supports, loads, contacts; assembled to a discrete problem and recovered."""

from ..elements.elasticity import LinearElastic
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.orthotropic import OrthotropicElastic
from ..elements.rigid import Rigid
from .fields import ContactFields
from .model import Model
from .parts import Body, BodyForce, Contact, Fix, NodalForce, Pressure, Temperature, Traction
from .processes import distributed

__all__ = ["Body", "BodyForce", "CiarletGeymonat", "Contact", "ContactFields", "Fix",
           "LinearElastic", "Model", "NeoHookean", "NodalForce", "OrthotropicElastic",
           "Pressure", "Rigid", "Temperature", "Traction", "distributed"]  # fmt: skip

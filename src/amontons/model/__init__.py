"""Models: bodies, supports, loads, contacts; assembled to a discrete problem and recovered."""

from ..fem.elasticity import LinearElastic
from .fields import ContactFields
from .model import Model
from .parts import Body, BodyForce, Contact, Fix, Traction
from .processes import distributed

__all__ = ["Body", "BodyForce", "Contact", "ContactFields", "Fix", "LinearElastic", "Model",
           "Traction", "distributed"]  # fmt: skip

"""Models: bodies, supports, loads, contacts; assembled to a discrete problem and recovered."""

from ..elements.elasticity import LinearElastic
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.orthotropic import OrthotropicElastic
from ..elements.rigid import Rigid
from .constraints import Axes, Coupling, Equation, Pretension, Reference, Spring
from .fields import ContactFields
from .finding import FoundContacts, FoundPair, find_contacts
from .model import Model
from .parts import Body, BodyForce, Contact, Fix, NodalForce, Pressure, Temperature, Traction
from .processes import distributed

__all__ = ["Axes", "Body", "BodyForce", "CiarletGeymonat", "Contact", "ContactFields",
           "Coupling", "Equation", "Fix", "FoundContacts", "FoundPair", "LinearElastic",
           "Model", "NeoHookean", "NodalForce", "OrthotropicElastic", "Pressure", "Pretension",
           "Reference", "Rigid", "Spring", "Temperature", "Traction", "distributed",
           "find_contacts"]  # fmt: skip

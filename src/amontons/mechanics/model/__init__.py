"""Models: bodies, supports, loads, contacts; assembled to a discrete problem and recovered."""

from ..elements.elasticity import LinearElastic
from ..elements.energies import MooneyRivlin, Ogden, ReducedPolynomial, SaintVenantKirchhoff
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.orthotropic import OrthotropicElastic
from ..elements.plasticity import ElastoPlastic
from ..elements.rigid import Rigid
from ..elements.user_energy import UserEnergy
from .constraints import Axes, Coupling, Equation, Pretension, Reference, Spring
from .fields import ContactFields
from .finding import FoundContacts, FoundPair, find_contacts
from .mean_tractions import mean_tractions
from .model import Model
from .parts import Body, BodyForce, Contact, Fix, NodalForce, Pressure, Temperature, Traction
from .processes import distributed
from .spread_solution import DistributedSolution

__all__ = ["Axes", "Body", "BodyForce", "CiarletGeymonat", "Contact", "ContactFields",
           "Coupling", "DistributedSolution", "ElastoPlastic",
           "Equation", "Fix", "FoundContacts", "FoundPair",
           "LinearElastic", "Model", "MooneyRivlin", "NeoHookean", "NodalForce", "Ogden",
           "OrthotropicElastic", "Pressure", "Pretension", "ReducedPolynomial",
           "Reference", "Rigid",
           "SaintVenantKirchhoff", "Spring", "Temperature", "Traction", "UserEnergy",
           "distributed", "find_contacts", "mean_tractions"]  # fmt: skip

"""More commands of the command line; only click is imported here too."""

from __future__ import annotations

import click

from . import flags
from .folders import results_folder


@click.command(
    short_help="Say whether a contact result is true.", epilog="""\b
Examples:
  amontons audit model.inp model.frd                  is the result of CalculiX true?
  amontons audit model.inp model.frd --solve --report -o model-audit
  amontons audit case.toml case-results               our own results, as stored
  amontons audit model.inp model.frd --json - | jq .verdict

\b
Exit codes: 0 right, 1 wrong or undecided, 2 it can not be read or belongs to another model.
"""
)
@click.argument("source")
@click.argument("result")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--time", type=float, metavar="T",
              help="Judge the state at that time, against the loads of then. [the last]"
              )  # fmt: skip
@click.option("--law", type=click.Choice(["hard", "own"]),
              help="hard: contact neither overlaps nor creeps while it sticks; own: it may "
              "give way as its stiffness says. [hard for decks, own for cases]")  # fmt: skip
@click.option("--solve", is_flag=True, help="Solve the model too, and put the forces beside.")
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@click.option("--picture", metavar="FILE",
              help="Draw where it is wrong: .png, .svg or .pdf.")  # fmt: skip
@results_folder("name of the result with -audit", only_report=True)
@click.option("--quiet", is_flag=True, help="The exit code alone.")
@flags.of_decks
def audit(**options: object) -> int:
    """Say whether a contact result is true, of another program or of ours.

    SOURCE is a deck (.inp), a case file or example:NAME; RESULT its displacements: .frd or .dat
    of CalculiX, .vtu, solution.h5 or a results folder.  Forces follow from displacements; they
    are held against balance, overlap, the friction cone and the slip, from both sides.
    """
    from .audit import run

    return run(**options)  # type: ignore[arg-type]


@click.command(
    short_help="Write a problem, model or result in other formats.", epilog="""\b
Examples:
  amontons convert global.hdf5 local.hdf5 --form local
  amontons convert case.toml problem.hdf5
  amontons convert example:cube cube.inp --dialect abaqus
  amontons convert cube-results cube.frd      displacements, stresses, contact for cgx, PrePoMax
"""
)
@click.argument("source")
@click.argument("target")
@click.option("--form", type=click.Choice(["local", "global"]),
              help="local: W, q; global: M, H, f, w. [the form it has]")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--dialect", type=click.Choice(["calculix", "abaqus"]),
              help="Of a deck (.inp) that is written. [calculix]")  # fmt: skip
@click.option("--penalty", type=float, metavar="K",
              help="Of such a deck: pressure over overclosure of hard contact, stress over "
              "length. [HARD]")  # fmt: skip
@flags.of_decks
def convert(**options: object) -> None:
    """Write a problem as an FCLib file, a model as a deck (.inp), results as .frd or .dat.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file, a results folder, or
    example:NAME.
    """
    from .convert import run

    run(**options)  # type: ignore[arg-type]


@click.command(
    short_help="Check a certificate of uniqueness.", epilog="""\b
Examples:
  amontons uniqueness example:hild --mu 1 --certificate c.h5
  amontons check c.h5

\b
Exit codes: 0 it proves what it says, 2 it does not.
"""
)
@click.argument("certificate")
def check(certificate: str) -> int:
    """Check a certificate of uniqueness, with code that shares nothing with the rest."""
    from .uniqueness import check as run

    return run(certificate)


@click.command(
    short_help="Find the least friction that locks in a state.", epilog="""\b
Examples:
  amontons jam example:brake                  from which friction on the arm can stay locked
  amontons jam case.toml --json - | jq .upper

\b
Exit codes: 0 settled for every pattern of open contacts, 1 with all contacts closed only,
2 bad input.
"""
)
@click.argument("source")
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="For patterns of open contacts. [30]")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@flags.of_decks
def jam(**options: object) -> int:
    """Find the smallest friction at which a state can be locked in without load.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.  Its
    loads are not read; its friction is the shape over the contacts.  Both bounds are proved.
    """
    from .jam import run

    return run(**options)  # type: ignore[arg-type]


@click.command(
    short_help="Bound the live load at which blocks give way.", epilog="""\b
Examples:
  amontons collapse example:column --live 1,0           sideways, in parts of its weight
  amontons collapse example:column --traction "row 5 block 1.top=1,0"
  amontons collapse example:column --live 1,0 --json - | jq .lower

\b
Exit codes: 0 both bounds are as near as --gap asks, 1 farther apart, 2 bad input.
"""
)
@click.argument("source")
@click.option("--live", multiple=True, metavar="[REGION=]X,Y[,Z]",
              help="Live force per volume, of all bodies or a region.")  # fmt: skip
@click.option("--traction", multiple=True, metavar="SURFACE=X,Y[,Z]",
              help="Live force per area (per length in 2D).")  # fmt: skip
@click.option("--gap", type=float, default=2e-3, show_default=True, metavar="X",
              help="Relative distance of the bounds that is good enough.")  # fmt: skip
@click.option("--time-limit", type=float, metavar="SECONDS", help="For the lower bound. [60]")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@flags.of_decks
def collapse(**options: object) -> int:
    """Bound the factor of a live load at which blocks in frictional contact give way.

    SOURCE is a case file (.toml), a deck (.inp) or example:NAME; its loads are dead.  Nothing
    moves below the lower bound, there is no balance beyond the upper one; both are proved.
    """
    from .collapse import run

    return run(**options)  # type: ignore[arg-type]


@click.command(
    short_help="Find the complex modes of a sliding state.", epilog="""\b
Examples:
  amontons modes case.toml --count 20 --picture modes.png
  amontons modes case.toml --velocity 1,0 --flutter     the lower side slides along x everywhere
  amontons modes case.toml --near 6474 --json - | jq .stable

\b
Exit codes: 0 no mode grows, 1 one grows, 2 bad input.
"""
)
@click.argument("source")
@click.option("--count", type=click.IntRange(min=1), default=10, show_default=True, metavar="N",
              help="How many modes.")  # fmt: skip
@click.option("--near", type=float, default=0.0, show_default=True, metavar="F",
              help="Those nearest to a frequency, per unit of time.")  # fmt: skip
@click.option("--velocity", metavar="X,Y[,Z]",
              help="The slaves slide that way everywhere. [as the solution does]")  # fmt: skip
@click.option("--flutter", is_flag=True,
              help="Also the frictions at which modes meet and begin to grow.")  # fmt: skip
@click.option("--mu", type=float, metavar="X", help="Friction coefficient of all contacts.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@click.option("--picture", metavar="FILE", help="Draw the modes: .png, .svg or .pdf.")
@flags.of_decks
def modes(**options: object) -> int:
    """Find the complex modes of small motions about a sliding state, and which of them grow.

    SOURCE is a case file (.toml), a deck (.inp) or example:NAME with densities; it is solved.
    """
    from .modes import run

    return run(**options)  # type: ignore[arg-type]


@click.command(short_help="List the built-in examples.")
def examples() -> None:
    """List the built-in examples: `amontons solve example:NAME`, in time `amontons run`."""
    from .sources import list_examples

    list_examples()

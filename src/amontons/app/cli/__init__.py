"""The command line.  Only click is imported here, so that `amontons --help` is immediate."""

from __future__ import annotations

import click

from ... import __version__
from . import flags
from .folders import results_folder
from .group import Commands
from .more_commands import audit, check, collapse, convert, examples, jam, modes

EPILOG = """\b
Examples:
  amontons solve example:cube                 a built-in model, results in cube-results/
  amontons solve KaplasTower.hdf5 --tolerance 1e-6
  amontons solve case.toml --set mesh.cells=32 --set contact.friction.coulomb=0.5
  amontons info problem.hdf5                  what is in there, and which methods fit
  amontons bench *.hdf5 --methods gauss-seidel,auto --tolerances 1e-3,1e-6

\b
Exit codes: 0 converged, 1 not converged (results are written all the same),
2 bad input (nothing is written), 130 interrupted (the best state is written).
"""


@click.group(
    cls=Commands, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(__version__, prog_name="amontons")
def main() -> None:
    """Frictional contact mechanics: from a case file, a deck or an FCLib file to a solution.

    Each answer is judged by an error measure that no solver computes for itself and that does
    not depend on units.  `amontons COMMAND --help` explains a command.
    """


@main.command(
    epilog="""\b
Examples:
  amontons solve example:cube --set mesh.cells=8 -o out
  amontons solve case.toml --method semismooth-newton --set solver.line_search=armijo
  amontons solve problem.hdf5 --method gauss-seidel --set solver.batch=adaptive
  amontons solve problem.hdf5 --quiet --json - | jq .error
"""
)
@click.argument("source")
@click.option("--method", metavar="NAME",
              help="Solver, such as auto or gauss-seidel, or package.module:Class, in place of "
              "that of the case and its options; --set solver.… then sets options of this one."
              )  # fmt: skip
@click.option("--tolerance", type=float, metavar="X", help="Unit-free error to reach. [1e-8]")
@click.option("--contact-tolerance", type=float, metavar="X",
              help="Error of every contact on its own scale. [root of the tolerance]")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case, mesh.cells=32, or of the solver, "
              "solver.tolerance=1e-6; may be repeated.")  # fmt: skip
@click.option("--max-iterations", type=click.IntRange(min=1), metavar="N",
              help="Stop after N iterations.")  # fmt: skip
@click.option("--time-limit", type=float, metavar="SECONDS", help="Stop after that time.")
@click.option("--patience", type=click.IntRange(min=0), default=500, show_default=True,
              metavar="N", help="Stop after N iterates without progress; 0: never."
              )  # fmt: skip
@click.option("--start", metavar="FILE", help="Start from the r, and v, of a solution.h5, its "
              "folder, or JSON {\"r\": [[…], …], \"v\": […]}.")  # fmt: skip
@click.option("--criterion", type=click.Choice(["judge", "natural"]), default="judge",
              show_default=True, help="What the tolerance is for: the unit-free error, or "
              "|F_nat(r)| / |q| with rho = 1, as papers have it.")  # fmt: skip
@results_folder("name of the source with -results")
@click.option("--json", "json_copy", metavar="FILE",
              help="A copy of solution.json; - prints it and nothing else.")  # fmt: skip
@click.option("--uniqueness", "full_verdict", is_flag=True,
              help="Find out whether there are other solutions, for up to a minute; the cheap "
              "part of it is always done.")  # fmt: skip
@flags.fclib_error
@flags.figures
@flags.frd
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
@flags.of_decks
def solve(**options: object) -> int:
    """Solve a problem and write the results.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.
    Writes solution.json,
    solution.h5, status.png, convergence.png and, for models, solution.vtu into DIR.
    """
    from .solve import run

    return run(**options)  # type: ignore[arg-type]


@main.command(
    short_help="Say what a problem is, and which methods fit.", epilog="""\b
Examples:
  amontons info part.step --picture faces.png      which face has which name
  amontons info case.toml --picture bodies.png     all bodies, with names of their surfaces
  amontons info case.toml --json - | jq .contacts
"""
)
@click.argument("source")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="For ranks and existence. [the work of 20 s]")  # fmt: skip
@flags.surfaces
@click.option("--json", "json_copy", metavar="FILE",
              help="The same as JSON, with certificates; - prints it.")  # fmt: skip
@flags.of_decks
def info(**options: object) -> None:
    """Say what a problem is: sizes, rank, density, friction, scales, methods that fit.

    It tells the rank of H (or W) with the degree of hyperstaticity, and whether solutions exist
    whatever the load, by a motion that opens all contacts or reactions that hold each other.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), example:NAME, or a mesh
    or CAD file.
    """
    from .info import run

    run(**options)  # type: ignore[arg-type]


@main.command(
    short_help="Compare methods on many problems.", epilog="""\b
Examples:
  amontons bench *.hdf5 --methods gauss-seidel,auto --tolerances 1e-3,1e-6 --profile p.png
  amontons bench *.hdf5 --methods semismooth-newton:function=natural-map,line_search=none
  amontons bench *.hdf5 --methods auto,UPK=gauss-seidel:local=projection,local_steps=3
  amontons bench *.hdf5 --methods auto --by flops --criterion natural --json race.json

\b
METHOD:FIELD=VALUE,… sets options of a method, NAME=METHOD:… gives it a name.
"""
)
@click.argument("files", nargs=-1, required=True, metavar="FILES…")
@click.option("--methods", multiple=True, default=("auto",), metavar="A,B,…",
              help="Solvers, also with options; may be repeated. [auto]")  # fmt: skip
@click.option("--tolerances", default="1e-3,1e-6", show_default=True, metavar="X,Y,…",
              help="Errors to reach.")  # fmt: skip
@click.option("--time-limit", type=float, default=60.0, show_default=True, metavar="SECONDS",
              help="For each solve; a method that misses it has failed, and nothing else ends "
              "one that makes no progress.")  # fmt: skip
@click.option("--by", type=click.Choice(["time", "flops"]), default="time", show_default=True,
              help="What is shown and drawn: seconds or floating point operations."
              )  # fmt: skip
@click.option("--criterion", type=click.Choice(["judge", "natural"]), default="judge",
              show_default=True, help="What the tolerances are for: the unit-free error, or "
              "|F_nat(r)| / |q| with rho = 1.")  # fmt: skip
@click.option("--profile", metavar="FILE.png",
              help="Draw Dolan-Moré performance profiles.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="All times as JSON; - prints them.")
@results_folder("bench-results", only_report=True)
def bench(**options: object) -> None:
    """Compare methods on many problems: times to reach a tolerance, side by side.

    Times are those of a second run (the first one compiles), from the problem as read to a
    solution that the judge accepts; the best of several where they are short.
    """
    from .bench import run

    run(**options)  # type: ignore[arg-type]


@main.command(
    "enumerate",
    short_help="Find all solutions, and prove that these are all.", epilog="""\b
Examples:
  amontons enumerate example:hild             three solutions, and proof that there is no other
  amontons enumerate example:brake --picture brake.png
  amontons enumerate example:hild --mu 2 --set mesh.refine=4
  amontons enumerate problem.hdf5 --json - | jq .complete
  amontons enumerate example:brake -o brake   solutions.csv: a row per solution and contact
  amontons enumerate example:hild --certificate c.h5     then amontons check c.h5

\b
Exit codes: 0 the list is complete, 1 there may be others, 2 bad input, 130 interrupted before
it was complete: Ctrl-C ends the search with what it has found, a second one at once.
""",
)
@click.argument("source")
@click.option("--mu", type=float, metavar="X", help="Friction coefficient of all contacts.")
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="Stop after that time; the list may then lack some.")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@click.option("--picture", metavar="FILE",
              help="Draw the solutions side by side: .png, .svg or .pdf.")  # fmt: skip
@flags.certificate
@results_folder("name of the source with -results", asked=True)
@flags.of_decks
def enumerate_solutions(**options: object) -> int:
    """Find all solutions of a problem with Coulomb friction, and prove that these are all.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.
    Patterns list the contacts
    in order: f free, s stick, + or - slip, in 3D l slip.
    """
    from .enumerate import run as run_enumerate

    return run_enumerate(**options)  # type: ignore[arg-type]


@main.command(
    short_help="Find which solution each method finds.", epilog="""\b
Examples:
  amontons basins example:hild --mu 3.5 --methods uzawa,semismooth-newton
  amontons basins example:brake --methods uzawa --parameter rho=0.1,1,10 --picture brake.png
  amontons basins example:hild --methods nitsche --parameter kappa=10,100 --starts everywhere
  amontons basins problem.hdf5 --methods gauss-seidel --starts zero,cone:100 --json b.json

\b
Starts: zero, open, cone, reactions, displacements, everywhere, both, perturbed, exact,
exact-reactions, exact-displacements; each with a number of draws, as in cone:100.
Exit codes: 0 all runs are made, 1 the time was over before, 2 bad input, 130 interrupted.
"""
)
@click.argument("source")
@click.option("--methods", multiple=True, default=("auto",), show_default=True,
              metavar="A,B,…", help="Solvers, as in `bench`; nitsche for a case.")  # fmt: skip
@click.option("--parameter", "parameters", multiple=True, metavar="[METHOD.]FIELD=X,Y,…",
              help="Values of a field of the solvers; may be repeated, all combinations are "
              "run.")  # fmt: skip
@click.option("--starts", metavar="KIND[:N],…",
              help="From where. [zero,cone,displacements,perturbed,exact]")  # fmt: skip
@click.option("--draws", type=click.IntRange(min=1), default=10, show_default=True, metavar="N",
              help="Random starts of each kind.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, metavar="N",
              help="Of the random choice.")  # fmt: skip
@click.option("--mu", type=float, metavar="X", help="Friction coefficient of all contacts.")
@click.option("--tolerance", type=float, default=1e-8, show_default=True, metavar="X",
              help="Unit-free error of a run that counts.")  # fmt: skip
@click.option("--within", type=float, default=1e-4, show_default=True, metavar="X",
              help="Relative distance in energy up to which a run is at a solution."
              )  # fmt: skip
@click.option("--max-iterations", type=click.IntRange(min=1), metavar="N",
              help="Of each run.")  # fmt: skip
@click.option("--run-limit", type=float, metavar="SECONDS",
              help="Time of each run; one that takes longer has failed.")  # fmt: skip
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="Of everything; what is not run by then is left out.")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE",
              help="Solutions, runs and counts as JSON; - prints them.")  # fmt: skip
@click.option("--picture", metavar="FILE",
              help="Draw what was found: .png, .svg or .pdf.")  # fmt: skip
@click.option("--quiet", is_flag=True, help="No progress, no tables.")
@flags.of_decks
def basins(**options: object) -> int:
    """Find out which solution each method finds, from many starts, over its parameters.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.
    The solutions are listed
    first, as by `enumerate`; a run counts when the judge takes its reactions and its motion.
    """
    from .basins import run as run_basins

    return run_basins(**options)  # type: ignore[arg-type]


@main.command(
    short_help="Say whether a problem has one solution.", epilog="""\b
Examples:
  amontons uniqueness example:hild            another solution, and the critical friction
  amontons uniqueness example:hild --mu 1     one solution, whatever the load
  amontons uniqueness problem.hdf5 --json - | jq .verdict
  amontons uniqueness example:hild --mu 1 --certificate c.h5     then amontons check c.h5

\b
Exit codes: 0 settled, either way, 1 undecided, 2 bad input, 130 interrupted while undecided:
Ctrl-C ends the search with what is known, a second one at once.
""",
)
@click.argument("source")
@click.option("--mu", type=float, metavar="X", help="Friction coefficient of all contacts.")
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="Stop after that time, with the bounds reached by then. [after the work of "
              "about 60 s, the same on a busy machine]")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case.")  # fmt: skip
@click.option("--json", "json_copy", metavar="FILE", help="The same as JSON; - prints it.")
@flags.certificate
@flags.of_decks
def uniqueness(**options: object) -> int:
    """Say whether a problem has one solution: for every load, for this load, or several.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.
    In 2D also bounds on the
    critical friction, below which every load has exactly one solution.
    """
    from .uniqueness import run

    return run(**options)  # type: ignore[arg-type]


@main.command(
    short_help="Follow the solutions while load or friction changes.", epilog="""\b
Examples:
  amontons follow example:vee                     two folds, three solutions between them
  amontons follow example:vee --all --mu 2
  amontons follow example:hild --parameter friction --from 0.1 --to 5 --all
  amontons follow example:hild --from 0.5 --all --certificate c.h5     then amontons check c.h5
  amontons follow example:vee --set continuation.switch=tangent --set continuation.step=1e-3

\b
Exit codes: 0 every branch has come to its end, 1 one was given up, 2 bad input.
"""
)
@click.argument("source")
@click.option("--parameter", type=click.Choice(["load", "friction", "t"]), default="load",
              show_default=True,
              help="What changes; t is the time of loads that depend on it.")  # fmt: skip
@click.option("--from", "low", type=float, default=0.0, show_default=True, metavar="A",
              help="Where the interval begins; the curve starts here.")  # fmt: skip
@click.option("--to", "high", type=float, default=1.0, show_default=True, metavar="B",
              help="Where it ends.")  # fmt: skip
@click.option("--mu", type=float, metavar="X", help="Friction coefficient of all contacts.")
@click.option("--all", "every", is_flag=True,
              help="Branches through all solutions at both ends and the middle.")  # fmt: skip
@click.option("--max-points", type=click.IntRange(min=2), default=100_000, show_default=True,
              metavar="N", help="Points of a branch in each direction.")  # fmt: skip
@click.option("--time-limit", type=float, metavar="SECONDS", help="Stop after that time.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case; continuation.KEY is one of the algorithm, "
              "which then steps along curves also where they are known exactly: step, "
              "min_step, max_step, grow, shrink, residual, change, min_cosine, corrections, "
              "quick, border, ahead, aside, switch=tangent|first-order.")  # fmt: skip
@results_folder("name of the source with -results")
@click.option("--json", "json_copy", metavar="FILE",
              help="A copy of follow.json; - prints it and nothing else.")  # fmt: skip
@flags.axes
@flags.certificate
@click.option("--quiet", is_flag=True, help="No summary.")
@flags.of_decks
def follow(**options: object) -> int:
    """Follow the solutions while the load or the friction changes: folds, events, branches.

    SOURCE is a case file (.toml), a deck (.inp), an FCLib file (.hdf5), or example:NAME.
    Writes follow.json (points
    and events), follow.csv and follow.png into DIR.
    """
    from .follow import run as run_follow

    return run_follow(**options)  # type: ignore[arg-type]


@main.command(
    epilog="""\b
Examples:
  amontons run example:wall --set wall.cells=[4,2,2] --set evolution.until=0.1 --pictures
  amontons run wall.toml -o out
  amontons run wall.toml -o out --export-fclib problems --export-steps 1-4,10-50:10
  amontons run wall.toml -o out --restart --set evolution.until=2

\b
Exit codes: 0 all steps are made, 1 a step has not converged or the time is over,
2 bad input, or a file can not be written, 130 interrupted, 143 terminated; what
has been made is saved, go on with --restart.
"""
)
@click.argument("case")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE",
              help="Replace a value of the case, such as evolution.step=1e-3.")  # fmt: skip
@click.option("--tolerance", type=float, metavar="X", help="Unit-free error of every step.")
@click.option("--time-limit", type=float, metavar="SECONDS",
              help="Stop after that time, ready for --restart; solver.time_limit is for each "
              "step.")  # fmt: skip
@results_folder("name of the case with -results")
@click.option("--export-fclib", "export", metavar="DIR",
              help="Write the discrete problems of the steps as FCLib files.")  # fmt: skip
@click.option("--export-steps", metavar="LIST",
              help="Which steps: 7, 1-40 or 50-500:10, with commas between. [all]"
              )  # fmt: skip
@click.option("--every", type=click.IntRange(min=1), default=10, show_default=True, metavar="N",
              help="Write a VTK file, and the state, every N steps.")  # fmt: skip
@click.option("--pictures", is_flag=True,
              help="Draw the written steps, a film of them, and the energies.")  # fmt: skip
@click.option("--xdmf", is_flag=True, help="Also steps.xdmf, and an HDF5 file per VTK file.")
@click.option("--restart", is_flag=True,
              help="Go on from the state in DIR, of the same case, after any end.")  # fmt: skip
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
@flags.rates
@flags.of_decks
def run(**options: object) -> int:
    """Follow a case in time: dynamics, or quasi-static steps.

    CASE is a TOML case file with a table [evolution], or example:NAME.  Writes into DIR:
    steps.csv (energies, forces), solution.json (the end), state.h5, step-NNNNN.vtu and
    steps.pvd, a film for ParaView; with --pictures energy.png and, in pictures/, the bodies.
    """
    from .run import run as run_case

    return run_case(**options)  # type: ignore[arg-type]


for command in (audit, check, convert, examples, jam, collapse, modes):
    main.add_command(command)

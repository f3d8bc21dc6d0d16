"""A case file of one block on a floor in quasi-static steps, and the command line for it."""

from click.testing import CliRunner

from amontons.app.cli import main

TEXT = """
[mesh]
box = [{length}, 1]
cells = {cells}
[material.default]
young = {young}
poisson = {poisson}
[[fix]]
on = "top"
value = {value}
[[contact]]
slave = "bottom"
obstacle = {{ plane = {{ normal = [0, 1] }} }}
friction = {friction}
[evolution]
kind = "quasi-static"
step = {step}
until = {until}
"""


def block_case(value, friction, *, length=1, cells=2, young=100.0, poisson=0.0, step=0.5,
               until=1.0):  # fmt: skip
    """The text; value: of the fix on top, as in TOML; friction: too."""
    return TEXT.format(**locals())


def command(*arguments):
    """The command line, with anything as arguments."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])

"""The public names: the same for the interpreter and for type checkers."""

import ast
from pathlib import Path

import amontons

PACKAGE = Path(amontons.__file__).parent


def test_type_checkers_see_the_names_that_load_on_first_use():
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text())
    found = {
        alias.asname: node.module
        for node in tree.body if isinstance(node, ast.ImportFrom) and node.level == 1
        for alias in node.names
    }  # fmt: skip
    assert found == amontons._MODULE
    assert (PACKAGE / "py.typed").exists()

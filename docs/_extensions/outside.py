"""Pages of the site that live elsewhere in the repository, and links that lead to them.

README files and measured results stay beside the code that makes them.  A build copies them to
`docs/outside`; links between pages are then those of the repository and of the site alike.
"""

import os
import re
import shutil
from pathlib import Path

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
COPIES = DOCS / "outside"
PATTERNS = (
    "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "examples/README.md",
    "benchmarks/results/*.md", "benchmarks/results/*.png", "reproduce/*/README.md",
    "reproduce/*/results/*.md", "reproduce/*/results/*.png", "verify/README.md",
    "verify/results/*.png",
)  # fmt: skip
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?!\w+:|#)([^)\s]+)\)")


def copied() -> list[Path]:
    """The files that are copied, relative to the root."""
    return sorted(path.relative_to(ROOT) for p in PATTERNS for path in ROOT.glob(p))


def copy(app) -> None:
    """Copy what has changed, and remove what is no longer there."""
    wanted = {COPIES / path for path in copied()}
    for old in [path for path in COPIES.rglob("*") if path.is_file() and path not in wanted]:
        old.unlink()
    for path in copied():
        new = COPIES / path
        if not new.exists() or new.read_bytes() != (ROOT / path).read_bytes():
            new.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / path, new)


def on_site(target: Path) -> Path | None:
    """Where a file of the repository is in the site's sources; None where it is not."""
    if target.is_dir():
        target = target / "README.md"
    if target.is_relative_to(DOCS):
        return target if target.exists() else None
    copy = COPIES / target.relative_to(ROOT)
    return copy if copy.exists() else None


def relink(app, page: str, content: list[str]) -> None:
    """Let links of a page lead to where its neighbours are; to no page: the words alone."""
    source = Path(app.env.doc2path(page))
    if source.suffix != ".md":
        return
    outside = source.is_relative_to(COPIES)
    origin = ROOT / source.relative_to(COPIES) if outside else source

    def changed(match: re.Match[str]) -> str:
        picture, words, link = match.groups()
        path, _, part = link.partition("#")
        target = Path(os.path.normpath(origin.parent / path))
        if not target.is_relative_to(ROOT) or not target.exists():
            return match.group(0)  # a wrong link: the build says so
        there = on_site(target)
        if there is None:
            return words
        way = os.path.relpath(there, source.parent) + (f"#{part}" if part else "")
        return f"{picture}[{words}]({way})"

    content[0] = LINK.sub(changed, content[0])


def setup(app):
    """Copy before a build, and mend the links of each page that is read."""
    app.connect("builder-inited", copy)
    app.connect("source-read", relink)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

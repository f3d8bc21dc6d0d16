"""Pictures of reports, to be looked at: what no assertion sees.

    python tests/report_pictures.py [-o FOLDER] [EXAMPLE | CASE | REPORT.html ...]

Solves every built-in example (or those named, cases and decks too), opens their reports in a
headless Chromium and takes pictures: of each page, light and dark, and of the view in all its
colours.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--ignore-gpu-blocklist", "--no-sandbox"]  # fmt: skip
IN_TIME = ("release", "wall")  # cases of `amontons run`
SEVERAL = ("brake", "hild", "one-contact")  # with all their solutions too
SETTLED = "() => new Promise(f => requestAnimationFrame(() => requestAnimationFrame(f)))"


def reports(names, folder):
    """Make the reports, as (name, path)."""
    for name in names:
        if name.endswith(".html"):
            yield Path(name).stem, Path(name)
            continue
        source = name if Path(name).exists() else f"example:{name}"
        verbs = ["run"] if name in IN_TIME else ["solve"]
        for verb in [*verbs, *(["enumerate"] if name in SEVERAL else [])]:
            to = folder / f"{Path(name).stem}-{verb}"
            command = [sys.executable, "-m", "amontons", verb, source, "--report", "-o", to]
            subprocess.run(list(map(str, command)), check=False, stdout=subprocess.DEVNULL)
            yield to.name, to / "report.html"


def shoot(browser, name, path, folder, scheme, colours):
    """Pictures of one page."""
    page = browser.new_page(viewport={"width": 1200, "height": 800}, color_scheme=scheme)
    page.on("pageerror", lambda error: print(name, error, file=sys.stderr))
    page.goto(path.resolve().as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    page.evaluate(SETTLED)
    page.screenshot(path=folder / f"{name}-{scheme}.png", full_page=True)
    choices = page.locator("#field option").evaluate_all("all => all.map(x => x.value)")
    for value in choices if colours else ():
        page.select_option("#field", value)
        page.evaluate(SETTLED)
        target = folder / f"{name}-{value.replace(' ', '-')}.png"
        page.locator("#view").screenshot(path=target)
    page.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("-o", dest="folder", type=Path, default=Path("report-pictures"))
    parser.add_argument("--light", action="store_true", help="only the pages, only in light")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run([sys.executable, "-m", "amontons", "examples"], text=True,
                            capture_output=True, check=True).stdout  # fmt: skip
    names = asked.names or [line.split()[0] for line in listed.splitlines() if line.strip()]
    with sync_playwright() as running:
        browser = running.chromium.launch(
            executable_path=shutil.which("chromium"), args=FLAGS
        )
        for name, path in reports(names, asked.folder):
            if not path.exists():
                print(f"{name}: no report", file=sys.stderr)
                continue
            shoot(browser, name, path, asked.folder, "light", not asked.light)
            if not asked.light:
                shoot(browser, name, path, asked.folder, "dark", False)
            print(name, flush=True)
        browser.close()


if __name__ == "__main__":
    main()

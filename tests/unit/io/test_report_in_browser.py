"""Reports opened by a browser without a network: turned, moved, coloured, clicked."""

import shutil

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.sources import examples
from amontons.io.report import report

playwright = pytest.importorskip("playwright.sync_api")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser",
                                               "google-chrome"))), None)  # fmt: skip
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--ignore-gpu-blocklist", "--no-sandbox"]  # fmt: skip
SMALLER = {  # examples that take long as they are
    "wall": ["wall.cells=[2,1,2]", "evolution.until=0.01"], "release": ["evolution.until=0.3"],
    "cube": ["mesh.cells=6"],
}  # fmt: skip
IN_TIME = ("release", "wall")
HANDLED = ("cube", "brake", "tresca", "wall")  # in 3D, in 2D, of another law, in time
NO_BODIES = ("cylinder", "one-contact", "spheres", "tower")
PICTURE = """() => {
    const canvas = document.getElementById('canvas'), copy = document.createElement('canvas');
    copy.width = canvas.width; copy.height = canvas.height;
    const pen = copy.getContext('2d'); pen.drawImage(canvas, 0, 0);
    const words = new Uint32Array(pen.getImageData(0, 0, copy.width, copy.height).data.buffer);
    let sum = 0; for (const word of words) sum = (Math.imul(sum, 31) + word) | 0;
    return { sum, colours: new Set(words).size }; }"""
SETTLED = "() => new Promise(f => requestAnimationFrame(() => requestAnimationFrame(f)))"


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as running:
        found = running.chromium.launch(executable_path=BROWSER, args=FLAGS)
        yield found
        found.close()


@pytest.fixture
def opened(browser):
    """A function that opens a page without a network; all that goes wrong on it fails."""
    wrong, contexts = [], []

    def open_page(path, width=1000, height=700, **options):
        context = browser.new_context(
            viewport={"width": width, "height": height}, offline=True, **options
        )
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: wrong.append(m.text) if m.type in ("error",) else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith(("file:", "data:", "blob:"))
                else wrong.append(r.url))  # fmt: skip
        page.goto(path.resolve().as_uri())
        page.wait_for_selector("html[data-ready]", state="attached")
        page.evaluate(SETTLED)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not wrong


def made(tmp_path, verb, source, *more):
    """The report of a command."""
    folder = tmp_path / "out"
    options = ["--quiet"] if verb in ("solve", "run", "follow") else []
    main.main([verb, source, "--report", "-o", str(folder), *options, *more],
              standalone_mode=False)  # fmt: skip
    return folder / "report.html"


def picture(page):
    """A sum over the pixels of the view, and how many colours it has."""
    page.evaluate(SETTLED)
    return page.evaluate(PICTURE)


def changes(page, act):
    """True when the picture is another after act()."""
    before = picture(page)
    act()
    return picture(page) != before


def set_slider(page, name, value):
    page.locator(f"#{name}").evaluate(
        "(e, v) => { e.value = v; e.dispatchEvent(new Event('input')); }", value
    )


def drag(page, pane):
    box = pane.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 70, y + 40, steps=4)
    page.mouse.up()


def click_node(page, vertex):
    """Click where a vertex is seen in the first pane."""
    x, y = page.evaluate("""v => { const { view } = window.report, pane = view.panes[0];
        const box = pane.element.getBoundingClientRect();
        const at = view.project(pane, box, v, pane.eye.target.clone());
        return [box.left + at[0], box.top + at[1]]; }""", vertex)  # fmt: skip
    page.mouse.click(x, y)


@pytest.mark.parametrize("name", examples())
def test_every_example_has_a_page_that_turns(name, tmp_path, opened):
    verb = "run" if name in IN_TIME else "solve"
    more = [part for text in SMALLER.get(name, []) for part in ("--set", text)]
    path = made(tmp_path, verb, f"example:{name}", *more)
    assert path.stat().st_size < 2e6
    page = opened(path, 640, 480)  # every pixel is drawn by the processor, time and again
    assert page.locator("h1").inner_text()
    assert page.locator("svg").count() >= 1
    assert page.locator("#verdict").count() == 1
    if name in NO_BODIES:
        assert not page.locator("#view").is_visible()
        return
    pane = page.locator(".pane").first
    assert picture(page)["colours"] > 20  # something is drawn
    assert changes(page, lambda: drag(page, pane))
    if name not in HANDLED:
        return
    pane.press("0")
    assert changes(page, lambda: set_slider(page, "scale", 100))
    set_slider(page, "scale", 0)
    for field in ("pressure", "shear", "slip", "gap", "displacement", "von Mises stress"):
        page.select_option("#field", field)
        assert field in page.locator("#legend").inner_text()
    assert changes(page, lambda: page.select_option("#field", "status"))
    click_node(page, page.evaluate("window.report.view.shared.contacts[0]"))
    numbers = page.locator("#numbers").inner_text()
    assert "node" in numbers and "displacement" in numbers


def test_in_2d_pressure_and_shear_are_curves_along_the_contact(tmp_path, opened):
    block = am.Body(am.box((2, 1), cells=(8, 4)), am.LinearElastic(young=200, poisson=0.3))
    floor = am.Plane(normal=(0, 1))
    model = am.Model([block], [am.Fix("top", (0.02, -0.02))],
                     [am.Contact("bottom", floor, mu=0.3), am.Contact("left", am.Plane(
                         point=(-0.001, 0), normal=(1, 0)), mu=0.3)])  # fmt: skip
    solution = am.solve(model)
    page = opened(report(solution, tmp_path / "block.html", units="mm,N"))
    chart = page.locator("#zone svg")
    assert "in MPa over length along it in mm" in chart.get_attribute("aria-label")
    drawn = page.evaluate("window.report.view.curve")
    assert [one["name"] for one in drawn[:2]] == ["pressure", "shear"]
    fields, here = solution.fields, solution.fields.frames[:, 0, 1] > 0.5  # of the floor
    order = np.argsort(block.mesh.points[fields.node[here], 0])
    assert np.allclose(drawn[0]["x"], np.linspace(0, 2, 9), atol=1e-6)
    assert np.allclose(drawn[0]["y"], fields.pressure[here][order], rtol=1e-5, atol=1e-8)
    before = page.locator("#zone figcaption").inner_text()
    page.select_option("#pair", index=1)
    assert page.locator("#zone figcaption").inner_text() != before


@pytest.fixture(scope="module")
def cube():
    body = am.Body(am.box((1, 1, 1), cells=(4, 4, 4)), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [body], supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)], name="a cube",
    )  # fmt: skip
    return am.solve(model)


def test_displacements_are_not_drawn_smaller_than_they_are(cube, tmp_path, opened):
    page = opened(cube.report(tmp_path / "r.html"))  # a fifth of the edge: figures have x 1
    assert page.evaluate("window.report.view.suggested()") == 1


def test_a_picked_node_tells_its_numbers(cube, tmp_path, opened):
    page = opened(cube.report(tmp_path / "r.html", units="mm,N"))
    most = int(np.argmax(cube.pressure))
    node = int(cube.fields.node[most])
    vertex = page.evaluate("n => window.report.view.shared.node.indexOf(n)", node)
    page.get_by_role("button", name="Below").click()
    set_slider(page, "scale", 0)
    page.evaluate(SETTLED)
    click_node(page, vertex)
    told = dict(line.split("\t") for line in page.locator("#numbers").inner_text().split("\n"))
    assert told["node"] == str(node)
    assert told["status"] == ("open", "slip", "stick")[cube.status[most]]
    number, unit = told["pressure"].split(" ")
    assert unit == "MPa"
    assert float(number) == pytest.approx(cube.pressure[most], rel=1e-3)


def test_keys_do_what_the_mouse_does(cube, tmp_path, opened):
    page = opened(cube.report(tmp_path / "r.html"))
    pane = page.locator(".pane").first
    pane.focus()
    for key in ("ArrowLeft", "ArrowUp", "+", "-"):
        assert changes(page, lambda key=key: page.keyboard.press(key)), key
    page.keyboard.press("n")
    assert "status" in page.locator("#numbers").inner_text()
    first = page.locator("#numbers").inner_text()
    page.keyboard.press("n")
    assert page.locator("#numbers").inner_text() != first
    assert changes(page, lambda: page.locator("#show-mesh").click())
    assert changes(page, lambda: page.locator("#show-zone").click())


def test_without_3d_the_numbers_stay(cube, tmp_path, browser):
    context = browser.new_context(offline=True)
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    page = context.new_page()
    page.goto(cube.report(tmp_path / "r.html").as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    assert "No 3D here" in page.locator("#no3d").inner_text()
    assert not page.locator("#stage").is_visible()
    assert "resultant on the slaves" in page.content()
    assert page.locator("figure svg").count() == 1
    context.close()


def test_without_scripts_the_text_stays(cube, tmp_path, opened, browser):
    context = browser.new_context(offline=True, java_script_enabled=False)
    page = context.new_page()
    page.goto(cube.report(tmp_path / "r.html").as_uri())
    text = page.locator("body").inner_text()
    assert "largest pressure" in text and "need JavaScript" in text
    context.close()


@pytest.mark.parametrize("size", [(1280, 800), (420, 800)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_sticks_out_or_overlaps(cube, tmp_path, opened, size, scheme):
    page = opened(cube.report(tmp_path / "r.html"), *size, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert page.evaluate("document.documentElement.dataset.theme") == scheme
    boxes = [e.bounding_box() for e in page.locator("main > section, .columns > *").all()]
    boxes = [b for b in boxes if b]
    for k, a in enumerate(boxes):
        for b in boxes[k + 1 :]:
            across = min(a["x"] + a["width"], b["x"] + b["width"]) - max(a["x"], b["x"])
            along = min(a["y"] + a["height"], b["y"] + b["height"]) - max(a["y"], b["y"])
            assert min(across, along) <= 1
    page.locator("#theme").click()
    assert page.evaluate("document.documentElement.dataset.theme") != scheme


def test_not_converged_is_stamped_across(tmp_path, opened):
    path = made(tmp_path, "solve", "example:cube", "--set", "mesh.cells=4",
                "--method", "gauss-seidel", "--max-iterations", "1")  # fmt: skip
    page = opened(path)
    assert "NOT CONVERGED (max iterations" in page.get_by_role("alert").inner_text()
    assert page.locator(".across").first.inner_text() == "NOT CONVERGED"


def test_hostile_words_do_nothing(cube, tmp_path, opened):
    title = "</script><script>document.title='x'</script><img src=x onerror=alert(1)> \ud800"
    page = opened(report(cube, tmp_path / "r.html", title=title))
    assert page.title().startswith("</script><script>")
    assert page.locator("h1").inner_text().startswith("</script><script>document")
    assert page.locator("img").count() == 0


def test_time_moves_by_a_slider(tmp_path, opened):
    path = made(tmp_path, "run", "example:release", "--set", "evolution.until=0.5")
    page = opened(path)
    assert page.locator("#step").get_attribute("max") == "9"
    label = page.locator("output[for=step]")
    assert label.inner_text() == "step 10, t = 0.5"
    assert changes(page, lambda: set_slider(page, "step", 0))
    assert label.inner_text() == "step 1, t = 0.05"
    page.locator("#step").press("ArrowRight")
    assert label.inner_text() == "step 2, t = 0.1"
    page.locator("#play").click()
    playwright.expect(label).to_have_text("step 5, t = 0.25")
    page.locator("#play").click()
    assert "work of loads" in page.locator("#charts").inner_text()


def test_solutions_stand_side_by_side(tmp_path, opened):
    page = opened(made(tmp_path, "enumerate", "example:brake"))
    assert page.locator(".pane").count() == 3
    assert page.locator(".pane h3").first.inner_text().startswith("1: orientation +1")
    assert "3 solutions; there is no other" in page.locator("#verdict").inner_text()
    scale = page.evaluate("window.report.view.scale")
    moved = page.evaluate("window.report.view.bodies.map(b => Array.from(b.state.moved))")
    assert scale > 1
    assert len({tuple(m) for m in moved}) == 3
    assert changes(page, lambda: drag(page, page.locator(".pane").first))  # all move


def test_a_point_moves_along_the_curve(tmp_path, opened):
    page = opened(made(tmp_path, "follow", "example:vee"))
    assert page.locator("circle[data-mark=fold]").count() == 2
    dot = page.locator("figure.curve .cursor circle")
    before = dot.get_attribute("cx")
    assert changes(page, lambda: set_slider(page, "step", 3))
    assert dot.get_attribute("cx") != before
    box = page.locator("figure.curve svg").bounding_box()  # a click takes the nearest point
    page.mouse.click(box["x"] + 0.98 * box["width"], box["y"] + 10)
    assert page.evaluate("window.report.view.state.parameter") > 0.8
    assert "2 folds" in page.locator("#verdict").inner_text()


def test_a_race_has_a_page(tmp_path, opened, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main.main(["bench", "example:one-contact", "--methods", "auto,gauss-seidel", "--report"],
              standalone_mode=False)  # fmt: skip
    page = opened(tmp_path / "bench-results" / "report.html")
    assert page.locator("figure svg").count() == 2
    rows = page.locator("table.table tbody tr")
    assert rows.count() == 2
    assert "ms" in rows.first.inner_text()


def test_a_report_is_written_where_it_is_asked_for(tmp_path):
    found = CliRunner().invoke(main, ["enumerate", "example:brake", "-o", f"{tmp_path}/x"])
    assert found.exit_code == 0
    assert [path.name for path in (tmp_path / "x").iterdir()] == ["solutions.csv"]


def test_printing_shows_the_bodies(cube, tmp_path, opened):
    page = opened(cube.report(tmp_path / "r.html"), color_scheme="dark")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert not page.locator("#tools").is_visible()
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    assert len(page.pdf()) > 50_000

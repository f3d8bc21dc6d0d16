"""Reports: one HTML file per result, which turns, and needs no network."""

from ..units import Units
from .curves import curves_page
from .faces import expect_page, page_of, report, save_page
from .page import Page, Table
from .pages import Film, bench_page, run_page, solutions_page, solve_page

__all__ = ["Film", "Page", "Table", "Units", "bench_page", "curves_page", "expect_page",
           "page_of", "report", "run_page", "save_page", "solutions_page",
           "solve_page"]  # fmt: skip

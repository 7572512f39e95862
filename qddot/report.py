"""Reports: what a program of one's own shows and writes, as qddot's commands do.

    progress_bar                        shows the `progress` of a run that takes its time
    plain_table                         a table for the terminal
    taking_part                         the coordinates of a mode in words
    Section, plot, table, write_page    one HTML page that needs no network: texts, tables, plots with download
    numbers, legible                    values as a plot of a page has them; a unit with its powers raised
    scene_section                       a run of a study as its model's scene, to be played
    embedded                            the main part of another page as the content of a section
    BROWSERS, browser, print_page       the page as PDF, by a browser that is installed
    written_aside                       a file that appears whole or not at all

Figures are in `qddot.drawing`.
"""

from qddot.runner.files import written_aside
from qddot.runner.modes import taking_part
from qddot.runner.pictures.scales import legible
from qddot.runner.report.interactive import numbers
from qddot.runner.report.page import Section, embedded, plot, table, write_page
from qddot.runner.report.pdf import BROWSERS, browser, print_page
from qddot.runner.report.progress import progress_bar
from qddot.runner.report.scene_section import scene_section
from qddot.runner.report.tables import plain_table

__all__ = [
    "BROWSERS",
    "Section",
    "browser",
    "embedded",
    "legible",
    "numbers",
    "plain_table",
    "plot",
    "print_page",
    "progress_bar",
    "scene_section",
    "table",
    "taking_part",
    "write_page",
    "written_aside",
]

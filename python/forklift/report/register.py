"""Every result with its page, its tables and its summary: what `forklift.base.present` looks up."""

from __future__ import annotations

from collections.abc import Sequence

from forklift.base.cell import Celled
from forklift.base.plotted import Plotted
from forklift.base.present import draw_figure, draw_page, draw_summary, draw_tables
from forklift.base.sheet import Listed, Sheeted
from forklift.control.compare import ControlComparison
from forklift.diagnosis.result import Diagnosis
from forklift.ensemble.sweep import Sweep
from forklift.fitting.compare import Comparison
from forklift.fitting.fit import Fit
from forklift.report import notebook, plots
from forklift.report.of_comparison import comparison_page
from forklift.report.of_control import control_page
from forklift.report.of_diagnosis import diagnosis_page
from forklift.report.of_fit import fit_page
from forklift.report.of_simulation import simulation_page
from forklift.report.of_sweep import sweep_page
from forklift.report.tables import comparison_tables, fit_tables, listed, plain

draw_page.register(Comparison, comparison_page)
draw_page.register(ControlComparison, control_page)
draw_page.register(Diagnosis, diagnosis_page)
draw_page.register(Fit, fit_page)
draw_page.register(Sheeted, simulation_page)
draw_page.register(Sweep, sweep_page)

draw_figure.register(Plotted, plots.figure)

draw_summary.register(Celled, notebook.of_cell)
draw_summary.register(Comparison, notebook.of_comparison)
draw_summary.register(Diagnosis, notebook.of_diagnosis)
draw_summary.register(Fit, notebook.of_fit)


@draw_tables.register
def _(comparison: Comparison) -> Sequence[str]:
    return [plain(table) for table in comparison_tables(comparison)]


@draw_tables.register
def _(fit: Fit) -> Sequence[str]:
    return [plain(table) for table in fit_tables(fit)]


@draw_tables.register
def _(one: Listed) -> Sequence[str]:
    return [plain(listed(one.listing()))]

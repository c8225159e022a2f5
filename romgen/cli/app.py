"""The command ``romgen``: one file per subcommand."""

from __future__ import annotations

from typing import Annotated

import typer

import romgen
from romgen.cli.check import check
from romgen.cli.doctor import doctor
from romgen.cli.export import export
from romgen.cli.frc import frc
from romgen.cli.info import info
from romgen.cli.learn import learn
from romgen.cli.report import report
from romgen.cli.run import run
from romgen.cli.sweep import sweep
from romgen.cli.validate import validate

app = typer.Typer(
    name="romgen",
    help="Reduced models of jointed, nonlinear structures, shipped as FMUs.",
    epilog="Exit codes: 0 ok, 2 bad input, 3 numerical failure, 4 acceptance limit missed, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(romgen.__version__)
        raise typer.Exit()


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Reduced models of jointed, nonlinear structures, shipped as FMUs."""


for command in (run, sweep, check, learn, frc, export, validate, report, info, doctor):
    app.command()(command)


def main() -> None:
    """Run the command line."""
    app(prog_name="romgen")

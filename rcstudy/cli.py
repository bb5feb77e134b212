"""The command line. Thin: each command opens what it needs, calls one function, prints, and sets the exit code.

Exit codes: 0 done (all cases solved; cubes the same), 1 cubes differ, 2 bad input, 3 some cases failed,
130 interrupted, 141 the output pipe was closed by its reader.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer

from rcstudy.errors import (
    EXIT_BAD_INPUT,
    EXIT_BROKEN_PIPE,
    EXIT_DIFFERENT,
    EXIT_FAILED_CASES,
    EXIT_INTERRUPTED,
    UserError,
    is_folder_gone,
)
from rcstudy.options import any_path, cube_path, output_path, shard_of, values_of_axes
from rcstudy.storage.steady import interrupts_remembered

if TYPE_CHECKING:
    import xarray as xr

    from rcstudy.sweep import Summary

_OTHER_FORMATS = ".csv .txt .md .tex .yaml .yml .json .png .pdf .svg .jpg .npz .npy .zarr .gz"  # suffixes refused
_SHOWN_FAILURES = 10
_WORKERS_PER_CORE = 2  # at most: more only take memory and time

app = typer.Typer(
    help="Batch parameter studies of rolling contact of bodies with elastic layers.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: the one in boxes shows a type, <bool>, for flags and breaks lines early
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)

_P = ParamSpec("_P")


def _output_option(words: str, metavar: str = "DIR", parser: Callable[[str | Path], Path] = output_path) -> Any:
    return typer.Option("-o", "--output", metavar=metavar, parser=parser, help=words)


SpecPath = Annotated[Path, typer.Argument(metavar="SPEC", parser=any_path, help="Study file (YAML).")]
CubeOption = Annotated[
    Path | None, _output_option("Cube of the study; default: the study file's name with .nc.", "CUBE", cube_path)
]
Unlock = Annotated[
    bool,
    typer.Option("--unlock", help="Continue despite another machine's lock; only if its process is certainly dead."),
]
CubePath = Annotated[Path, typer.Argument(metavar="CUBE", parser=any_path, help="Cube written by sweep (.nc).")]


def _guarded(command: Callable[_P, int | None]) -> Callable[_P, None]:
    """Errors a user can fix become one message and exit code 2, Ctrl-C becomes 130, a returned number the code."""

    @functools.wraps(command)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> None:
        try:
            with interrupts_remembered():  # kernels are loaded also where windows are fitted, before anything is solved
                code = command(*args, **kwargs)
        except UserError as error:
            print(error, file=sys.stderr)
            code = EXIT_BAD_INPUT
        except BrokenPipeError:  # the reader of the output has closed the pipe
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = EXIT_BROKEN_PIPE
        except OSError as error:
            place = error.filename or ("the current folder" if is_folder_gone() else "output")
            print(f"{place}: {error.strerror or error}", file=sys.stderr)
            code = EXIT_BAD_INPUT
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            code = EXIT_INTERRUPTED
        if code:
            raise typer.Exit(code)

    return run


@contextlib.contextmanager
def _opened(
    *paths: Path, tell: Callable[[str], None] | None = None, any_order: bool = False
) -> Iterator[list[xr.DataTree]]:
    """Cubes opened for reading; reports the grids and tables whose numbers were changed after writing.

    `tell` takes the reports, each a line; by default they go to the user. `any_order`: see `open_cube`.
    """
    from rcstudy.check import changes
    from rcstudy.cube import open_cube, reading

    with reading(*paths), contextlib.ExitStack() as stack:
        trees = [stack.enter_context(open_cube(path, any_order=any_order)) for path in paths]
        for path, tree in zip(paths, trees, strict=True):
            for change in changes(tree):
                (tell or _say)(f"{path}: {change}")
        yield trees


def _version(wanted: bool) -> None:
    if wanted:
        import rcstudy

        print(f"rcstudy {rcstudy.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    pass


@app.command()
@_guarded
def sweep(
    context: typer.Context,
    spec: SpecPath,
    output: CubeOption = None,
    workers: Annotated[
        str | None,
        typer.Option(
            metavar="N",
            help="Processes, at most two per processor; default: one per processor, or this one alone if 15 s are "
            "enough for it.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Send the work to a running Dask cluster, given by its scheduler's address."
        ),
    ] = None,
    scheduler_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", parser=any_path, help="The same, given by the file that the scheduler wrote."),
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over: solve all cases, including those already solved.")
    ] = False,
    series: Annotated[
        bool,
        typer.Option(
            "--series",
            help="Start each case from the solution of the nearest creepage (3 to 5 % less time for dense series). "
            "Results then depend on the order of cases: with kalker within the tolerance; with aligned the smaller "
            "traction component was seen to differ by up to 3 % of its largest value, forces by 1e-5.",
        ),
    ] = False,
    shard: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Solve the I-th of N parts only, for a job array; then run rcstudy merge."),
    ] = None,
    unlock: Unlock = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No progress.")] = False,
) -> int:
    """Solve all cases of a study and write them to a cube.

    Rerun the same command to resume: results are kept as they are solved, in the folder CUBE.units until the cube is
    written. Cases that are already solved are not solved again, even if the study has been edited since; failed ones
    are. An existing cube is replaced only when everything has been written.

    Exit codes: 0 all cases are solved, 2 bad input, 3 some are not solved (rcstudy failures CUBE lists them), 130
    interrupted, 141 the output pipe was closed by its reader.
    """
    from rcstudy import progress
    from rcstudy import sweep as sweeping
    from rcstudy.study import load_study
    from rcstudy.workers import cluster, pool

    target = _cube_target(spec, output)
    reporter: progress.Progress = progress.Silent() if quiet else progress.for_stream()
    try:
        done = sweeping.run(
            load_study(spec),
            target,
            workers=None if workers is None else _workers(workers),
            processes=context.obj if isinstance(context.obj, pool.Pool) else None,
            scheduler=cluster.scheduler_at(scheduler, scheduler_file),
            progress=reporter,
            fresh=fresh,
            series=series,
            shard=None if shard is None else shard_of(shard),
            take_over=unlock,
            tell=_say,
        )
    except sweeping.Interrupted as interrupt:
        there = f"{target} is as it was" if target.exists() else f"{target} was not written"
        _say(f"interrupted: {there}; {interrupt}: rerun the same command to resume")
        return EXIT_INTERRUPTED
    except KeyboardInterrupt:  # while the study, or what is solved already, was being read
        _say("interrupted: rerun the same command to resume")
        return EXIT_INTERRUPTED
    return _outcome(done, "" if shard is None else f"shard {shard}: ")


def _cube_target(spec: Path, output: Path | None) -> Path:
    """Path of the cube of a study: `output` if given, else named after the study file.

    UserError if it has no name, or the suffix of another format.
    """
    if output is not None and not output.name:  # -o .
        raise UserError(f"--output: must have the name of a file, such as {spec.stem}.nc")
    target = output if output is not None else Path(f"{spec.stem}.nc")
    if target.suffix.lower() in _OTHER_FORMATS.split():
        raise UserError(f"--output: {target}: a cube is a netCDF file: its name must not end with {target.suffix}")
    return target


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _tell_written(paths: Sequence[Path], folder: Path) -> None:
    from rcstudy.progress import counted

    print(f"{counted(len(paths), 'file')} in {folder}")


def _workers(text: str) -> int:
    from rcstudy.threads import available_cores

    if not re.fullmatch("[0-9]{1,99}", text) or int(text) < 1:
        raise UserError(f"--workers: {text[:40]}: must be a whole number of at least 1")
    workers, cores = int(text), available_cores()
    if workers > cores:
        most = min(workers, _WORKERS_PER_CORE * cores)
        usable = "only 1 processor is" if cores == 1 else f"only {cores} processors are"
        taken = f"; {most} are started, the most allowed" if most < workers else ""
        _say(f"--workers: {text}: {usable} usable here: more workers than that make a sweep slower{taken}")
        return most
    return workers


def _outcome(done: Summary, part: str = "") -> int:
    """Print what a sweep or a merge did; returns the exit code."""
    from rcstudy.progress import duration, in_bytes

    for failure in done.failures[:_SHOWN_FAILURES]:
        word = failure.status.words
        _say(f"{failure.grid}: {failure.label}: {word}: {failure.reason}")
    if done.failed > _SHOWN_FAILURES:
        _say(f"... and {done.failed - _SHOWN_FAILURES} more that are not solved")
    tried = done.cases - done.kept
    each = f" ({duration(done.seconds / tried)} per case)" if done.solved > done.kept else ""
    text = f"{part}{done.solved} of {done.cases} cases solved in {duration(done.seconds)}{each}"
    text += f", {done.kept} of them before" if done.kept else ""
    count, revision = done.otherwise
    if count:
        commit, plus, changes = revision.partition("+")
        text += f" ({count} in a cube that revision {commit[:7]}{plus}{changes} of rcstudy wrote)"
    if part:
        print(f"{text}; run rcstudy merge once all shards are done")
    else:
        print(f"{text}; {done.output}: {in_bytes(done.output.resolve().stat().st_size)}")
        if done.failed:
            _say(
                f"rcstudy failures {quote(str(done.output))} lists the unsolved cases; "
                "-o FOLDER writes each as a study of its own"
            )
    return EXIT_FAILED_CASES if done.failed else 0


@app.command()
@_guarded
def merge(
    spec: SpecPath,
    folders: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FOLDER", parser=any_path, help="Folders of units from elsewhere, besides CUBE.units."),
    ] = None,
    output: CubeOption = None,
    unlock: Unlock = False,
) -> int:
    """Make the cube of a study from the units that its shards wrote; nothing is solved.

    Refused when cases are missing, when a folder holds units of another study or damaged ones, or when two results
    of one case differ. Exit codes as for sweep.
    """
    from rcstudy.merge import merge as merging
    from rcstudy.study import load_study

    return _outcome(merging(load_study(spec), _cube_target(spec, output), folders or [], tell=_say, take_over=unlock))


@app.command()
@_guarded
def status(spec: SpecPath, output: CubeOption = None) -> None:
    """Print how many cases of a study are solved, failed and missing; also while a sweep runs."""
    from rcstudy.status import report
    from rcstudy.study import load_study

    print(report(load_study(spec), _cube_target(spec, output)))


@app.command()
@_guarded
def failures(
    cube: CubePath,
    output: Annotated[
        Path | None, _output_option("Folder for the studies, one file each; default: print them.")
    ] = None,
) -> None:
    """List the unsolved cases of a cube, each as a study of that case alone, ready to run."""
    from rcstudy import failures as failing
    from rcstudy.cube import reading
    from rcstudy.progress import not_solved

    with reading(cube):
        found = failing.failed_cases(cube)
    if output is not None:
        for path in failing.write_studies(found, output):
            print(path)
    else:
        print(failing.listing(found), end="")
    _say(not_solved(len(found)) if found else "all cases are solved")


@app.command()
@_guarded
def plan(spec: SpecPath) -> None:
    """Print what a sweep would do: grids, number of cases, estimated memory, file size and time."""
    from rcstudy.plan import plan_report
    from rcstudy.progress import announced_if_slow
    from rcstudy.study import load_study

    with announced_if_slow(_say, f"{spec}: making its cases, to count them"):
        report = plan_report(load_study(spec))
    print(report)


@app.command()
@_guarded
def show(
    cube: CubePath,
    check: Annotated[
        bool,
        typer.Option("--check", help="Read all fields too, and say what is damaged or missing (exit code 2)."),
    ] = False,
) -> None:
    """Print a summary of a cube. Its numbers are checked; fields, which may be large, only with --check."""
    from rcstudy.check import damage
    from rcstudy.progress import announced_if_slow
    from rcstudy.show import summary

    told: list[str] = []
    with _opened(cube, tell=told.append if check else _say) as (tree,):
        if check:
            with announced_if_slow(_say, f"reading all of {cube}"):
                lines = damage(cube, tree, told)
            if lines:
                raise UserError("\n".join(lines))
        text = summary(tree, checked=check)
    print(text)


@app.command()
@_guarded
def compare(
    cube: CubePath,
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", parser=any_path, help="Cube to compare with.")],
    rtol: Annotated[
        list[str] | None,
        typer.Option(metavar="VARIABLE=VALUE", help="Relative tolerance of one variable; may be repeated."),
    ] = None,
    tolerances: Annotated[
        Path | None,
        typer.Option(metavar="FILE", parser=any_path, help="Tolerances by variable, case (YAML); --rtol comes first."),
    ] = None,
    state_flips: Annotated[
        str | None,
        typer.Option(metavar="N", help="Cells per case that may differ in stick/slip (default 2)."),
    ] = None,
    allow_unsolved: Annotated[
        bool, typer.Option("--allow-unsolved", help="Accept cases that failed with the same status in both cubes.")
    ] = False,
) -> int:
    """Compare a cube with a reference: exit code 0 when they agree, 1 when not.

    Structure, status and missing values must be the same. Unless tolerances say otherwise, fields may differ by 1e-6 of
    their largest magnitude in the case, numbers by 1e-6 of their own value (forces and moment: of the largest of them).
    Settings may differ by 1e-9, whatever the tolerances.
    """
    from rcstudy import compare as comparing
    from rcstudy.tolerances import Tolerances, load_tolerances, parse_flips, parse_options

    allowed = Tolerances() if tolerances is None else load_tolerances(tolerances)
    flips = None if state_flips is None else parse_flips(state_flips)
    allowed = allowed.with_options(parse_options(rtol or ()), flips)
    with _opened(cube, reference, any_order=True) as (ours, theirs):
        outcome = comparing.compare(ours, theirs, allowed, allow_unsolved=allow_unsolved)
    print(outcome.text())
    return 0 if outcome.same else EXIT_DIFFERENT


@app.command()
@_guarded
def figures(
    cube: CubePath,
    output: Annotated[Path, _output_option("Folder for the figures.")] = Path("figures"),
    formats: Annotated[
        str, typer.Option("--formats", metavar="LIST", help="File formats, of png, pdf and svg, separated by commas.")
    ] = "png,pdf",
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUE",
            help="Value of an axis that a grid's figures show in place of all or the first; may be repeated.",
        ),
    ] = None,
    along: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="Axis of numbers along which curves are drawn; default: a creepage, or the axis with most values.",
        ),
    ] = None,
    quantities: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What curves show, separated by commas: force_x/load, friction_power, traction_max and others.",
        ),
    ] = None,
) -> None:
    """Draw the figures of a cube."""
    from rcstudy.figures import make_figures
    from rcstudy.report.quantities import QUANTITIES, chosen

    if along == "":
        raise UserError("--along: must not be empty: give the name of an axis")
    wanted = tuple(word.strip() for word in formats.split(","))
    shown = tuple(QUANTITIES) if quantities is None else chosen(quantities)
    with _opened(cube) as (tree,):
        written = make_figures(tree, output, wanted, values_of_axes(at or ()), along or "", shown)
    _tell_written(written, output)


@app.command()
@_guarded
def tables(cube: CubePath, output: Annotated[Path, _output_option("Folder for the tables.")] = Path("tables")) -> None:
    """Write the tables of a cube as CSV, Markdown and LaTeX."""
    from rcstudy.tables import make_tables

    with _opened(cube) as (tree,):
        written = make_tables(tree, output)
    _tell_written(written, output)


@app.command()
@_guarded
def accuracy(
    spec: SpecPath,
    output: Annotated[Path, _output_option("Folder for the report.")] = Path("results/accuracy"),
    cube: Annotated[
        Path | None, typer.Option("--cube", metavar="CUBE", parser=any_path, help="Its cube; default: solve the study.")
    ] = None,
) -> int:
    """Measure the errors of a study over meshes, tolerances and methods, and the cost of each."""
    from rcstudy import accuracy as measuring
    from rcstudy import progress
    from rcstudy import sweep as sweeping
    from rcstudy.study import load_study

    study, reporter = load_study(spec), progress.for_stream()
    if cube is None:
        try:
            written = measuring.run(study, output, progress=reporter)
        except sweeping.Interrupted as interrupt:
            _say(f"interrupted: {interrupt}: rerun the same command to resume")
            return EXIT_INTERRUPTED
    else:
        with _opened(cube) as (tree,):
            written = measuring.run(study, output, tree)
    _tell_written(written, output)
    return 0

"""`tvist study FILE`: run a study of one's own, a TOML file of a sweep or a Python file."""

from pathlib import Path

from tvist_cli import kept
from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import typed
from tvist_cli.study_names import STUDY
from tvist_cli.studying import Figures, Places


def file(
    file: Path,
    *,
    output: Path | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    look: FigureOptions = AS_USUAL,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Run a study: one that comes with the package, by its name, or one of your own, from a file.

    A TOML file is a sweep, as for tvist study sweep. A Python file contains STUDY = Study(...): every method makes
    every case. Rows are kept in a folder as they come, so that the same command continues where it was interrupted; it
    repeats what had failed. At the end sweep.parquet in that folder holds all rows, and study.png shows them.

    Args:
        file: TOML or Python file.
        output: Folder for the rows [that of the file, with its name but without the suffix].
        processes: Number of processes on this machine [one for each core].
        scheduler: Address of a Dask scheduler whose workers to use instead, such as tcp://HOST:8786.
        look: How to write the figure.
        report: File to write a web page with table and figure to; for Python files.
        json: Print one JSON object.
    """
    if not file.suffix and not file.exists():
        raise Failure(f"there is no study {file}: give a file, or one of {', '.join(STUDY)}", code=2)
    if file.suffix != ".py":
        from tvist_cli.commands.study.sweep import sweep

        if report is not None:
            raise Failure("--report is for a study in a Python file", code=2)
        sweep(file, output=output, processes=processes, scheduler=scheduler, look=look, json=json)
        return
    from tvist_lab.figures import study_figure
    from tvist_lab.report import study_page
    from tvist_lab.study.study import ENDS, StudyError, read_study
    from tvist_lab.words import MANY

    places = Places(report=report)
    folder = kept.folder_of(file, output, processes, scheduler, look)
    places.check()
    with told(StudyError, OSError):
        study = read_study(file)
    rows, about = kept.run(study.plan(), folder, processes, scheduler)
    result = {
        "study": str(file),
        "title": study.title,
        "notes": study.notes,
        **about,
        "summary": study.summary(rows),
    }
    few = min(entry["rows"] for entry in result["summary"]) < MANY
    on_pages = {**result, "summary": study.summary(rows, ENDS)} if few else result

    def draw() -> Figures:
        return {"study": study_figure(on_pages["summary"], study.by, study.show)}

    with told(OSError), look.into(folder) as save:
        result["figure"] = str(save(draw()["study"], "study"))
    places.write(
        result,
        draw=draw,
        web_page=lambda drawn: study_page(study, on_pages, drawn, typed()),
    )
    entries = result["summary"]
    kept.tell(result, entries, study.shown(entries), json=json, title=f"{study.title}: ")

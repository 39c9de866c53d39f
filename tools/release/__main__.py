"""`python -m tools.release`: prepares and checks releases; docs/how-to/release.md has the procedure."""

import argparse
import datetime as dt
import hashlib
import sys
import tempfile
from pathlib import Path

from tools.release.changelog import notes
from tools.release.compiled import compiled_wheel
from tools.release.environments import FailedError
from tools.release.prepare import check, prepare
from tools.release.rehearse import rehearse
from tools.release.versions import ReleaseError, common_version

ROOT = Path(__file__).parents[2]
NEXT = """version {version} is in all distributions and, with a date, in CHANGELOG.md and CITATION.cff. Next:

  TURN= .ci/run && make rehearse
  git commit --all --message "Version {version}"
  git tag --annotate v{version} --message "Version {version}"
  git push --follow-tags
"""


def main() -> int:
    """Do what the arguments say; return 0, or 1 after a sentence on what is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tools.release", description=__doc__)
    parser.add_argument("--root", type=Path, default=ROOT, help="Folder of the checkout.")
    verbs = parser.add_subparsers(dest="verb", required=True)
    preparing = verbs.add_parser("prepare", help="Write a version and today's date where they belong.")
    preparing.add_argument("version", help="Version to release, X.Y.Z.")
    checking = verbs.add_parser("check", help="Check that all distributions have one version; print it.")
    checking.add_argument("--tag", help="Also check that it is that of this tag, and has a dated changelog.")
    verbs.add_parser("notes", help="Print what the changelog says about the version.")
    summing = verbs.add_parser("checksums", help="Write SHA256SUMS beside the built files.")
    summing.add_argument("folder", type=Path, help="Folder with the files.")
    compiling = verbs.add_parser("compiled", help="Add wheels with machine code for some Pythons.")
    compiling.add_argument("folder", type=Path, help="Folder with the built files.")
    compiling.add_argument("python", nargs="+", help="A Python, such as python3.12.")
    rehearsing = verbs.add_parser("rehearse", help="Make and try all that a release makes; publish nothing.")
    rehearsing.add_argument("--json", action="store_true", help="Print one JSON object.")
    given = parser.parse_args()
    try:
        match given.verb:
            case "prepare":
                today = dt.datetime.now(tz=dt.UTC).date().isoformat()
                prepare(given.root, given.version, today)
                print(NEXT.format(version=given.version), end="")
            case "check":
                print(check(given.root, given.tag))
            case "notes":
                print(notes(given.root, common_version(given.root)), end="")
            case "checksums":
                print(checksums(given.folder), end="")
            case "compiled":
                for python in given.python:
                    wheel = compiled_wheel(given.root, given.folder.resolve(), python)
                    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB", flush=True)
            case "rehearse":
                with tempfile.TemporaryDirectory(prefix="tvist-release-") as folder:
                    return 0 if rehearse(given.root, Path(folder), as_json=given.json) else 1
    except (FailedError, ReleaseError) as error:
        print(f"tools.release: {error}", file=sys.stderr)
        return 1
    return 0


def checksums(folder: Path) -> str:
    """Write the SHA-256 of each file of a folder into its SHA256SUMS, as sha256sum --check reads it; return it.

    Raises:
        ReleaseError: There is no file.
    """
    files = sorted(path for path in folder.glob("*") if path.is_file() and path.name != "SHA256SUMS")
    if not files:
        raise ReleaseError(f"{folder} has no files: run make dist first")
    text = "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
    (folder / "SHA256SUMS").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    sys.exit(main())

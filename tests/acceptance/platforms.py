"""Print which distributions install from wheels alone, by Python and platform, for docs/reference/platforms.md.

    python tests/acceptance/platforms.py [--uv PROGRAM]

It needs uv, which resolves for other machines than this one; the versions are those of requirements.lock.
"""

import argparse
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
PLATFORMS = {
    "Linux, x86-64": "x86_64-unknown-linux-gnu",
    "Linux, arm64": "aarch64-unknown-linux-gnu",
    "macOS, arm64": "aarch64-apple-darwin",
    "Windows, x86-64": "x86_64-pc-windows-msvc",
}
WHATS = ("tvist", "tvist[server]", "tvist[lab]", "tvist[view]", "tvist[dev]")
PURE = ("forbiddenfruit",)  # packages without any wheel whose source is Python alone


def missing(uv, what, python, platform):
    """Return a package that has no wheel; empty if all have one."""
    extra = what.partition("[")[2].rstrip("]")
    ended = subprocess.run(
        [
            uv, "pip", "compile", "--quiet", "--python-version", python, "--python-platform", platform,
            "--only-binary", ":all:", *(word for name in PURE for word in ("--no-binary", name)),
            *(("--extra", extra) if extra else ()), "--constraint", "requirements.lock", "pyproject.toml"
        ],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode == 0:
        return ""
    _, because, rest = ended.stderr.partition("Because ")
    return rest.split("==")[0].split()[0] if because else ended.stderr.strip()


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--uv", default="uv", help="the program uv [uv]")
    uv = parser.parse_args().uv
    print("| what | Python |", " | ".join(PLATFORMS), "|")
    print("|---|---|", "---|" * len(PLATFORMS), sep="")
    for what in WHATS:
        for python in PYTHONS:
            found = [missing(uv, what, python, platform) for platform in PLATFORMS.values()]
            cells = [f"no wheel of {name}" if name else "yes" for name in found]
            print(f"| `{what}` | {python} |", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    main()

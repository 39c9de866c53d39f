"""The distributions: what is in each, and that one command installs it where nothing else is."""

import functools
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest
from pathspec import PathSpec
from tests.conformance.served import PATIENCE, Served
from tests.fences import fences
from tools.release import environments
from tools.release.environments import clean


def runs(program):
    """Whether there is a program that runs: pyenv, for one, leaves programs that only say where they would be."""
    if shutil.which(program) is None:
        return False
    return subprocess.run([program, "-c", ""], capture_output=True, check=False).returncode == 0


ROOT = Path(__file__).parents[2]
FOLDERS = {
    "tvist-protocol": "protocol",
    "tvist-shaping": "shaping",
    "tvist-urscript": "urscript",
    "tvist": ".",
}
PYTHONS = [version for version in ("3.11", "3.12", "3.13") if runs(f"python{version}")]
"""Those that this machine has: with pyenv, those that `PYENV_VERSION` lists."""
CLIENT_KIB = 47 * 1000**2 // 1024
"""Of this 1 MB is the page of `tvist lesson`, which is one file that needs nothing else."""


def project(folder):
    return tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def run(*words, cwd=ROOT / "docs"):
    return environments.run(*words, cwd=cwd, env=clean(), seconds=PATIENCE)


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """The folder that `make dist` would fill."""
    return build(ROOT, tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def image_wheels(tmp_path_factory):
    """The folder of the wheels that an image installs, built from the files that its build context has."""
    context = tmp_path_factory.mktemp("context")
    ignored = PathSpec.from_lines("gitignore", (ROOT / ".dockerignore").read_text().splitlines())
    for name in ignored.match_files(run("git", "ls-files", cwd=ROOT).splitlines(), negate=True):
        (context / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, context / name)
    return build(context, tmp_path_factory.mktemp("image"))


def build(root, made):
    """Build the wheel of each distribution below a folder."""
    for folder in FOLDERS.values():
        run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", made, cwd=root / folder)
    return made


@pytest.fixture
def fresh(tmp_path, wheels):
    """Install what a line names into an environment of its own, for a Python of this machine; its python."""
    return functools.partial(install, tmp_path, wheels)


@pytest.fixture(scope="module")
def client(tmp_path_factory, wheels):
    """The python of an environment with `tvist`, without extras."""
    return install(tmp_path_factory.mktemp("client"), wheels, "tvist")


def install(folder, wheels, what, version=None):
    base = sys.executable if version is None else f"python{version}"
    run(base, "-m", "venv", folder / "venv")
    python = folder / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", "--find-links", wheels, what)
    return python


def imports(python, name):
    return subprocess.run([python, "-c", f"import {name}"], capture_output=True, check=False).returncode == 0


class TestContents:
    def test_each_package_is_in_one_wheel(self, wheels):
        found = [
            name.split("/")[0]
            for wheel in wheels.glob("*.whl")
            for name in zipfile.ZipFile(wheel).namelist()
            if name.count("/") == 1 and name.endswith("/__init__.py")
        ]
        assert len(found) == len(set(found))
        assert set(found) == {folder.name for folder in ROOT.glob("*/tvist_*") if folder.is_dir()}

    def test_no_wheel_holds_what_is_made_or_is_for_the_checkout(self, wheels):
        for wheel in wheels.glob("*.whl"):
            names = zipfile.ZipFile(wheel).namelist()
            assert not [name for name in names if re.search(r"__pycache__|\.(nbc|nbi|mcap)$|^tests/", name)]
            assert [name for name in names if name.endswith("licenses/NOTICE")]
            assert [name for name in names if name.endswith("py.typed")]

    def test_an_image_is_built_from_the_same_files(self, wheels, image_wheels):
        def files(folder):
            every = [zipfile.ZipFile(wheel).infolist() for wheel in folder.glob("*.whl")]
            return {info.filename: info.CRC for infos in every for info in infos}

        assert files(image_wheels) == files(wheels)

    @pytest.mark.parametrize("name", FOLDERS)
    def test_each_has_its_name_the_common_version_and_licence(self, name):
        own, common = project(FOLDERS[name]), project(".")
        assert own["name"] == name
        for key in ("version", "license", "requires-python"):
            assert own[key] == common[key]
        for file in ("LICENSE", "NOTICE"):
            assert (ROOT / FOLDERS[name] / file).read_text() == (ROOT / file).read_text()

    def test_our_own_are_asked_for_in_the_same_version(self):
        common = project(".")
        asked = [common["dependencies"], *common["optional-dependencies"].values()]
        ours = [line for lines in asked for line in lines if line.startswith("tvist-")]
        assert len(ours) == 3
        assert all(line.endswith(f"=={common['version']}") for line in ours)


@pytest.mark.nightly
class TestFresh:
    @pytest.mark.parametrize("name", ["tvist-protocol", "tvist-shaping", "tvist-urscript"])
    def test_the_readmes_first_examples_run(self, fresh, name):
        python = fresh(name)
        readme = (ROOT / FOLDERS[name] / "README.md").read_text(encoding="utf-8")
        examples = [text for kind, text in fences(readme) if kind == "pycon"]
        first = python.parents[2] / "first.txt"
        first.write_text(examples[0], encoding="utf-8")
        run(python, "-m", "doctest", first)
        assert not imports(python, "zenoh")
        assert imports(python, "numpy") == (name == "tvist-shaping")

    def test_the_client_is_light_and_moves_a_robot(self, client):
        assert not imports(client, "numpy")
        site = Path(run(client, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
        tools = {"pip", "setuptools", "pkg_resources", "_distutils_hack"}
        files = [path for path in site.rglob("*") if path.is_file()]
        ours = [path for path in files if path.relative_to(site).parts[0].split("-")[0] not in tools]
        assert sum(path.stat().st_size for path in ours) / 1024 < CLIENT_KIB
        readme = (ROOT / "clients" / "README.md").read_text(encoding="utf-8")
        blocking = next(text for kind, text in fences(readme) if "tvist_client.blocking" in text)
        with Served("--clock", "lockstep") as served:
            assert "ok" in run(client, "-m", "tvist_client", "check", served.endpoint)
            program = blocking.replace("tcp/127.0.0.1:7447", served.endpoint)
            assert re.fullmatch(r"\d+ \d+\n", run(client, "-c", program))

    def test_a_robot_of_an_image_answers(self, image_wheels, tmp_path):
        venv = tmp_path / "venv"
        run(sys.executable, "-m", "venv", "--without-pip", venv)
        python, site = venv / "bin" / "python", Path(sysconfig.get_path("purelib"))
        wheels = image_wheels.glob("*.whl")
        run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", *wheels)
        own = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
        # The libraries are those of this environment, whose path files, and so the checkout, are not followed.
        (own / "libraries.pth").write_text(
            f"{site}\n{site / 'cmeel.prefix' / site.relative_to(sys.prefix)}\n"
        )
        with Served("--clock", "lockstep", python=python) as served:
            assert "ok" in run(python, "-m", "tvist_client", "check", served.endpoint)

    def test_the_program_says_what_to_install(self, client):
        ended = subprocess.run(
            [client.parent / "tvist", "serve"], capture_output=True, text=True, check=False
        )
        assert ended.returncode == 1
        assert ended.stderr.count("\n") == 1
        assert "tvist[server]" in ended.stderr


@pytest.mark.nightly
class TestExtras:
    """Each with all that it brings, hundreds of megabytes, in every Python that this machine has."""

    @pytest.mark.parametrize("version", PYTHONS)
    def test_the_server_serves(self, fresh, version):
        python = fresh("tvist[server]", version)
        assert not imports(python, "scipy")
        assert not imports(python, "matplotlib")
        run(python, "-m", "tvist_cli", "run", ROOT / "clients" / "examples" / "wave.script", "--lockstep")

    @pytest.mark.parametrize("version", PYTHONS)
    def test_the_laboratory_measures(self, fresh, version, tmp_path):
        python = fresh("tvist[lab]", version)
        run(python, "-m", "tvist_cli", "demo", "--runs", "1", "--no-baselines", cwd=tmp_path)

    @pytest.mark.parametrize("version", PYTHONS)
    def test_the_view_draws(self, fresh, version):
        python = fresh("tvist[view]", version)
        assert "--magnify" in run(python, "-m", "tvist_cli", "view", "--help")
        run(python, "-c", "import tvist_view.live")

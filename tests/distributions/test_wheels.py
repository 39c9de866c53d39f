"""The distributions: their contents, and their installation into a new environment."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from pathspec import PathSpec
from tests.conformance.served import PATIENCE, Served
from tests.fences import fences
from tools.release import environments
from tools.release.environments import clean

ROOT = Path(__file__).parents[2]
FOLDERS = {f"tvist-{folder}": folder for folder in ("protocol", "shaping", "urscript")} | {"tvist": "."}
CLIENT_KIB = 47 * 1000**2 // 1024
"""Largest size of an installed client; 1 MB is the page of `tvist lesson`."""


def project(folder):
    return tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def run(*words, cwd=ROOT / "docs"):
    return environments.run(*words, cwd=cwd, env=clean(), seconds=PATIENCE)


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Folder with the wheels of `make dist`."""
    return build(ROOT, tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def image_wheels(tmp_path_factory):
    """Folder with the wheels of an image, built from the files of its build context."""
    context = tmp_path_factory.mktemp("context")
    ignored = PathSpec.from_lines("gitignore", (ROOT / ".dockerignore").read_text().splitlines())
    for name in ignored.match_files(run("git", "ls-files", cwd=ROOT).splitlines(), negate=True):
        (context / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, context / name)
    return build(context, tmp_path_factory.mktemp("image"))


def build(root, made):
    """Build the wheel of each distribution; return their folder."""
    for folder in FOLDERS.values():
        run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", made, cwd=root / folder)
    return made


@pytest.fixture
def fresh(tmp_path, wheels):
    """Return a function that installs a requirement into a new environment and returns its Python."""

    def install(what, base=sys.executable):
        run(base, "-m", "venv", tmp_path / "venv")
        python = tmp_path / "venv" / "bin" / "python"
        run(python, "-m", "pip", "install", "--quiet", "--find-links", wheels, what)
        return python

    return install


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

    def test_wheels_have_licence_and_types_but_no_generated_files_or_tests(self, wheels):
        for wheel in wheels.glob("*.whl"):
            names = zipfile.ZipFile(wheel).namelist()
            assert not [name for name in names if re.search(r"__pycache__|\.(nbc|nbi|mcap)$|^tests/", name)]
            assert [name for name in names if name.endswith("licenses/NOTICE")]
            assert [name for name in names if name.endswith("py.typed")]

    def test_wheels_of_the_image_have_the_same_files(self, wheels, image_wheels):
        def files(folder):
            every = [zipfile.ZipFile(wheel).infolist() for wheel in folder.glob("*.whl")]
            return {info.filename: info.CRC for infos in every for info in infos}

        assert files(image_wheels) == files(wheels)

    def test_distributions_share_version_and_licence_and_require_that_version(self):
        common = project(".")
        for name, folder in FOLDERS.items():
            own = project(folder)
            assert own["name"] == name
            assert all(own[key] == common[key] for key in ("version", "license", "requires-python"))
            for file in ("LICENSE", "NOTICE"):
                assert (ROOT / folder / file).read_text() == (ROOT / file).read_text()
        asked = [common["dependencies"], *common["optional-dependencies"].values()]
        ours = [line for lines in asked for line in lines if line.startswith("tvist-")]
        assert len(ours) == 3
        assert all(line.endswith(f"=={common['version']}") for line in ours)


@pytest.mark.nightly
class TestFresh:
    @pytest.mark.parametrize("name", ["tvist-protocol", "tvist-shaping", "tvist-urscript"])
    def test_first_examples_of_the_readmes_run(self, fresh, name):
        python = fresh(name)
        readme = (ROOT / FOLDERS[name] / "README.md").read_text(encoding="utf-8")
        examples = [text for kind, text in fences(readme) if kind == "pycon"]
        first = python.parents[2] / "first.txt"
        first.write_text(examples[0], encoding="utf-8")
        run(python, "-m", "doctest", first)
        assert not imports(python, "zenoh")
        assert imports(python, "numpy") == (name == "tvist-shaping")

    def test_client_is_small_and_moves_a_robot(self, fresh):
        client = fresh("tvist")
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
        command = [client, "-m", "tvist_cli", "serve"]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stderr.count("\n")) == (1, 1)
        assert "tvist[server]" in ended.stderr


@pytest.mark.nightly
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_server_laboratory_and_view_install_on_each_python(fresh, version, tmp_path):
    """They download hundreds of megabytes. pyenv offers the versions in `PYENV_VERSION`."""
    base = shutil.which(f"python{version}")
    if base is None or subprocess.run([base, "-c", ""], capture_output=True, check=False).returncode != 0:
        pytest.skip(f"there is no Python {version}")
    python = fresh("tvist[server]", base)
    assert not imports(python, "scipy")
    assert not imports(python, "matplotlib")
    run(python, "-m", "tvist_cli", "run", ROOT / "clients" / "examples" / "wave.script", "--lockstep")
    fresh("tvist[lab,view]", base)
    run(python, "-m", "tvist_cli", "demo", "--runs", "1", "--no-baselines", cwd=tmp_path)
    run(python, "-c", "import tvist_view.live")

"""Commands do not import modules from the working folder."""

import os
import subprocess
import sys

import polars as pl

SHADOW = "import pathlib\npathlib.Path(__file__).with_name('ran').touch()\nraise SystemExit('no module')\n"


def test_recording_is_read_in_a_folder_with_modules_of_the_same_names(tmp_path):
    columns = {"timestamp": [0.0, 0.002, 0.004], "actual_q_0": [0.0, 0.0, 0.0]}
    pl.DataFrame(columns).write_parquet(tmp_path / "run.parquet")
    for name in ("polars", "numpy", "tvist_lab"):
        (tmp_path / f"{name}.py").write_text(SHADOW)
    # The program runs with -P, too.
    command = [sys.executable, "-P", "-m", "tvist_cli", "log", "export", "run.parquet", "--to", "csv"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    ended = subprocess.run(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, check=False)
    assert not (tmp_path / "ran").exists()
    assert ended.returncode == 0, ended.stderr

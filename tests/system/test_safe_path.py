"""Working in somebody else's folder does not run what is in it."""

import os
import subprocess
import sys

import polars as pl

SHADOW = "import pathlib\npathlib.Path(__file__).with_name('ran').touch()\nraise SystemExit('no module')\n"


def test_a_recording_is_read_in_a_folder_with_modules_of_others(tmp_path):
    columns = {"timestamp": [0.0, 0.002, 0.004], "actual_q_0": [0.0, 0.0, 0.0]}
    pl.DataFrame(columns).write_parquet(tmp_path / "run.parquet")
    for name in ("polars", "numpy", "tvist_lab"):
        (tmp_path / f"{name}.py").write_text(SHADOW)
    ended = subprocess.run(
        [sys.executable, "-P", "-m", "tvist_cli", "log", "analyze", "run.parquet"],  # as the program does
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert not (tmp_path / "ran").exists()
    assert ended.returncode == 0, ended.stderr

"""Cell files: invalid ones are refused with key, value and limit; valid ones give tool and payload."""

import re
from pathlib import Path

import pytest

from tvist_controller.cell.description import CellWire, GripperModel, Tool, Workpiece
from tvist_controller.setup import Setup
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError

EXAMPLE = Path(__file__).parents[2] / "clients" / "examples" / "cell.toml"
PAGE = (EXAMPLE.parents[2] / "docs" / "how-to" / "serve-a-cell.md").read_text(encoding="utf-8")
GOOD = EXAMPLE.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("standard 3", "standard 9", "wires[0].input is 'standard 9': must be one of 'standard 0'"),
        ("after = 0.4", "after = -1", "wires[0].after is -1: must be at least 0"),
        ("[[tools]]", '[[wires]]\noutput="tool 0"\ninput="standard 3"\n[[tools]]', "that of wires[0]"),
        ("mass = 0.92", "mass = 0.92\nmas = 1", "tools[0] has no field 'mas': did you mean 'mass'?"),
        ("mass = 0.92", "mass = 0.92\ninertia = [1, 0, 0, 1, 0, 9]", "tools[0].inertia is [1.0"),
        ("tcp =", 'while_on = "tool 0"\ntcp =', "tools[0].while_on must be left out"),
        ("[gripper]", GOOD[GOOD.index("[[tools]]") : GOOD.index("[gripper]")] + "[gripper]", "tools[1].while_on is"),
        ('model = "2F-85"', 'model = "2F-90"', "gripper.model is '2F-90': must be one of '2F-85', '2F-140'"),
        ('model = "2F-85"', 'model = "2F-85"\ntool = "x"', "gripper.tool is 'x': must be one of 2F-85"),
        ('[gripper]\nmodel = "2F-85"', "", "parts need a gripper"),
        ("0.06, 0.05", "0.06, 0.09", "parts[0].size[1] is 0.09: must be less than 0.085 m"),
        ('"box 2"', '"box 1"', "parts[1].name is 'box 1': must differ from the name of parts[0]"),
        ("mass = 0.4\n", "", "parts[0].mass is missing"),
        ("[-0.45, -0.3", "[nan, -0.3", "parts[0].pose[0] is NaN"),
        ("[[wires]]", "[[wires]", "not valid TOML"),
    ],
)  # fmt: skip
def test_an_invalid_cell_file_is_refused_with_key_value_and_limit(tmp_path, right, wrong, said):
    assert right in GOOD
    file = tmp_path / "cell.toml"
    file.write_text(GOOD.replace(right, wrong, 1), encoding="utf-8")
    with pytest.raises(StartError) as refused:
        ServeConfig(cell=str(file)).setup()
    assert said in str(refused.value)
    assert str(file) in str(refused.value)


def test_the_first_tool_is_carried_and_declared_unless_a_payload_is_given():
    plain, other = ServeConfig(cell=str(EXAMPLE)).setup(), ServeConfig(cell=str(EXAMPLE), payload=2.0).setup()
    assert (plain.payload.mass, plain.carried.mass) == (0.92, 0.92)
    assert (other.payload.mass, other.carried.mass) == (2.0, 0.92)


def test_the_cell_is_recorded_completely():
    setup = ServeConfig(cell=str(EXAMPLE), clock="lockstep").setup()
    assert Setup.from_builtins(setup.to_builtins()).cell == setup.cell
    assert "cell" not in ServeConfig().setup().to_builtins()


def test_the_example_in_the_guide_is_valid_and_the_guide_lists_all_keys(tmp_path):
    file = tmp_path / "cell.toml"
    file.write_text(re.search(r"```toml\n(.*?)```", PAGE, re.DOTALL)[1], encoding="utf-8")
    assert ServeConfig(cell=str(file)).setup().cell.gripper is not None
    rows = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    keys = [kind.__struct_fields__ for kind in (CellWire, Tool, GripperModel, Workpiece)]
    assert set(re.findall(r"`(\w+)`", " ".join(rows))) == {key for some in keys for key in some}

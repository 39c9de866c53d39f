"""What is made from the types is up to date, valid, and complete."""

import doctest
import json
import subprocess
import sys
from typing import get_args

import jsonschema
import msgspec
import pytest

from tvist_protocol import CODE_MEANINGS, EVENT_MEANINGS, Code, EventKind
from tvist_protocol.channels import COMMANDS, MESSAGES, tag
from tvist_protocol.commands import Setpoint
from tvist_protocol.generate import FOLDER, generated, golden, stray
from tvist_protocol.info import CalibrationInfo, Limits, StopReason
from tvist_protocol.io import Registers
from tvist_protocol.schema import field_docs, json_schema
from tvist_protocol.simulation import StepSetpoint
from tvist_protocol.values import Payload

STRUCTS = (*MESSAGES, Payload, Registers, StepSetpoint, Limits, StopReason, CalibrationInfo)
INPUT = (*COMMANDS, Setpoint, Payload, StepSetpoint)


def test_every_generated_file_is_up_to_date():
    files = generated(FOLDER)
    stale = [
        path.name for path, content in files.items() if not path.exists() or path.read_bytes() != content
    ]
    assert not stale, f"run `python -m tvist_protocol.generate`: {stale}"
    assert not stray(FOLDER, files)


@pytest.mark.parametrize("kind", STRUCTS, ids=lambda kind: kind.__name__)
def test_every_field_has_a_description(kind):
    docs = field_docs(kind)
    assert tuple(docs) == kind.__struct_fields__
    assert all(text.endswith(".") for text in docs.values())
    assert kind.__doc__


def parts(part):
    match part:
        case msgspec.inspect.Field(type=inner):
            yield from parts(inner)
        case msgspec.inspect.UnionType(types=inner) | msgspec.inspect.TupleType(item_types=inner):
            for entry in inner:
                yield from parts(entry)
        case msgspec.inspect.VarTupleType(item_type=inner):
            yield part
            yield from parts(inner)
        case _:
            yield part


@pytest.mark.parametrize("kind", INPUT, ids=lambda kind: kind.__name__)
def test_every_number_text_and_list_a_client_sends_is_bounded(kind):
    for field in msgspec.inspect.type_info(kind).fields:
        for part in parts(field):
            match part:
                case msgspec.inspect.FloatType() | msgspec.inspect.IntType():
                    assert (part.ge, part.gt) != (None, None), field.name
                    is_uint64 = isinstance(part, msgspec.inspect.IntType) and field.name == "sequence"
                    assert is_uint64 or (part.le, part.lt) != (None, None), field.name
                case msgspec.inspect.StrType():
                    assert part.max_length or part.pattern, field.name
                case msgspec.inspect.VarTupleType():
                    assert part.max_length, field.name


@pytest.mark.parametrize("kind", INPUT, ids=lambda kind: kind.__name__)
def test_messages_of_clients_forbid_unknown_fields(kind):
    assert kind.__struct_config__.forbid_unknown_fields
    assert kind.__struct_config__.frozen


def test_every_code_and_every_kind_of_event_has_a_meaning():
    assert tuple(CODE_MEANINGS) == get_args(Code)
    assert tuple(EVENT_MEANINGS) == get_args(EventKind)


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_a_schema_is_valid_and_accepts_its_golden_messages(kind):
    schema = json_schema(kind)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    values = [json.loads(path.read_bytes()) for path in golden(FOLDER)]
    fitting = [value for value in values if value["type"] == tag(kind)]
    assert fitting
    for value in fitting:
        validator.validate(value)


def test_the_readmes_examples_run():
    results = doctest.testfile(str(FOLDER / "README.md"), module_relative=False)
    assert results.attempted > 3
    assert results.failed == 0


def test_the_package_imports_no_network_clock_or_numpy():
    program = "import sys, tvist_protocol; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numpy", "zenoh", "asyncio", "socket", "logging", "msgpack", "tvist_server"} & set(loaded)

"""`python -m tvist_protocol.generate`: writes what is made from the message types: pages, schemas, golden bytes.

The `msgpack` package encodes golden bytes, because they must not come from the codec that they test.
"""

import json
from collections.abc import Iterable
from pathlib import Path

from tvist_protocol.channels import MESSAGES, tag
from tvist_protocol.pages import pages
from tvist_protocol.schema import json_schema

FOLDER = Path(__file__).parents[1]  # `protocol/` in a checkout
PAGES = FOLDER.parent / "docs" / "reference" / "generated"  # folder of the generated pages in a checkout


def generated(folder: Path) -> dict[Path, bytes]:
    """Return the content of every generated file, by its path."""
    import msgpack

    files = {PAGES / name: text.encode() for name, text in pages().items()}
    for kind in MESSAGES:
        text = json.dumps(json_schema(kind), indent=2, ensure_ascii=False)
        files[folder / "schemas" / f"{tag(kind)}.json"] = f"{text}\n".encode()
    for source in golden(folder):
        files[source.with_suffix(".msgpack")] = msgpack.packb(json.loads(source.read_bytes()))
    return files


def stray(folder: Path, files: Iterable[Path]) -> set[Path]:
    """Return files in folders of generated files that are no longer generated, such as removed messages'."""
    return {*(folder / "schemas").iterdir(), *(folder / "fixtures" / "v1").glob("*.msgpack")} - set(files)


def golden(folder: Path) -> list[Path]:
    """Return the files with golden messages (JSON written by hand)."""
    return sorted((folder / "fixtures" / "v1").glob("*.json"))


def main() -> None:
    """Write every generated file, and remove those that `stray` returns."""
    files = generated(FOLDER)
    for path in stray(FOLDER, files):
        path.unlink()
    for path, content in files.items():
        path.write_bytes(content)


if __name__ == "__main__":
    main()

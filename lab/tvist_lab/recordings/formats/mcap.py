"""Read recordings of this controller, and rosbags in MCAP."""

from pathlib import Path

from tvist_lab.recordings import mcap_file
from tvist_lab.recordings.mcap_records import MAGIC
from tvist_lab.recordings.recording import Recording
from tvist_lab.recordings.table import LogTable, reader


@reader(".mcap", MAGIC)
def read_mcap(path: Path) -> Recording | LogTable:
    """Read a file, or the segments that a folder or pattern names."""
    try:
        content = mcap_file.read_checked(path)
    except mcap_file.RecordingFileError as error:
        from tvist_lab.recordings.rosbag import has_ros, read_rosbag

        if not path.is_file() or not has_ros(path):
            raise error from None
        return read_rosbag(path)
    recording = content.recording
    return recording if content.note is None else recording.noted(content.note.removeprefix(f"{path} "))

"""Columns of logs by other vendors' names, which are recognised without a map.

Only names that the source of a program which writes them shows are listed. xArm, Fanuc and others document what their
controllers send, but no file with a header.
"""

from collections.abc import Sequence

from tvist_lab.recordings.named_columns import entry_of

VENDORS = {
    # franka::logToCSV, github.com/frankaemika/libfranka, src/log.cpp
    "Franka's libfranka": "q=state.q[{}]:rad,target_q=state.q_d[{}]:rad,qd=state.dq[{}],target_qd=state.dq_d[{}]",
    # AccelQueryHelper.write_to_file, github.com/Klipper3d/klipper, klippy/extras/adxl345.py
    "Klipper's accelerometers": "time=time,accelerometer=accel_{}:mm/s2",
    # abb::egm::EGMLogger, github.com/ros-industrial/abb_libegm, src/egm_logger.cpp: feedback and planned
    "ABB's abb_libegm": "q=R_FB_POS_RJ{}:deg,target_q=R_PL_POS_RJ{}:deg,qd=R_FB_VEL_RJ{}:deg/s,"
    "target_qd=R_PL_VEL_RJ{}:deg/s",
    # github.com/rpiRobotics/abb_motion_program_exec, robot/HOME/motion_program_logger.mod
    "abb_motion_program_exec": "q=J{}:deg",
    # ClientApplication.collect_data, github.com/lbr-stack/pyfri, doc/examples.rst: measured and interpolated
    "KUKA's FRI (pyfri)": "q=mp{}:rad,target_q=ip{}:rad",
    # Tags and axes of KUKA.Ethernet RSI XML 1.1, joined by points as RSIPI (pypi.org/project/RSIPI) logs them
    "KUKA's RSI": "time=IPOC,q=AIPos.A{}:deg,target_q=ASPos.A{}:deg",
    "KUKA's RSI (RSIPI)": "time=Receive.IPOC,q=Receive.AIPos.A{}:deg,target_q=Receive.ASPos.A{}:deg",
    # RobotStateRt.msg of dsr_msgs2, github.com/doosan-robotics/doosan-robot2; numbered like RTDE's, or in brackets
    "Doosan's RobotStateRt": "time=time_stamp,q=actual_joint_position_{}:deg,qd=actual_joint_velocity_{}:deg/s,"
    "target_q=target_joint_position_{}:deg,target_qd=target_joint_velocity_{}:deg/s",
    "Doosan's RobotStateRt (brackets)": "time=time_stamp,q=actual_joint_position[{}]:deg,"
    "qd=actual_joint_velocity[{}]:deg/s,target_q=target_joint_position[{}]:deg,target_qd=target_joint_velocity[{}]:deg/s",
}
"""Columns of each program, as `named` takes them; joint angles or an accelerometer tell it."""


def vendor_of(header: Sequence[str]) -> tuple[str, str] | None:
    """Return whose names a header has, and the map of those columns that are there; None for others."""
    for vendor, columns in VENDORS.items():
        items = columns.split(",")
        there = [item for item in items if any(map(entry_of(_pattern(item)).fullmatch, header))]
        if any(item.startswith(("q=", "accelerometer=")) for item in there):
            return vendor, ",".join(there)
    return None


def _pattern(item: str) -> str:
    return item.partition("=")[2].partition(":")[0]

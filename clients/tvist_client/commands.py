"""Commands of an arm under control, and questions to a robot; `make schemas` writes their arguments to a stub."""

from tvist_client.command import Leased, Sent, asking, begin, come_to_rest, guide, move, send, send_and_date
from tvist_protocol import commands, forces, io, kinematics, motions, programs, simulation
from tvist_protocol.replies import Posture, ToolPose


class Commands(Leased):
    """Commands that only the client in control may send."""

    move_j = Sent(commands.MoveJ, move)
    move_l = Sent(motions.MoveL, move)
    move_c = Sent(motions.MoveC, move)
    move_path = Sent(motions.MovePath, move)
    move_trajectory = Sent(motions.MoveTrajectory, move)

    servo_j = Sent(motions.ServoJ, guide)
    speed_j = Sent(motions.SpeedJ, guide, 2)
    speed_l = Sent(motions.SpeedL, guide, 2)
    stop_j = Sent(motions.StopJ, come_to_rest, 1)
    stop_l = Sent(motions.StopL, come_to_rest, 1)
    force_mode = Sent(forces.ForceMode, begin)
    freedrive = Sent(forces.Freedrive, begin, 2)
    end_force_mode = Sent(forces.EndForceMode, come_to_rest)
    zero_ftsensor = Sent(forces.ZeroFtsensor, send)

    stop = Sent(commands.Stop, send, 1)
    pause = Sent(commands.Pause, send)
    resume = Sent(commands.Resume, send)
    set_speed = Sent(commands.SetSpeed, send)
    power_on = Sent(commands.PowerOn, send)
    power_off = Sent(commands.PowerOff, send)
    restart_safety = Sent(commands.RestartSafety, send)

    load_program = Sent(programs.ProgramLoad, send, 2)
    run_program = Sent(programs.ProgramRun, send)
    play_program = Sent(programs.ProgramPlay, send)
    pause_program = Sent(programs.ProgramPause, send)
    stop_program = Sent(programs.ProgramStop, send)
    close_popup = Sent(programs.ProgramClosePopup, send)

    set_shaper = Sent(commands.SetShaper, send, 2)
    set_estimator = Sent(commands.SetEstimator, send)
    set_payload = Sent(commands.SetPayload, send)
    forget = Sent(commands.Forget, send)
    set_tcp = Sent(io.SetTcp, send)
    set_registers = Sent(io.SetRegisters, send, 3)

    reset = Sent(simulation.SimulationReset, send_and_date, 1)
    inject = Sent(simulation.SimulationInject, send)
    hand_over = Sent(commands.HandOver, send)
    keep_alive = Sent(commands.KeepAlive, send)


class Questions:
    """Questions to a robot about its kinematics, which need no control."""

    inverse_kinematics = asking(kinematics.InverseKinematics, Posture)
    forward_kinematics = asking(kinematics.ForwardKinematics, ToolPose, 1)

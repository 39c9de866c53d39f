"""Commands of an arm under control, and questions to a robot; `make schemas` writes their arguments to a stub."""

from tvist_client.command import Leased, asking, beginning, dating, guiding, moving, sending, stopping
from tvist_protocol import commands, forces, io, kinematics, motions, programs, simulation
from tvist_protocol.replies import Posture, ToolPose


class Commands(Leased):
    """Commands that only the client in control may send."""

    move_j = moving(commands.MoveJ)
    move_l = moving(motions.MoveL)
    move_c = moving(motions.MoveC)
    move_path = moving(motions.MovePath)

    servo_j = guiding(motions.ServoJ)
    speed_j = guiding(motions.SpeedJ, 2)
    speed_l = guiding(motions.SpeedL, 2)
    stop_j = stopping(motions.StopJ, 1)
    stop_l = stopping(motions.StopL, 1)
    force_mode = beginning(forces.ForceMode)
    freedrive = beginning(forces.Freedrive, 2)
    end_force_mode = stopping(forces.EndForceMode)
    zero_ftsensor = sending(forces.ZeroFtsensor)

    stop = sending(commands.Stop, 1)
    pause = sending(commands.Pause)
    resume = sending(commands.Resume)
    set_speed = sending(commands.SetSpeed)
    power_on = sending(commands.PowerOn)
    power_off = sending(commands.PowerOff)
    restart_safety = sending(commands.RestartSafety)

    load_program = sending(programs.ProgramLoad, 2)
    run_program = sending(programs.ProgramRun)
    play_program = sending(programs.ProgramPlay)
    pause_program = sending(programs.ProgramPause)
    stop_program = sending(programs.ProgramStop)
    close_popup = sending(programs.ProgramClosePopup)

    set_shaper = sending(commands.SetShaper, 2)
    set_estimator = sending(commands.SetEstimator)
    set_payload = sending(commands.SetPayload)
    forget = sending(commands.Forget)
    set_tcp = sending(io.SetTcp)
    set_registers = sending(io.SetRegisters, 3)

    reset = dating(simulation.SimulationReset, 1)
    inject = sending(simulation.SimulationInject)
    hand_over = sending(commands.HandOver)
    keep_alive = sending(commands.KeepAlive)


class Questions:
    """Questions to a robot about its kinematics, which need no control."""

    inverse_kinematics = asking(kinematics.InverseKinematics, Posture)
    forward_kinematics = asking(kinematics.ForwardKinematics, ToolPose, 1)

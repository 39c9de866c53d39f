"""The program in URScript that follows set-points on a robot, and brakes by itself when they stop."""

from string import Template

from tvist_server.moving import registers
from tvist_server.moving.registers import JOINTS, MOST, Ended, State

NAME = "tvist_follow"
"""Name of the program, which robots show."""
SILENCE = 0.04
"""Longest time from the arrival of the last set-point until the arm begins to brake [s]."""
FIRST = 10.0
"""Time to wait for the first set-point [s]."""
AWAY = 0.01
"""Largest distance of a joint from the first set-point [rad]."""
AGAIN = 0.016
"""Longest time from the arrival of the last set-point in which the next is expected to be on its way again [s]."""
CLOSE = 3e-4
"""Distance from the set-points, and from their way in a period, that is made up for in a period [rad]."""
AFTER_SHIFT = 1e-5
"""The same after the program has shifted the motion in time, which is no error that is soon over [rad]."""
FADE = 0.05
"""Time constant with which a distance from the set-points fades [s]."""
MARGIN = 1.05
"""Speed of the arm over that of the fastest set-points, at most."""
_REGISTERS = ("NUMBER", "ORDER", "SETPOINTS", "STATE", "PLAYED", "ENDED", "ALONE", "LEFT_OUT", "RUN", "MOST")


def program(run: int, *, speed: float, deceleration: float, lookahead: float, gain: float) -> str:
    """Return the text of the program, which uses only functions of e-Series (5.9 or later) and CB3 (3.14 or later).

    Args:
        run: Number of this run, 1 to `registers.MOST`, which the program says in its registers.
        speed: Fastest set-points; faster ones end the program [rad/s].
        deceleration: Deceleration of the fastest joint when it ends [rad/s^2].
        lookahead: `lookahead_time` of `servoj`, 0.03 to 0.2 [s].
        gain: `gain` of `servoj`, 100 to 2000.

    Raises:
        ValueError: An argument is outside its range.
    """
    for name, value, least, most in (
        ("run", run, 1, MOST),
        ("speed", speed, 0.01, 10.0),
        ("deceleration", deceleration, 0.1, 100.0),
        ("lookahead", lookahead, 0.03, 0.2),
        ("gain", gain, 100.0, 2000.0),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} is {value:g}: must be {least:g} to {most:g}")
    return _TEXT.substitute(
        {name: getattr(registers, name) for name in _REGISTERS}
        | {f"ended_{one.name.lower()}": int(one) for one in Ended}
        | {f"state_{one.name.lower()}": int(one) for one in State}
        | {"name": NAME, "run": run, "speed": float(MARGIN * speed)}
        | {"deceleration": float(deceleration), "lookahead": float(lookahead), "gain": float(gain)}
        | {
            "silence": SILENCE,
            "first": FIRST,
            "away": AWAY,
            "fade": FADE,
            "again": AGAIN,
            "close": CLOSE,
            "after_shift": AFTER_SHIFT,
        }
        | {
            "steps": " and ".join(f"norm(own[{j}]) <= most" for j in range(JOINTS)),
            "ways": "\n".join(
                f"        if way[{j}] > most:\n          way[{j}] = most\n"
                f"        elif way[{j}] < least:\n          way[{j}] = least\n        end"
                for j in range(JOINTS)
            ),
            "angles": ", ".join(
                f"read_input_float_register({at})" for at in ("at", *(f"at + {k}" for k in range(1, JOINTS)))
            ),
        }
    )


_TEXT = Template("""\
def $name():
  # Follows joint positions that a computer sends through RTDE, one in each control period, and stops the arm by itself
  # when they stop. It moves nothing before the first has come, and after a stop it has ended.
  #
  # Input registers, which one package writes:
  #   integer $NUMBER: number of the newest set-point, 1 more in each period; integer $ORDER: $run to follow, -$run: end
  #   float $SETPOINTS to 47: the newest set-point and the three before it, six joint angles each [rad]
  # Output registers:
  #   integer $STATE: $state_waiting waiting, $state_following following, $state_braking braking, $state_ended ended
  #   integer $PLAYED: number of the set-point whose turn it is; integer $RUN: number of this run
  #   integer $ENDED: why it ended: $ended_ordered ordered, $ended_silence no set-point came,
  #     $ended_away the first is too far from the arm, $ended_too_fast one is too far from the one before,
  #     $ended_lost paused, or out of step, $ended_strayed the arm did not follow
  #   integer $ALONE: periods without a set-point; integer $LEFT_OUT: set-points left out

  def setpoint(at):
    return [$angles]
  end

  write_output_integer_register($PLAYED, 0)
  write_output_integer_register($ENDED, $ended_not)
  write_output_integer_register($ALONE, 0)
  write_output_integer_register($LEFT_OUT, 0)
  write_output_integer_register($STATE, $state_waiting)
  write_output_integer_register($RUN, $run) # the others are of this run from here on

  step = get_steptime()
  most = $speed * step # largest way of a joint in a period [rad]
  least = -most
  near = $away + 4.0 * $speed * ($lookahead + 4.0 * step) # largest distance of the arm from where servoj leads it [rad]
  keep = pow($fade / ($fade + step), 2) # a distance from the set-points fades as if damped critically:
  pull = pow(step / ($fade + step), 2) # what a period keeps of its velocity, and how it pulls

  # What the registers hold may be from before: only a number that changes has a sender.
  old = read_input_integer_register($NUMBER)
  newest = old
  waited = 0.0
  order = read_input_integer_register($ORDER)
  while waited < $first and order != -$run and (newest == old or order != $run):
    sync()
    waited = waited + step
    order = read_input_integer_register($ORDER)
    newest = read_input_integer_register($NUMBER)
  end

  q = get_target_joint_positions() # where servoj leads the arm
  change = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0] # of q in the last period
  before = change # and in the period before
  extra = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0] # what of the change was not the change of the set-points
  last = setpoint($SETPOINTS + 12) # last set-point that was played
  number = newest - 2 # of the present one, which becomes the last but one, so that the newest may be late by a period
  last_number = number
  alone = 0
  left_out = 0
  silence = 0.0
  patience = $silence - 2.5 * step # earlier by what reading and telling may take
  missed = $silence / step # periods
  close = $close # distance that is made up for at once [rad]
  blind = True # whether the last period was without a set-point that had come

  why = $ended_not
  i = 0
  while i < 6:
    if not (norm(last[i] - q[i]) <= $away):
      why = $ended_away
    end
    i = i + 1
  end
  if order != $run:
    why = $ended_ordered
  end
  if waited >= $first:
    why = $ended_silence
  end
  if why == $ended_not:
    write_output_integer_register($STATE, $state_following)
  end

  while why == $ended_not:
    now = read_input_integer_register($NUMBER)
    silence = silence + step
    if now != newest:
      silence = 0.0
      if now < newest: # 1 has followed the largest number
        number = number - $MOST
        last_number = last_number - $MOST
      end
    end
    number = number + 1
    behind = now - number
    if behind > 2 or (blind and silence == 0.0 and behind < 1): # set-points come less late than at first, or later
      number = now - 1
      close = $after_shift
    end

    if read_input_integer_register($ORDER) != $run:
      why = $ended_ordered
    elif behind > missed: # another sender, or a pause: it must not catch up
      why = $ended_lost
    elif silence > patience:
      why = $ended_silence
    end
    newest = now

    lone = blind
    blind = now < number
    if not blind:
      at = $SETPOINTS + 6 * (now - number)
      new = setpoint(at)
      previous = last
      gap = number - last_number
      if gap != 1:
        previous = setpoint(at + 6)
      end
      blind = read_input_integer_register($NUMBER) != now # the next package has come meanwhile
    end
    if blind: # the arm goes on as before, with its acceleration if it is not for long
      way = change + change - before
      if silence > $again or norm(way) > most: # the sum of all joints, since a tick has no time to look at each
        way = change
      end
      alone = alone + 1
    else:
      own = new - previous # change of the set-points in this period
      fast = norm(own)
      if gap != 1: # of two set-points, neither was compared before; there is no time to look at each joint
        if not (fast <= 2.5 * most and norm(new - last) <= 2.5 * most * gap):
          why = $ended_too_fast
        end
      elif not lone and norm(q - get_target_joint_positions()) > near:
        why = $ended_strayed
      end
      if gap != 1 or lone:
        extra = change - own
      end
      off = q - previous
      if norm(off) + norm(extra) <= close and fast + norm(off) <= most:
        q = previous # back onto the set-points at once, which servoj smooths
        way = own
        close = $close
      else:
        way = own + extra * keep - off * pull
      end
      if gap != 1:
        if not (norm(way) <= most):
          way = change
        end
      elif not (fast <= most and norm(way) <= most): # of all joints; only then a tick is to look at each
        if not ($steps): # nor is what is no number
          why = $ended_too_fast
        end
$ways
      end
      extra = way - own
      last = new
      last_number = number
    end
    q = q + way
    before = change
    change = way

    if why == $ended_not:
      write_output_integer_register($PLAYED, number)
      if blind:
        write_output_integer_register($ALONE, alone)
      elif gap > 1:
        left_out = left_out + gap - 1
        write_output_integer_register($LEFT_OUT, left_out)
      end
      servoj(q, t=step, lookahead_time=$lookahead, gain=$gain)
    end
  end

  write_output_integer_register($ENDED, why)
  write_output_integer_register($STATE, $state_braking)
  stopj($deceleration)
  write_output_integer_register($STATE, $state_ended)
  textmsg("$name has ended, reason ", why)
end
""")

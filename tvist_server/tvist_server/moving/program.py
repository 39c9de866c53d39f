"""Sketch of the program, until the real one stands."""


def program(run: int, *, speed: float, deceleration: float, lookahead: float, gain: float) -> str:
    def q(first):
        return "[" + ",".join(f"read_input_float_register({first + k})" for k in range(6)) + "]"

    return f"""def tvist_follow():
  write_output_integer_register(25, 0)
  write_output_integer_register(26, 0)
  write_output_integer_register(29, {run})
  write_output_integer_register(24, 1)
  while read_input_integer_register(24) < 2:
    sync()
  end
  write_output_integer_register(24, 2)
  local last = read_input_integer_register(24)
  local silent = 0
  while read_input_integer_register(25) == 1 and silent < 15:
    local n = read_input_integer_register(24)
    if n == last:
      silent = silent + 1
    else:
      silent = 0
    end
    last = n
    write_output_integer_register(25, n - 1)
    servoj({q(30)}, t=get_steptime(), lookahead_time=0.03, gain=2000)
  end
  write_output_integer_register(24, 3)
  stopj(4.0)
  if silent < 15:
    write_output_integer_register(26, 1)
  else:
    write_output_integer_register(26, 2)
  end
  write_output_integer_register(24, 4)
end
"""

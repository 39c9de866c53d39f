"""A client whose program connects to it and follows its set-points, 500 per second.

`python ur_driver.py HOST FAULT`: after 30 set-points it has a fault, see `FAULTS`.
"""

import math
import os
import signal
import socket
import struct
import sys
import time

HOME = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
FAR = (-0.10, *HOME[1:5], 1.469)  # with the base and the last joint turned
PROGRAM = """def driver():
  global q = get_target_joint_positions()
  global going = True
  thread follow():
    while going:
      servoj(q, t=0.002, lookahead_time=0.03, gain=2000)
    end
    stopj(4)
  end
  if not socket_open("{host}", {port}, "driver"):
    textmsg("nobody listens")
    halt
  end
  got = socket_read_binary_integer(6, "driver", 0)
  h = run follow()
  while going:
    if got[0] == 6:
      q = [got[1], got[2], got[3], got[4], got[5], got[6]] / 1000000
      socket_send_int(1, "driver")
      got = socket_read_binary_integer(6, "driver", 0.2)
    else:
      going = False
    end
  end
  join h
  textmsg("the client has gone")
end
"""


def wave(number):
    """Return joint positions that swing [rad]."""
    return [angle + 0.2 * math.sin(0.01 * number) for angle in HOME]


def steer(stream, postures):
    for q in postures:
        stream.sendall(struct.pack(">6i", *(round(1e6 * angle) for angle in q)))
        stream.recv(4096)
        time.sleep(0.002)


def cut(stream):
    """Reset the connection."""
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    stream.close()


FAULTS = {
    "cut": cut,
    "frozen": lambda _: os.kill(os.getpid(), signal.SIGSTOP),
    "torn": lambda stream: (stream.sendall(b"\1\2\3\4\5"), time.sleep(1.0)),
    "absurd": lambda stream: (stream.sendall(struct.pack(">6i", *[2**31 - 1] * 6)), time.sleep(0.5)),
    "jumping": lambda stream: steer(stream, [FAR] * 60),
}


def main(host, fault):
    with socket.create_server((host, 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection((host, 30002)) as script:
            script.sendall(PROGRAM.format(host=host, port=port).encode())
            stream, _ = server.accept()
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        steer(stream, map(wave, range(30)))
        FAULTS[fault](stream)


if __name__ == "__main__":
    main(*sys.argv[1:])

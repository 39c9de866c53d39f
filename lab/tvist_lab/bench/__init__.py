"""Speed on this machine: how many robots it runs, how late these are, and how fast it computes one."""

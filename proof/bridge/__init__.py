"""A robot that is moved over a link that delays, loses and fails: in another process, or in lockstep in this one."""

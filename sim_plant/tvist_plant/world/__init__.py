"""The arm in MuJoCo, alone and in a world that it touches; only this package needs MuJoCo."""

"""The arm in MuJoCo, alone or in a scene; only this package needs MuJoCo."""

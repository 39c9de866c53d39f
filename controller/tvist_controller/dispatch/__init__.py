"""Commands on their way: who may send them, their plans, and the parts of a robot that they act on."""
